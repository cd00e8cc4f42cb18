//! Transfers of velocity between points and grid (Jiang 2020 eqs. 26 to 31): PIC, FLIP, their blend, APIC and XPIC; and
//! FLIP with smoothing at a rate per unit of time, by PIC, APIC or XPIC.
//!
//! Smoothing removes the share `alpha` of `R v` from the velocities of the points, where `R` projects on what the
//! transfer cannot represent: `1 - P` for PIC, `P = S M^-1 S^T M_p`, and `(1 - P)^m` for XPIC(m). With a fixed `alpha`
//! for each step, a run with half the step smooths twice as often. With `alpha = 1 - exp(-r k)` for a kick `k`, a part
//! with `R = 1` decays as `exp(-r t)` for any step, and every other part as `exp(-r R t)` with an error of `r k/2` in
//! the exponent. Nairn also takes PIC's share in proportion to the step (Nairn 2015; Hammerquist and Nairn 2017 section
//! 2.4 with XPIC): this is the first term of the share here, which stays below 1 at any step.
//!
//! The affine field of APIC is not made for increments: [`Aflip`] keeps it in addition to FLIP's velocity (the name is
//! that of Fei, Guo, Wu, Huang and Gao 2021). The affine part is then a function of the nodal velocities of the last
//! few steps, and does not smooth: on a wave with the factors `s` of the interpolation, `a` of the affine part to the
//! nodes and `c` back, nodes have `s/(1 - a c)` of the points' velocity, so that APIC's smoothing is `R = 1 - s^2/(1 -
//! a c)`.

use serde::{Deserialize, Serialize, de::DeserializeOwned};

use crate::kernel::blocks::LaneCopy;
use crate::kernel::lanes::{Lanes, splat};

/// A transfer scheme. Its constants are known when the loops are compiled; what it does not use has no state.
pub trait Transfer: Copy + Send + Sync + 'static {
    /// State of four points besides their velocity.
    type Affine: AffineState;

    /// Whether points take the increment of the grid's velocity (FLIP) besides the velocity itself.
    const INCREMENT: bool;

    /// alpha of eq. 28: the share of the grid's velocity (PIC); the rest is the point's own plus the increment.
    fn pic_fraction(&self) -> f64;

    /// m of XPIC(m): how often the points' velocities are filtered before they take the increment; 0 for other transfers.
    fn order(&self) -> u32 {
        0
    }

    /// The share of what its filter finds that a transfer with some [`Self::order`] removes from the points'
    /// velocities.
    fn filtered_share(&self) -> f64 {
        0.0
    }

    /// Sets a block's velocities aside.
    fn set_aside(_v: &[Lanes; 2], _aside: &mut Self::Affine) {}

    /// Replaces a block's velocities by those set aside, less the share of the filtered ones.
    fn take_from_aside(&self, _v: &mut [Lanes; 2], _aside: &Self::Affine) {}

    /// The transfer for a step with a kick of this length (s).
    #[must_use]
    fn over(self, _kick: f64) -> Self {
        self
    }

    /// The same with another share of PIC, where it has a fixed one.
    #[must_use]
    fn with_pic_fraction(self, _fraction: f64) -> Self {
        self
    }
}

/// Affine part of the velocity of four points: nothing, or a matrix.
pub trait AffineState: LaneCopy + Default + Serialize + DeserializeOwned + 'static {
    /// Whether there is one.
    const PRESENT: bool;

    /// `B_p D_p^-1 L` by columns: the change of velocity over one cell along x, and along y, in m/s.
    fn slopes(&self) -> [[Lanes; 2]; 2];

    /// The state with these slopes.
    fn from_slopes(slopes: [[Lanes; 2]; 2]) -> Self;
}

impl AffineState for () {
    const PRESENT: bool = false;

    #[inline(always)]
    fn slopes(&self) -> [[Lanes; 2]; 2] {
        [[crate::kernel::lanes::ZERO; 2]; 2]
    }

    #[inline(always)]
    fn from_slopes(_slopes: [[Lanes; 2]; 2]) -> Self {}
}

impl AffineState for [[Lanes; 2]; 2] {
    const PRESENT: bool = true;

    #[inline(always)]
    fn slopes(&self) -> [[Lanes; 2]; 2] {
        *self
    }

    #[inline(always)]
    fn from_slopes(slopes: [[Lanes; 2]; 2]) -> Self {
        slopes
    }
}

/// Particle in cell (eq. 26).
#[derive(Debug, Clone, Copy)]
pub struct Pic;

impl Transfer for Pic {
    type Affine = ();
    const INCREMENT: bool = false;

    #[inline(always)]
    fn pic_fraction(&self) -> f64 {
        1.0
    }
}

/// Fluid implicit particle (eq. 27).
#[derive(Debug, Clone, Copy)]
pub struct Flip;

impl Transfer for Flip {
    type Affine = ();
    const INCREMENT: bool = true;

    #[inline(always)]
    fn pic_fraction(&self) -> f64 {
        0.0
    }
}

