//! Contact laws as types: one `match` at configuration chooses, no loop branches on a law, and what a law does not
//! use takes no memory (STYLE.md habit 3).
//!
//! Signs: normal quantities are positive along `N` (apart), tangential ones along `T`, `N` turned by +90 degrees;
//! forces are those on the side that `N` points to (the material point, or the owner of the vertex).

/// The state of one contact, as a law sees it.
#[derive(Debug, Clone, Copy, Default)]
pub struct Touch {
    /// Overlap `xi` in m; positive in contact.
    pub overlap: f64,
    /// Relative displacement of the two surfaces over the last step along `N` and `T` in m.
    pub moved: [f64; 2],
    /// Relative velocity of the two surfaces at `t_{n-1/2}` along `N` and `T` in m/s.
    pub velocity: [f64; 2],
}

/// The interval behind, over which things have moved.
#[derive(Debug, Clone, Copy)]
pub struct Past {
    /// `t_n - t_{n-1}` in s; 0 where there is none.
    pub dt: f64,
    /// One over it, or 0.
    pub per_dt: f64,
}

impl Past {
    /// An interval of `dt` (s).
    pub fn new(dt: f64) -> Self {
        let per_dt = if dt > 0.0 { 1.0 / dt } else { 0.0 };
        Self { dt, per_dt }
    }
}

/// Two things that may touch, as a law sees them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mates {
    /// Reduced mass `1 / (1/m_1 + 1/m_2)` in kg/m.
    pub mass: f64,
    /// Reduced radius of curvature `1 / (1/a_1 + 1/a_2)` in m.
    pub radius: f64,
}

/// The answer of a law.
#[derive(Debug, Clone, Copy)]
pub struct Press<H> {
    /// Normal force in N/m; never negative without adhesion.
    pub normal: f64,
    /// Tangential force in N/m.
    pub tangential: f64,
    /// What to remember until the next step.
    pub history: H,
    /// Dissipated over the last step.
    pub loss: Loss,
}

/// Energy that a contact dissipated over the last step, in J/m.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Loss {
    /// By sliding.
    pub friction: f64,
    /// By dashpots.
    pub viscous: f64,
}

impl std::ops::AddAssign for Loss {
    fn add_assign(&mut self, other: Self) {
        self.friction += other.friction;
        self.viscous += other.viscous;
    }
}

/// Plain values that may be stored in arrays and shared between threads.
pub trait Plain: Copy + Send + Sync + std::fmt::Debug + 'static {}
impl<T: Copy + Send + Sync + std::fmt::Debug + 'static> Plain for T {}

/// A contact law.
pub trait Law: Plain {
    /// Memory of one contact; `()` where there is none.
    type History: Plain + Default;
    /// What of a pair never changes, worked out when the pair enters a list.
    type Pair: Plain;
    /// Whether the law looks at [`Touch::moved`] and [`Touch::velocity`].
    const MOTION: bool;

    /// The constants of a pair.
    fn pair(&self, mates: &Mates) -> Self::Pair;
    /// Normal and tangential stiffness in N/m per m, of a contact at this overlap or about to close.
    fn stiffness(&self, pair: &Self::Pair, overlap: f64) -> [f64; 2];
    /// Fraction of critical damping.
    fn damping_ratio(&self) -> f64;
    /// Force of a contact with positive overlap.
    fn press(
        &self,
        pair: &Self::Pair,
        touch: &Touch,
        before: &Self::History,
    ) -> Press<Self::History>;
    /// Loss of the last step of a contact that has opened; nothing else is left of it.
    fn part(&self, touch: &Touch, before: &Self::History) -> Loss;
    /// Energy in the springs in J/m.
    fn energy(&self, pair: &Self::Pair, overlap: f64, history: &Self::History) -> f64;
}

/// Tangential part of a law.
pub trait Tangent: Plain {
    /// Memory.
    type State: Plain + Default;
    /// Whether there is any.
    const ACTIVE: bool;
    /// `k_t` in N/m.
    fn stiffness(&self) -> f64;
    /// The tangential force of this step. `dashpot` is the force that a dashpot would like to exert.
    fn slide(
        &self,
        normal: f64,
        dashpot: f64,
        moved: f64,
        before: &Self::State,
    ) -> Slide<Self::State>;
    /// Energy in the spring in J/m.
    fn energy(&self, state: &Self::State) -> f64;
}

