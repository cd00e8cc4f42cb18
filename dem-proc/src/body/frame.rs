//! The data of a body that each of its contacts needs in every step.

use interface::Vec2;
use serde::{Deserialize, Serialize};

/// The motion of a body over the last step: the part of a [`Frame`] that is saved.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
#[repr(C)]
pub struct LastMove {
    /// Displacement of the centre of mass in m.
    pub shift: Vec2,
    /// Sine of the rotation.
    pub sin: f64,
    /// One minus its cosine.
    pub versine: f64,
}

/// The data of a body that each of its contacts needs in every step: one cache line.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub struct Frame {
    /// Centre of mass `c` in m.
    pub center: Vec2,
    /// Over the last step.
    pub last: LastMove,
    /// `1/m`, 0 for a body that forces do not move.
    pub inverse_mass: f64,
    /// `1/I`, 0 for a body that forces do not rotate.
    pub inverse_inertia: f64,
}

const _: () = assert!(size_of::<Frame>() == 64);

impl Frame {
    /// Moves by `shift` (m) and rotates by `angle` (rad).
    #[inline]
    pub(super) fn advance(&mut self, shift: Vec2, angle: f64) {
        let square = angle * angle;
        let (sin, versine) = if square < 1e-4 {
            // The next terms of the series are below 1e-17 of the first, so this is as exact as the library. A step
            // rarely rotates a body by more than a hundredth.
            (
                angle
                    * (1.0
                        - square
                            * (1.0 / 6.0)
                            * (1.0 - square * (1.0 / 20.0) * (1.0 - square * (1.0 / 42.0)))),
                0.5 * square
                    * (1.0
                        - square
                            * (1.0 / 12.0)
                            * (1.0 - square * (1.0 / 30.0) * (1.0 - square * (1.0 / 56.0)))),
            )
        } else {
            let (sin_half, cos_half) = (0.5 * angle).sin_cos();
            (2.0 * sin_half * cos_half, 2.0 * sin_half * sin_half)
        };
        self.center += shift;
        self.last = LastMove {
            shift,
            sin,
            versine,
        };
    }

    /// A vector fixed to the body, given before the last step, after the rotation of that step.
    #[inline]
    pub fn turned(&self, v: Vec2) -> Vec2 {
        let LastMove { sin, versine, .. } = self.last;
        Vec2::new(
            v.x - versine * v.x - sin * v.y,
            v.y - versine * v.y + sin * v.x,
        )
    }

    /// Displacement in m of the material that is now at `r` from the centre of mass: exact for any angle, so that a
    /// pair that rotates as a whole has no relative displacement.
    #[inline]
    pub fn displacement(&self, r: Vec2) -> Vec2 {
        let LastMove {
            shift,
            sin,
            versine,
        } = self.last;
        shift + Vec2::new(versine * r.x - sin * r.y, sin * r.x + versine * r.y)
    }
}