/// A share of what a smoothing finds: the same in every step, or one that grows with the length of the step.
#[derive(Debug, Clone, Copy)]
pub struct Share {
    /// In 1/s, if it grows.
    per_second: Option<f64>,
    /// The share for the present step.
    share: f64,
}

impl Share {
    /// The same in every step, from 0 to 1.
    pub fn fixed(share: f64) -> Self {
        Self {
            per_second: None,
            share,
        }
    }

    /// `1 - exp(-r k)` of a kick of `k` s, with `r` in 1/s.
    pub fn at_rate(per_second: f64) -> Self {
        Self {
            per_second: Some(per_second),
            share: 0.0,
        }
    }

    /// For a kick of this length in s.
    fn over(self, kick: f64) -> Self {
        let Some(rate) = self.per_second else {
            return self;
        };
        Self {
            share: -(-rate * kick).exp_m1(),
            ..self
        }
    }
}

/// A blend of the two (eq. 28): FLIP whose velocities are smoothed by PIC.
#[derive(Debug, Clone, Copy)]
pub struct Blend(
    /// alpha of eq. 28, from 0 (FLIP) to 1 (PIC).
    pub Share,
);

impl Transfer for Blend {
    type Affine = ();
    const INCREMENT: bool = true;

    #[inline(always)]
    fn pic_fraction(&self) -> f64 {
        self.0.share
    }

    fn over(self, kick: f64) -> Self {
        Self(self.0.over(kick))
    }

    fn with_pic_fraction(self, pic_fraction: f64) -> Self {
        match self.0.per_second {
            None => Self(Share::fixed(pic_fraction)),
            Some(_) => self,
        }
    }
}

/// Affine particle in cell (eqs. 29 to 31).
#[derive(Debug, Clone, Copy)]
pub struct Apic;

impl Transfer for Apic {
    type Affine = [[Lanes; 2]; 2];
    const INCREMENT: bool = false;

    #[inline(always)]
    fn pic_fraction(&self) -> f64 {
        1.0
    }
}

/// FLIP with the affine field of APIC, whose velocities are smoothed by APIC.
#[derive(Debug, Clone, Copy)]
pub struct Aflip(
    /// From 0 to 1 (APIC).
    pub Share,
);

impl Transfer for Aflip {
    type Affine = [[Lanes; 2]; 2];
    const INCREMENT: bool = true;

    #[inline(always)]
    fn pic_fraction(&self) -> f64 {
        self.0.share
    }

    fn over(self, kick: f64) -> Self {
        Self(self.0.over(kick))
    }
}

/// FLIP whose velocities are smoothed by extended particle in cell of order m, XPIC(m) (Hammerquist and Nairn 2017).
#[derive(Debug, Clone, Copy)]
pub struct Xpic {
    /// m, at least 1 (which is PIC).
    pub order: u32,
    /// From 0 (FLIP) to 1 (XPIC).
    pub share: Share,
}

/// Velocities set aside while the filter works on what is left of them.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub struct Aside {
    /// Not saved: set aside and taken back within one step.
    #[serde(skip)]
    v: [Lanes; 2],
}

impl AffineState for Aside {
    const PRESENT: bool = false;

    #[inline(always)]
    fn slopes(&self) -> [[Lanes; 2]; 2] {
        [[crate::kernel::lanes::ZERO; 2]; 2]
    }

    #[inline(always)]
    fn from_slopes(_slopes: [[Lanes; 2]; 2]) -> Self {
        Self::default()
    }
}

impl LaneCopy for Aside {
    fn copy_lane(&mut self, to: usize, source: &Self, from: usize) {
        self.v.copy_lane(to, &source.v, from);
    }
}

impl Transfer for Xpic {
    type Affine = Aside;
    const INCREMENT: bool = true;

    #[inline(always)]
    fn pic_fraction(&self) -> f64 {
        0.0
    }

    fn order(&self) -> u32 {
        self.order
    }

    fn filtered_share(&self) -> f64 {
        self.share.share
    }

    fn set_aside(v: &[Lanes; 2], aside: &mut Aside) {
        aside.v = *v;
    }

    fn take_from_aside(&self, v: &mut [Lanes; 2], aside: &Aside) {
        let share = splat(self.share.share);
        *v = [0, 1].map(|a| v[a].mul_neg_add(share, aside.v[a]));
    }

    fn over(self, kick: f64) -> Self {
        let share = self.share.over(kick);
        Self { share, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The remainder of a mode that is filtered completely does not depend on the number of steps.
    #[test]
    fn shares_of_a_rate_compose() {
        let rate = Share::at_rate(40.0);
        let kept = |kick: f64| 1.0 - rate.over(kick).share;
        assert!((kept(0.03) - kept(0.01) * kept(0.02)).abs() < 1e-15);
        assert!((kept(0.03) - (-1.2_f64).exp()).abs() < 1e-15);
        assert!(rate.over(0.0).share.abs() < f64::MIN_POSITIVE);
        assert!(rate.over(1e9).share <= 1.0);
        let fixed = Share::fixed(0.25);
        assert_eq!(fixed.over(0.1).share.to_bits(), fixed.share.to_bits());
    }
}