/// The answer of a [`Tangent`].
#[derive(Debug, Clone, Copy)]
pub struct Slide<S> {
    /// Force of the spring in N/m.
    pub spring: f64,
    /// Force of the dashpot in N/m, as far as friction carries it.
    pub dashpot: f64,
    /// What to remember.
    pub state: S,
    /// Dissipated by sliding over the last step in J/m.
    pub loss: f64,
}

/// No friction: no tangential force, no memory.
#[derive(Debug, Clone, Copy)]
pub struct Smooth;

impl Tangent for Smooth {
    type State = ();
    const ACTIVE: bool = false;
    fn stiffness(&self) -> f64 {
        0.0
    }
    #[inline]
    fn slide(&self, _: f64, _: f64, _: f64, (): &()) -> Slide<()> {
        Slide {
            spring: 0.0,
            dashpot: 0.0,
            state: (),
            loss: 0.0,
        }
    }
    fn energy(&self, (): &()) -> f64 {
        0.0
    }
}

/// Coulomb friction with an incremental tangential spring (eq. 43 and the text below it).
#[derive(Debug, Clone, Copy)]
pub struct Coulomb {
    /// `k_t` in N/m.
    stiffness: f64,
    /// `1 / k_t`: a multiplication in the loop instead of a division.
    compliance: f64,
    /// `mu`.
    friction: f64,
}

impl Coulomb {
    /// Friction `mu` with a spring of `stiffness` (N/m), which is positive.
    pub fn new(stiffness: f64, friction: f64) -> Self {
        Self {
            stiffness,
            compliance: 1.0 / stiffness,
            friction,
        }
    }
}

/// `x` cut off at plus and minus `limit`. One instruction each, where `f64::clamp` has a panic and `f64::max` a case
/// for NaN; numbers that are not finite never come here.
#[inline(always)]
fn within(x: f64, limit: f64) -> f64 {
    let x = if x < limit { x } else { limit };
    if x > -limit { x } else { -limit }
}

/// Elongation `xi_t` of the tangential spring along `T` in m. A number and not a vector, so it turns with the contact
/// frame by itself.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Elongation(pub f64);

impl Tangent for Coulomb {
    type State = Elongation;
    const ACTIVE: bool = true;
    fn stiffness(&self) -> f64 {
        self.stiffness
    }
    /// On slip the spring is shortened to what friction carries. The loss is the mean spring force times the slip,
    /// which closes the energy balance exactly: for `xi -> xi'` under a displacement `u`, the work
    /// `k (xi + xi') u / 2` less the stored `k (xi'^2 - xi^2) / 2` is `k (xi + xi') (u - (xi' - xi)) / 2`.
    #[inline]
    fn slide(
        &self,
        normal: f64,
        dashpot: f64,
        moved: f64,
        before: &Elongation,
    ) -> Slide<Elongation> {
        let cap = self.friction * normal;
        let longest = cap * self.compliance;
        let before = before.0;
        let now = within(before + moved, longest);
        let spring = -self.stiffness * now;
        let total = within(spring + dashpot, cap);
        Slide {
            spring,
            dashpot: total - spring,
            state: Elongation(now),
            loss: 0.5 * self.stiffness * (now + before) * (moved - (now - before)),
        }
    }
    fn energy(&self, state: &Elongation) -> f64 {
        0.5 * self.stiffness * state.0 * state.0
    }
}

/// Viscous part of a law.
pub trait Dashpot: Plain {
    /// Memory: the forces along `N` and `T` at the last step, where there are any.
    type State: Plain + Default;
    /// Coefficients of a pair.
    type Pair: Plain;
    /// Whether there is any.
    const ACTIVE: bool;
    /// `zeta`.
    fn ratio(&self) -> f64;
    /// Coefficients `c = 2 zeta sqrt(k m)` for the stiffness in each direction.
    fn pair(&self, stiffness: [f64; 2], mass: f64) -> Self::Pair;
    /// Force in N/m of a relative velocity.
    fn drag(pair: &Self::Pair, velocity: [f64; 2]) -> [f64; 2];
    /// Dissipated over the last step in J/m, in which the surfaces `moved`, and what to remember of the forces
    /// `exerted` at its end.
    fn remember(exerted: [f64; 2], moved: [f64; 2], before: &Self::State) -> (f64, Self::State);
}

/// No dashpot.
#[derive(Debug, Clone, Copy)]
pub struct Elastic;

