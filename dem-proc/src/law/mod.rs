//! Contact laws as values. There are few types, one for each kind of law, and a law that lacks a part has zeros for it:
//! no friction, no damping. One `match` at configuration chooses the type ([`crate::setup::laws`]), so no loop branches on it.
//!
//! A law is a normal spring ([`normal`]), a tangential part ([`tangent`]) and a dashpot ([`dashpot`]), combined by
//! [`contact::Contact`]. [`rolling`] adds a moment to any law. [`table`] holds one law for each pair of surfaces,
//! [`mixed`] laws of different kinds. The parameters, their checks and their capabilities are rows of
//! [`interface::config::laws`].
//!
//! Signs: normal quantities are positive along `N` (apart), tangential ones along `T`, `N` turned by +90 degrees;
//! forces are those on the side that `N` points to (the material point, or the owner of the vertex).

pub mod contact;
pub mod dashpot;
pub mod history;
pub mod mixed;
pub mod normal;
pub mod rolling;
pub mod table;
pub mod tangent;

use history::{Numbers, Plain};

/// The state of one contact: the argument of a law.
#[derive(Debug, Clone, Copy, Default)]
pub struct Kinematics {
    /// Overlap `xi` in m; positive in contact.
    pub overlap: f64,
    /// Relative displacement of the two surfaces over the last step along `N` and `T` in m.
    pub moved: [f64; 2],
    /// Relative velocity of the two surfaces at `t_{n-1/2}` along `N` and `T` in m/s.
    pub velocity: [f64; 2],
    /// Sines of the rotations of the two bodies over the last step, each below a quarter of a turn
    /// ([`crate::contact::approach`]).
    pub sines: [f64; 2],
}

impl Kinematics {
    /// Relative rotation over the last step in rad.
    #[inline]
    pub fn rolled(&self) -> f64 {
        self.sines[0].asin() - self.sines[1].asin()
    }

    /// Share of the last step before two surfaces separated, which were in contact at its beginning and are apart now:
    /// the distance along `N` up to the separation, divided by the whole distance.
    #[inline]
    pub fn share_in_contact(&self) -> f64 {
        let way = self.moved[0];
        let share = (way + self.overlap) / way;
        // If the normal has rotated, the distance may be that of an approach.
        let share = if way > 0.0 { share } else { 1.0 };
        if share > 0.0 { share } else { 0.0 }
    }
}

/// The constants of two surfaces that may touch, for a law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairProperties {
    /// Reduced mass `1 / (1/m_1 + 1/m_2)` in kg/m.
    pub mass: f64,
    /// Reduced radius of curvature `R* = 1 / (1/a_1 + 1/a_2)` in m.
    pub radius: f64,
    /// Their surfaces, by number ([`crate::body::surfaces::Surfaces`]).
    pub surfaces: [u32; 2],
}

/// `1 / (1/a + 1/b)`. An outline without sphero-radius is flat at the contact: then the other one counts.
pub fn reduced(a: f64, b: f64) -> f64 {
    if a > 0.0 && b > 0.0 {
        a * b / (a + b)
    } else {
        a.max(b)
    }
}

/// Force, moment and history that a law gives for one contact.
#[derive(Debug, Clone, Copy)]
pub struct Response<H> {
    /// Normal force in N/m; never negative without adhesion.
    pub normal: f64,
    /// Tangential force in N/m.
    pub tangential: f64,
    /// Moment that resists rolling, in N.
    pub moment: f64,
    /// History for the next step.
    pub history: H,
    /// Dissipated over the last step.
    pub loss: Loss,
}

/// Stiffness of a contact, for the step limit.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Stiffness {
    /// `k_n` in N/m per m.
    pub normal: f64,
    /// `k_t` in N/m per m.
    pub tangential: f64,
    /// `k_r` in N per rad.
    pub rolling: f64,
}

impl Stiffness {
    /// All of it `count` times.
    #[inline]
    #[must_use]
    pub fn times(self, count: f64) -> Self {
        Self {
            normal: count * self.normal,
            tangential: count * self.tangential,
            rolling: count * self.rolling,
        }
    }
}

/// Energy that a contact dissipated over the last step, in J/m.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Loss {
    /// By sliding and rolling.
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

/// A contact law.
pub trait Law: Clone + Send + Sync + std::fmt::Debug + 'static {
    /// History of one contact.
    type History: Numbers;
    /// Constants of a pair, computed once when the pair enters a list.
    type Pair: Plain;

    /// The constants of a pair.
    fn pair(&self, properties: &PairProperties) -> Self::Pair;
    /// Largest stiffness of a contact up to this overlap (m). A negative overlap means that the two cannot touch in this
    /// step.
    fn stiffness(&self, pair: &Self::Pair, overlap: f64) -> Stiffness;
    /// The constants `c` in N s/m of a pair's dashpots along N and T, infinite where they follow a stiffness that changes; and
    /// `c^2 / k` in kg/m with the spring of the same direction.
    fn dashpots(&self, pair: &Self::Pair) -> [[f64; 2]; 2];
    /// The normal forces in N/m of a contact with positive overlap: that of the spring, which presses, and that of
    /// adhesion, which pulls.
    fn normal(&self, pair: &Self::Pair, overlap: f64) -> [f64; 2];
    /// Force of a contact, or of several that count as one, whose normal springs press with `spring` (N/m) together.
    /// The normal force is that without adhesion.
    fn response_to_spring(
        &self,
        pair: &Self::Pair,
        spring: f64,
        kinematics: &Kinematics,
        before: &Self::History,
    ) -> Response<Self::History>;
    /// Force of a contact with positive overlap.
    #[inline]
    fn response(
        &self,
        pair: &Self::Pair,
        kinematics: &Kinematics,
        before: &Self::History,
    ) -> Response<Self::History> {
        let [spring, pull] = self.normal(pair, kinematics.overlap);
        let response = self.response_to_spring(pair, spring, kinematics, before);
        Response {
            normal: response.normal - pull,
            ..response
        }
    }
    /// Energy that a contact dissipated in the last step, in which the two separated. Its history ends here.
    fn separate(&self, pair: &Self::Pair, kinematics: &Kinematics, before: &Self::History) -> Loss;
    /// Energy in the springs in J/m.
    fn energy(&self, pair: &Self::Pair, overlap: f64, history: &Self::History) -> f64;
}
