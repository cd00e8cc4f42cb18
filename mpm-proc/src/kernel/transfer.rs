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

/// A transfer scheme. Whether the points have an affine part is the type of their motion ([`AffineState`]).
#[derive(Debug, Clone, Copy)]
pub struct Transfer {
    /// Whether points take the increment of the grid's velocity (FLIP) besides the velocity itself.
    pub increment: bool,
    /// alpha of eq. 28: the share of the grid's velocity (PIC); the rest is the point's own plus the increment.
    pic: Share,
    /// XPIC's filter.
    pub filter: Option<Filter>,
}

/// The filter of extended particle in cell, XPIC(m) (Hammerquist and Nairn 2017).
#[derive(Debug, Clone, Copy)]
pub struct Filter {
    /// m, at least 1 (which is PIC): how often the points' velocities are filtered before they take the increment.
    pub order: u32,
    share: Share,
}

impl Filter {
    /// The share of what the filter finds that is removed from the points' velocities, from 0 (FLIP) to 1 (XPIC).
    pub fn share(&self) -> f64 {
        self.share.share
    }
}

impl Transfer {
    /// As configured.
    pub fn new(config: TransferConfig) -> Self {
        let of_grid = Self {
            increment: false,
            pic: Share::fixed(1.0),
            filter: None,
        };
        let flip = |pic| Self {
            increment: true,
            pic,
            filter: None,
        };
        let filtered = |order, share| Self {
            filter: Some(Filter { order, share }),
            ..flip(Share::fixed(0.0))
        };
        match config {
            TransferConfig::Pic | TransferConfig::Apic => of_grid,
            TransferConfig::Flip => flip(Share::fixed(0.0)),
            TransferConfig::Blend { pic_fraction } => flip(Share::fixed(pic_fraction)),
            TransferConfig::FlipPic { pic_rate } | TransferConfig::Aflip { pic_rate } => {
                flip(Share::at_rate(pic_rate))
            }
            TransferConfig::Xpic { order } => filtered(order, Share::fixed(1.0)),
            TransferConfig::FlipXpic { order, pic_rate } => {
                filtered(order, Share::at_rate(pic_rate))
            }
        }
    }

    /// alpha of eq. 28 in the present step.
    pub fn pic_fraction(&self) -> f64 {
        self.pic.share
    }

    /// The transfer for a step with a kick of this length (s).
    #[must_use]
    pub fn over(self, kick: f64) -> Self {
        let filter = self.filter.map(|filter| Filter {
            share: filter.share.over(kick),
            ..filter
        });
        Self {
            pic: self.pic.over(kick),
            filter,
            ..self
        }
    }

    /// The same with another share of PIC, where it is FLIP with a fixed one.
    #[must_use]
    pub fn with_pic_fraction(self, pic_fraction: f64) -> Self {
        if self.increment && self.pic.per_second.is_none() {
            let pic = Share::fixed(pic_fraction);
            return Self { pic, ..self };
        }
        self
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A stage has a share of PIC of its own for FLIP with a fixed share, and for no other transfer.
    #[test]
    fn the_share_of_a_stage_is_for_flip_with_a_fixed_share() {
        let share = |config| {
            let transfer = Transfer::new(config).with_pic_fraction(0.3);
            transfer.over(0.01).pic_fraction()
        };
        assert_eq!(share(TransferConfig::Flip), 0.3);
        assert_eq!(share(TransferConfig::Blend { pic_fraction: 0.1 }), 0.3);
        assert_eq!(share(TransferConfig::Apic), 1.0);
        let of_rate = share(TransferConfig::FlipPic { pic_rate: 10.0 });
        assert!((of_rate - (1.0 - (-0.1_f64).exp())).abs() < 1e-15);
    }

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
