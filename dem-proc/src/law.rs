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
    /// Reduced mass of the pair in kg/m; infinite when neither side can move.
    pub mass: f64,
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
}

/// Energy that a contact dissipated over the last step, in J/m.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Loss {
    /// By sliding.
    pub friction: f64,
    /// By dashpots.
    pub viscous: f64,
}

/// What a contact remembers.
pub trait History: Copy + Default + Send + Sync + std::fmt::Debug + 'static {
    /// Dissipation of the last step.
    fn loss(&self) -> Loss {
        Loss::default()
    }
}

/// A contact law.
pub trait Law: Copy + Send + Sync + std::fmt::Debug + 'static {
    /// Memory of one contact; `()` where there is none.
    type History: History;
    /// Whether the law looks at [`Touch::moved`] and [`Touch::velocity`].
    const MOTION: bool;

    /// Normal and tangential stiffness in N/m per m, of a contact at this overlap or about to close.
    fn stiffness(&self, overlap: f64) -> [f64; 2];
    /// Fraction of critical damping.
    fn damping_ratio(&self) -> f64;
    /// Force of a contact with positive overlap.
    fn press(&self, touch: &Touch, before: &Self::History) -> Press<Self::History>;
    /// What is left of a contact that has opened: no spring, but the loss of its last step.
    fn part(&self, touch: &Touch, before: &Self::History) -> Self::History;
    /// Energy in the springs in J/m.
    fn energy(&self, overlap: f64, history: &Self::History) -> f64;
}

/// Tangential part of a law.
pub trait Tangent: Copy + Send + Sync + std::fmt::Debug + 'static {
    /// Memory.
    type State: Copy + Default + Send + Sync + std::fmt::Debug + 'static;
    /// Whether there is any.
    const ACTIVE: bool;
    /// `k_t` in N/m.
    fn stiffness(&self) -> f64;
    /// Force of the spring, force of the dashpot, new state. `dashpot` is the force that it would like to exert.
    fn slide(
        &self,
        normal: f64,
        dashpot: f64,
        moved: f64,
        before: &Self::State,
    ) -> (f64, f64, Self::State);
    /// Energy in the spring in J/m.
    fn energy(&self, state: &Self::State) -> f64;
    /// Dissipated by sliding over the last step in J/m.
    fn loss(state: &Self::State) -> f64;
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
    fn slide(&self, _: f64, _: f64, _: f64, (): &()) -> (f64, f64, ()) {
        (0.0, 0.0, ())
    }
    fn energy(&self, (): &()) -> f64 {
        0.0
    }
    fn loss((): &()) -> f64 {
        0.0
    }
}

/// Coulomb friction with an incremental tangential spring (eq. 43 and the text below it).
#[derive(Debug, Clone, Copy)]
pub struct Coulomb {
    /// `k_t` in N/m.
    pub stiffness: f64,
    /// `mu`.
    pub friction: f64,
}

/// Memory of [`Coulomb`].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Spring {
    /// Elongation `xi_t` along `T` in m. A number and not a vector, so it turns with the contact frame by itself.
    pub elongation: f64,
    /// Dissipated over the last step in J/m.
    pub loss: f64,
}

impl Tangent for Coulomb {
    type State = Spring;
    const ACTIVE: bool = true;
    fn stiffness(&self) -> f64 {
        self.stiffness
    }
    /// On slip the spring is shortened to what friction carries. The loss is the mean spring force times the slip,
    /// which closes the energy balance exactly: for `xi -> xi'` under a displacement `u`, the work
    /// `k (xi + xi') u / 2` less the stored `k (xi'^2 - xi^2) / 2` is `k (xi + xi') (u - (xi' - xi)) / 2`.
    #[inline]
    fn slide(&self, normal: f64, dashpot: f64, moved: f64, before: &Spring) -> (f64, f64, Spring) {
        let cap = self.friction * normal;
        let longest = cap / self.stiffness;
        let elongation = (before.elongation + moved).clamp(-longest, longest);
        let spring = -self.stiffness * elongation;
        let total = (spring + dashpot).clamp(-cap, cap);
        let slip = moved - (elongation - before.elongation);
        let loss = 0.5 * self.stiffness * (elongation + before.elongation) * slip;
        (spring, total - spring, Spring { elongation, loss })
    }
    fn energy(&self, state: &Spring) -> f64 {
        0.5 * self.stiffness * state.elongation * state.elongation
    }
    fn loss(state: &Spring) -> f64 {
        state.loss
    }
}