impl Dashpot for Elastic {
    type State = ();
    type Pair = ();
    const ACTIVE: bool = false;
    fn ratio(&self) -> f64 {
        0.0
    }
    fn pair(&self, _: [f64; 2], _: f64) {}
    #[inline]
    fn drag((): &(), _: [f64; 2]) -> [f64; 2] {
        [0.0; 2]
    }
    #[inline]
    fn remember(_: [f64; 2], _: [f64; 2], (): &()) -> (f64, ()) {
        (0.0, ())
    }
}

/// Dashpots in both directions, each a fraction of the critical damping of the pair with that direction's spring.
#[derive(Debug, Clone, Copy)]
pub struct Viscous {
    /// `zeta`.
    pub ratio: f64,
}

impl Dashpot for Viscous {
    type State = [f64; 2];
    type Pair = [f64; 2];
    const ACTIVE: bool = true;
    fn ratio(&self) -> f64 {
        self.ratio
    }
    fn pair(&self, stiffness: [f64; 2], mass: f64) -> [f64; 2] {
        stiffness.map(|k| 2.0 * self.ratio * (k * mass).sqrt())
    }
    #[inline]
    fn drag(c: &[f64; 2], velocity: [f64; 2]) -> [f64; 2] {
        [-c[0] * velocity[0], -c[1] * velocity[1]]
    }
    /// Trapezoid rule over the step: second order, and by summation by parts the very work that the leapfrog's kicks
    /// take out of the kinetic energy.
    #[inline]
    fn remember(exerted: [f64; 2], moved: [f64; 2], before: &[f64; 2]) -> (f64, [f64; 2]) {
        let work = (exerted[0] + before[0]) * moved[0] + (exerted[1] + before[1]) * moved[1];
        (-0.5 * work, exerted)
    }
}

/// Memory of a law that is put together from a tangential and a viscous part.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Memory<S, D> {
    /// Tangential part.
    pub tangent: S,
    /// Viscous part.
    pub dashpot: D,
}

/// Linear spring (eq. 43), `F_n = k_n xi`, with friction `T` and damping `D`.
///
/// The dashpot never pulls: where it would make the normal force negative, the force is zero.
#[derive(Debug, Clone, Copy)]
pub struct Linear<T, D> {
    /// `k_n` in N/m.
    pub stiffness: f64,
    /// Friction.
    pub tangent: T,
    /// Damping.
    pub dashpot: D,
}

impl<T: Tangent, D: Dashpot> Law for Linear<T, D> {
    type History = Memory<T::State, D::State>;
    type Pair = D::Pair;
    const MOTION: bool = T::ACTIVE || D::ACTIVE;

    fn pair(&self, mates: &Mates) -> D::Pair {
        let stiffness = [self.stiffness, self.tangent.stiffness()];
        self.dashpot.pair(stiffness, mates.mass)
    }
    #[inline]
    fn stiffness(&self, _: &D::Pair, _: f64) -> [f64; 2] {
        [self.stiffness, self.tangent.stiffness()]
    }
    fn damping_ratio(&self) -> f64 {
        self.dashpot.ratio()
    }
    #[inline]
    fn press(&self, pair: &D::Pair, touch: &Touch, before: &Self::History) -> Press<Self::History> {
        let spring = self.stiffness * touch.overlap;
        let [drag, wish] = D::drag(pair, touch.velocity);
        let pushed = spring + drag;
        let normal = if pushed > 0.0 { pushed } else { 0.0 };
        let slide = self
            .tangent
            .slide(normal, wish, touch.moved[1], &before.tangent);
        let exerted = [normal - spring, slide.dashpot];
        let (viscous, dashpot) = D::remember(exerted, touch.moved, &before.dashpot);
        Press {
            normal,
            tangential: slide.spring + slide.dashpot,
            history: Memory {
                tangent: slide.state,
                dashpot,
            },
            loss: Loss {
                friction: slide.loss,
                viscous,
            },
        }
    }
    #[inline]
    fn part(&self, touch: &Touch, before: &Self::History) -> Loss {
        let slide = self
            .tangent
            .slide(0.0, 0.0, touch.moved[1], &before.tangent);
        let (viscous, _) = D::remember([0.0; 2], touch.moved, &before.dashpot);
        Loss {
            friction: slide.loss,
            viscous,
        }
    }
    fn energy(&self, _: &D::Pair, overlap: f64, history: &Self::History) -> f64 {
        let depth = overlap.max(0.0);
        0.5 * self.stiffness * depth * depth + self.tangent.energy(&history.tangent)
    }
}
