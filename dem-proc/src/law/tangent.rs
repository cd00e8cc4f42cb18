//! Friction: the tangential part of a law.

use super::history::{ELONGATION, Numbers, Part, Plain, SHEARED};

/// Tangential part of a law.
pub trait Tangent: Plain {
    /// History.
    type State: Numbers;
    /// `k_t` in N/m of a contact whose normal stiffness is `k_n`.
    fn stiffness(&self, k_n: f64) -> f64;
    /// The tangential force of this step. Friction limits it to mu times `pressing`, the normal force. `dashpot` is the
    /// force of the dashpot before that limit (the trial force).
    fn slide(
        &self,
        k_t: f64,
        pressing: f64,
        dashpot: f64,
        moved: f64,
        before: &Self::State,
    ) -> Slide<Self::State>;
    /// Energy in J/m that is lost when a contact separates: the spring's energy, less the work done over the last step.
    fn separate(&self, moved: f64, before: &Self::State) -> f64;
    /// Energy in the spring in J/m.
    fn energy(&self, state: &Self::State) -> f64;
}

/// The result of a [`Tangent`].
#[derive(Debug, Clone, Copy)]
pub struct Slide<S> {
    /// Force of the spring in N/m.
    pub spring: f64,
    /// Force of the dashpot in N/m, within the limit of friction.
    pub dashpot: f64,
    /// History for the next step.
    pub state: S,
    /// Dissipated by sliding over the last step in J/m.
    pub loss: f64,
}

/// `x` limited to the range from `-limit` to `limit`. Each comparison is one instruction, while `f64::clamp` can panic
/// and `f64::max` handles NaN. The numbers here are always finite.
#[inline]
fn within(x: f64, limit: f64) -> f64 {
    let x = if x < limit { x } else { limit };
    if x > -limit { x } else { -limit }
}

/// A spring whose stiffness follows the load, given by its force (N/m) and stiffness (N/m) at the last step, or by moment
/// and `k_r` in N: the same after a displacement `moved` (m, or rad) at the stiffness `k`, with a force of at most `cap`;
/// and the work that went into it. It is incremental in force. When the contact unloads, the force decreases with the
/// stiffness; otherwise a cycle of loading, shearing, unloading and shearing back would create energy (Thornton 2013).
#[inline]
pub(super) fn follow([force, before]: [f64; 2], k: f64, moved: f64, cap: f64) -> ([f64; 2], f64) {
    let kept = if k < before { k / before } else { 1.0 };
    let now = within(force * kept - k * moved, cap);
    ([now, k], -0.5 * (force + now) * moved)
}

/// The energy of such a spring in J/m.
#[inline]
pub(super) fn stored([force, stiffness]: [f64; 2]) -> f64 {
    if stiffness > 0.0 {
        0.5 * force * force / stiffness
    } else {
        0.0
    }
}

/// Coulomb friction with an incremental tangential spring (Jiang 2020 eq. 43 and the text below it).
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
    /// Friction `mu` with a spring of `stiffness` (N/m), which is positive. Without friction there is no spring.
    pub fn new(stiffness: f64, friction: f64) -> Self {
        let slips = friction > 0.0;
        Self {
            stiffness: if slips { stiffness } else { 0.0 },
            compliance: if slips { 1.0 / stiffness } else { 0.0 },
            friction,
        }
    }
}

/// Elongation `xi_t` of the tangential spring along `T` in m. It is a number and not a vector, so it rotates with the
/// contact frame.
pub type Elongation = Part<ELONGATION, 1>;

impl Tangent for Coulomb {
    type State = Elongation;
    #[inline]
    fn stiffness(&self, _: f64) -> f64 {
        self.stiffness
    }
    /// On slip the spring is shortened to the limit of friction. The loss is the mean spring force times the slip,
    /// which closes the energy balance exactly: for `xi -> xi'` under a displacement `u`, the work `k (xi + xi') u / 2`
    /// less the stored `k (xi'^2 - xi^2) / 2` is `k (xi + xi') (u - (xi' - xi)) / 2`.
    #[inline]
    fn slide(
        &self,
        _: f64,
        pressing: f64,
        dashpot: f64,
        moved: f64,
        before: &Elongation,
    ) -> Slide<Elongation> {
        let cap = self.friction * pressing;
        let longest = cap * self.compliance;
        let [before] = before.0;
        let now = within(before + moved, longest);
        let spring = -self.stiffness * now;
        let total = within(spring + dashpot, cap);
        Slide {
            spring,
            dashpot: total - spring,
            state: Part([now]),
            loss: 0.5 * self.stiffness * (now + before) * (moved - (now - before)),
        }
    }
    #[inline]
    fn separate(&self, moved: f64, before: &Elongation) -> f64 {
        0.5 * self.stiffness * before.0[0] * (moved + before.0[0])
    }
    fn energy(&self, state: &Elongation) -> f64 {
        0.5 * self.stiffness * state.0[0] * state.0[0]
    }
}

/// Coulomb friction whose spring is a fixed fraction of the normal stiffness (Mindlin without partial slip; Singer
/// 2022): `k_t / k_n = 2 (1 - nu) / (2 - nu)`.
#[derive(Debug, Clone, Copy)]
pub struct Mindlin {
    /// `k_t / k_n`.
    pub ratio: f64,
    /// `mu`.
    pub friction: f64,
}

/// Force of the spring and `k_t` at the last step, both in N/m.
pub type Sheared = Part<SHEARED, 2>;

impl Tangent for Mindlin {
    type State = Sheared;
    #[inline]
    fn stiffness(&self, k_n: f64) -> f64 {
        self.ratio * k_n
    }
    #[inline]
    fn slide(
        &self,
        k_t: f64,
        pressing: f64,
        dashpot: f64,
        moved: f64,
        before: &Sheared,
    ) -> Slide<Sheared> {
        let cap = self.friction * pressing;
        let (state, work) = follow(before.0, k_t, moved, cap);
        let spring = state[0];
        let total = within(spring + dashpot, cap);
        Slide {
            spring,
            dashpot: total - spring,
            state: Part(state),
            loss: work - (stored(state) - stored(before.0)),
        }
    }
    #[inline]
    fn separate(&self, moved: f64, before: &Sheared) -> f64 {
        stored(before.0) - 0.5 * before.0[0] * moved
    }
    #[inline]
    fn energy(&self, state: &Sheared) -> f64 {
        stored(state.0)
    }
}