/// Viscous part of a law.
pub trait Dashpot: Copy + Send + Sync + std::fmt::Debug + 'static {
    /// Memory.
    type State: Copy + Default + Send + Sync + std::fmt::Debug + 'static;
    /// Whether there is any.
    const ACTIVE: bool;
    /// `zeta`.
    fn ratio(&self) -> f64;
    /// `c = 2 zeta sqrt(k m)` in N s/m per m.
    fn coefficient(&self, stiffness: f64, mass: f64) -> f64;
    /// New state after the forces `exerted` along `N` and `T` while the surfaces `moved`.
    fn remember(exerted: [f64; 2], moved: [f64; 2], before: &Self::State) -> Self::State;
    /// Dissipated over the last step in J/m.
    fn loss(state: &Self::State) -> f64;
}

/// No dashpot.
#[derive(Debug, Clone, Copy)]
pub struct Elastic;

impl Dashpot for Elastic {
    type State = ();
    const ACTIVE: bool = false;
    fn ratio(&self) -> f64 {
        0.0
    }
    fn coefficient(&self, _: f64, _: f64) -> f64 {
        0.0
    }
    fn remember(_: [f64; 2], _: [f64; 2], (): &()) {}
    fn loss((): &()) -> f64 {
        0.0
    }
}

/// Dashpots in both directions, each a fraction of the critical damping of the pair with that direction's spring.
#[derive(Debug, Clone, Copy)]
pub struct Viscous {
    /// `zeta`.
    pub ratio: f64,
}

/// Memory of [`Viscous`].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Dash {
    /// Forces along `N` and `T` at the last step in N/m.
    pub force: [f64; 2],
    /// Dissipated over the last step in J/m.
    pub loss: f64,
}

impl Dashpot for Viscous {
    type State = Dash;
    const ACTIVE: bool = true;
    fn ratio(&self) -> f64 {
        self.ratio
    }
    #[inline]
    fn coefficient(&self, stiffness: f64, mass: f64) -> f64 {
        2.0 * self.ratio * (stiffness * mass).sqrt()
    }
    /// Trapezoid rule over the step: second order, and by summation by parts the very work that the leapfrog's kicks
    /// take out of the kinetic energy.
    #[inline]
    fn remember(exerted: [f64; 2], moved: [f64; 2], before: &Dash) -> Dash {
        let work =
            (exerted[0] + before.force[0]) * moved[0] + (exerted[1] + before.force[1]) * moved[1];
        Dash {
            force: exerted,
            loss: -0.5 * work,
        }
    }
    fn loss(state: &Dash) -> f64 {
        state.loss
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

/// The memory of `Linear<T, D>`.
#[derive(Debug, Clone, Copy)]
pub struct LinearMemory<T: Tangent, D: Dashpot>(pub Memory<T::State, D::State>);

impl<T: Tangent, D: Dashpot> Default for LinearMemory<T, D> {
    fn default() -> Self {
        Self(Memory::default())
    }
}

impl<T: Tangent, D: Dashpot> History for LinearMemory<T, D> {
    #[inline]
    fn loss(&self) -> Loss {
        Loss {
            friction: T::loss(&self.0.tangent),
            viscous: D::loss(&self.0.dashpot),
        }
    }
}

impl<T: Tangent, D: Dashpot> Law for Linear<T, D> {
    type History = LinearMemory<T, D>;
    const MOTION: bool = T::ACTIVE || D::ACTIVE;

    #[inline]
    fn stiffness(&self, _: f64) -> [f64; 2] {
        [self.stiffness, self.tangent.stiffness()]
    }
    fn damping_ratio(&self) -> f64 {
        self.dashpot.ratio()
    }
    #[inline]
    fn press(&self, touch: &Touch, before: &Self::History) -> Press<Self::History> {
        let spring = self.stiffness * touch.overlap;
        let drag = |k: f64, v: f64| -self.dashpot.coefficient(k, touch.mass) * v;
        let normal = (spring + drag(self.stiffness, touch.velocity[0])).max(0.0);
        let wish = drag(self.tangent.stiffness(), touch.velocity[1]);
        let (along, damped, tangent) =
            self.tangent
                .slide(normal, wish, touch.moved[1], &before.0.tangent);
        let exerted = [normal - spring, damped];
        let dashpot = D::remember(exerted, touch.moved, &before.0.dashpot);
        Press {
            normal,
            tangential: along + damped,
            history: LinearMemory(Memory { tangent, dashpot }),
        }
    }
    #[inline]
    fn part(&self, touch: &Touch, before: &Self::History) -> Self::History {
        let (_, _, tangent) = self
            .tangent
            .slide(0.0, 0.0, touch.moved[1], &before.0.tangent);
        let dashpot = D::remember([0.0; 2], touch.moved, &before.0.dashpot);
        LinearMemory(Memory { tangent, dashpot })
    }
    fn energy(&self, overlap: f64, history: &Self::History) -> f64 {
        let depth = overlap.max(0.0);
        0.5 * self.stiffness * depth * depth + self.tangent.energy(&history.0.tangent)
    }
}
