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
//! The affine field of APIC is not made for increments: AFLIP keeps it in addition to FLIP's velocity (the name is
//! that of Fei, Guo, Wu, Huang and Gao 2021). The affine part is then a function of the nodal velocities of the last
//! few steps, and does not smooth: on a wave with the factors `s` of the interpolation, `a` of the affine part to the
//! nodes and `c` back, nodes have `s/(1 - a c)` of the points' velocity, so that APIC's smoothing is `R = 1 - s^2/(1 -
//! a c)`.

use interface::config::Transfer as TransferConfig;
use serde::{Serialize, de::DeserializeOwned};

use crate::kernel::blocks::PointBlock;
use crate::kernel::lanes::Lanes;

/// A transfer scheme in one step. Whether the points have an affine part is the type of their motion ([`AffineState`]).
#[derive(Debug, Clone, Copy)]
pub struct Transfer {
    /// Whether points take the increment of the grid's velocity (FLIP) besides the velocity itself.
    pub increment: bool,
    /// alpha of eq. 28: the share of the grid's velocity (PIC); the rest is the point's own plus the increment.
    pub pic_fraction: f64,
    /// XPIC's filter.
    pub filter: Option<Filter>,
}

/// The filter of extended particle in cell, XPIC(m) (Hammerquist and Nairn 2017).
#[derive(Debug, Clone, Copy)]
pub struct Filter {
    /// m, at least 1 (which is PIC): how often the points' velocities are filtered before they take the increment.
    pub order: u32,
    /// The share of what the filter finds that is removed from the points' velocities, from 0 (FLIP) to 1 (XPIC).
    pub share: f64,
}

impl Transfer {
    /// As configured, for a step with a kick of this length (s).
    pub fn of(config: TransferConfig, kick: f64) -> Self {
        let flip = |pic_fraction| Self {
            increment: true,
            pic_fraction,
            filter: None,
        };
        let filtered = |order, share| Self {
            filter: Some(Filter { order, share }),
            ..flip(0.0)
        };
        match config {
            TransferConfig::Pic | TransferConfig::Apic => Self {
                increment: false,
                ..flip(1.0)
            },
            TransferConfig::Flip => flip(0.0),
            TransferConfig::Blend { pic_fraction } => flip(pic_fraction),
            TransferConfig::FlipPic { pic_rate } | TransferConfig::Aflip { pic_rate } => {
                flip(share(pic_rate, kick))
            }
            TransferConfig::Xpic { order } => filtered(order, 1.0),
            TransferConfig::FlipXpic { order, pic_rate } => filtered(order, share(pic_rate, kick)),
        }
    }
}

/// `1 - exp(-r t)`, with `r` in 1/s: the share of what a smoothing finds that it takes in `t` s.
pub fn share(rate: f64, over: f64) -> f64 {
    -(-rate * over).exp_m1()
}

/// Affine part of the velocity of four points: nothing, or a matrix.
pub trait AffineState:
    PointBlock + Send + Sync + Default + Serialize + DeserializeOwned + 'static
{
    /// Whether there is one.
    const PRESENT: bool;

    /// `B_p D_p^-1 L` by columns: the change of velocity over one cell along x, and along y, in m/s.
    fn slopes(&self) -> Slopes;

    /// The state with these slopes.
    fn from_slopes(slopes: Slopes) -> Self;
}

/// No affine part.
pub type NoSlopes = [Lanes; 0];

impl AffineState for NoSlopes {
    const PRESENT: bool = false;

    #[inline(always)]
    fn slopes(&self) -> Slopes {
        [[crate::kernel::lanes::ZERO; 2]; 2]
    }

    #[inline(always)]
    fn from_slopes(_slopes: Slopes) -> Self {
        []
    }
}

/// The affine part of APIC ([`AffineState::slopes`]).
pub type Slopes = [[Lanes; 2]; 2];

impl AffineState for Slopes {
    const PRESENT: bool = true;

    #[inline(always)]
    fn slopes(&self) -> Slopes {
        *self
    }

    #[inline(always)]
    fn from_slopes(slopes: Slopes) -> Self {
        slopes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The remainder of a mode that is filtered completely does not depend on the number of steps.
    #[test]
    fn shares_of_a_rate_compose() {
        let kept = |kick: f64| 1.0 - share(40.0, kick);
        assert!((kept(0.03) - kept(0.01) * kept(0.02)).abs() < 1e-15);
        assert!((kept(0.03) - (-1.2_f64).exp()).abs() < 1e-15);
        assert!(share(40.0, 0.0).abs() < f64::MIN_POSITIVE);
        assert!(share(40.0, 1e9) <= 1.0);
    }
}
