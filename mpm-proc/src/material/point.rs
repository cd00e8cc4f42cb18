//! The data that every material has at a point: stress, volume and deformation.

use serde::{Deserialize, Serialize};

use crate::kernel::lanes::{Lanes, ZERO, splat};

/// Stress of four points in Pa.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct Stress {
    /// `sigma_xx`.
    pub xx: Lanes,
    /// `sigma_yy`.
    pub yy: Lanes,
    /// `sigma_zz`, out of plane.
    pub zz: Lanes,
    /// `sigma_xy`.
    pub xy: Lanes,
}

impl Stress {
    /// `sigma_m`, the mean of the normal stresses in Pa.
    #[inline(always)]
    pub fn mean(&self) -> Lanes {
        (self.xx + self.yy + self.zz) * splat(1.0 / 3.0)
    }

    /// Mean stress and deviator.
    #[inline(always)]
    pub fn split(&self) -> (Lanes, Deviator) {
        let mean = self.mean();
        let deviator = Deviator {
            xx: self.xx - mean,
            yy: self.yy - mean,
            zz: self.zz - mean,
            xy: self.xy,
        };
        (mean, deviator)
    }
}

/// `s = sigma - sigma_m 1` of four points in Pa.
#[derive(Debug, Clone, Copy)]
pub struct Deviator {
    /// `s_xx`.
    pub xx: Lanes,
    /// `s_yy`.
    pub yy: Lanes,
    /// `s_zz`, out of plane.
    pub zz: Lanes,
    /// `s_xy`.
    pub xy: Lanes,
}

impl Deviator {
    /// `tau = sqrt(s:s/2)` in Pa.
    #[inline(always)]
    pub fn shear(&self) -> Lanes {
        let Self { xx, yy, zz, xy } = *self;
        let half = splat(0.5) * zz.mul_add(zz, yy.mul_add(yy, xx * xx));
        xy.mul_add(xy, half).sqrt()
    }

    /// `s:s` in Pa^2.
    #[inline(always)]
    pub fn squared(&self) -> Lanes {
        let Self { xx, yy, zz, xy } = *self;
        xx * xx + yy * yy + zz * zz + splat(2.0) * xy * xy
    }

    /// The stress with this mean and `ratio` times this deviator.
    #[inline(always)]
    pub fn scaled_about(&self, mean: Lanes, ratio: Lanes) -> Stress {
        Stress {
            xx: self.xx.mul_add(ratio, mean),
            yy: self.yy.mul_add(ratio, mean),
            zz: self.zz.mul_add(ratio, mean),
            xy: self.xy * ratio,
        }
    }
}

/// The data of four points, as a model sees them.
#[derive(Debug, Clone, Copy)]
pub struct Point<P> {
    /// Stress at `t_n`.
    pub stress: Stress,
    /// Volume over initial volume.
    pub volume: Lanes,
    /// The state of the model besides stress and volume.
    pub state: P,
}

/// What happens to four points over an interval: the velocity gradient times its length, `L_ij dt = dv_i/dx_j dt`, in the
/// middle of the interval.
#[derive(Debug, Clone, Copy)]
pub struct Deformation {
    /// `dv_x/dx dt`.
    pub xx: Lanes,
    /// `dv_x/dy dt`.
    pub xy: Lanes,
    /// `dv_y/dx dt`.
    pub yx: Lanes,
    /// `dv_y/dy dt`.
    pub yy: Lanes,
}

impl Deformation {
    /// The gradient with respect to the places in the middle of the interval, from that with respect to those at its end
    /// (`half` = 1/2) or its start (-1/2).
    ///
    /// Points move by `u`; with `A = du/dx_end` and `x_middle = x_end - u/2`,
    /// `du/dx_middle = A (1 - A/2)^-1 = (A - det A/2) / det(1 - A/2)`, and likewise from the start with the other sign.
    /// Strain and spin of the middle make rate forms exact to second order (Hughes and Winget 1980).
    #[inline(always)]
    #[must_use]
    pub fn in_the_middle(self, half: Lanes) -> Self {
        let Self { xx, xy, yx, yy } = self;
        let one = splat(1.0);
        let half_det = half * (xx * yy - xy * yx);
        let per = one / (one - half * (xx + yy - half_det));
        Self {
            xx: (xx - half_det) * per,
            xy: xy * per,
            yx: yx * per,
            yy: (yy - half_det) * per,
        }
    }

    /// No deformation.
    pub const NOTHING: Self = Self {
        xx: ZERO,
        xy: ZERO,
        yx: ZERO,
        yy: ZERO,
    };
}

/// `exp(trace)` to second order, positive whatever the step: volume after an interval over volume before, where it is
/// integrated as a rate.
#[inline(always)]
pub(super) fn swelling(trace: Lanes) -> Lanes {
    trace.mul_add(trace.mul_add(splat(0.5), splat(1.0)), splat(1.0))
}

/// Work per initial volume that was lost in an interval, in Pa.
#[derive(Debug, Clone, Copy)]
pub struct Dissipated {
    /// To plastic flow.
    pub plastic: Lanes,
    /// To viscous stress.
    pub viscous: Lanes,
}

impl Dissipated {
    /// No dissipation.
    pub const NOTHING: Self = Self {
        plastic: ZERO,
        viscous: ZERO,
    };
}

impl<P> Point<P> {
    /// A point without stress, of its initial volume.
    pub fn unstressed(state: P) -> Self {
        Self {
            stress: Stress {
                xx: ZERO,
                yy: ZERO,
                zz: ZERO,
                xy: ZERO,
            },
            volume: splat(1.0),
            state,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gradient(rows: [[f64; 2]; 2]) -> Deformation {
        let [[xx, xy], [yx, yy]] = rows.map(|row| row.map(splat));
        Deformation { xx, xy, yx, yy }
    }

    fn rows(by: Deformation) -> [[f64; 2]; 2] {
        [[by.xx, by.xy], [by.yx, by.yy]].map(|row| row.map(|x| x.to_array()[0]))
    }

    /// A turn by 1 rad in one interval, and a stretch to twice the length, as seen from both ends: the middle sees no
    /// strain in the one, and in the other the change of length over the mean length.
    #[test]
    fn the_middle_is_the_same_from_both_ends() {
        let (sin, cos) = 1.0_f64.sin_cos();
        let turned = [[cos - 1.0, -sin], [sin, cos - 1.0]]; // R - 1
        let turned_back = [[1.0 - cos, -sin], [sin, 1.0 - cos]]; // 1 - R^T
        let spin = 2.0 * 0.5_f64.tan();
        let stretched = [[1.0, 0.0], [0.0, 0.0]];
        let stretched_back = [[0.5, 0.0], [0.0, 0.0]];
        for (at_start, at_end, middle) in [
            (turned, turned_back, [[0.0, -spin], [spin, 0.0]]),
            (stretched, stretched_back, [[2.0 / 3.0, 0.0], [0.0, 0.0]]),
        ] {
            for (rows_of, half) in [(at_start, -0.5), (at_end, 0.5)] {
                let found = rows(gradient(rows_of).in_the_middle(splat(half)));
                for (found, middle) in found.as_flattened().iter().zip(middle.as_flattened()) {
                    assert!((found - middle).abs() < 1e-15, "{half}: {found} {middle}");
                }
            }
        }
    }
}
