//! The displacement of surfaces since a reference time. It decides when lists are rebuilt and when envelopes are
//! requested.

use interface::Vec2;
use serde::{Deserialize, Serialize};

use crate::body::bodies::Bodies;

/// The displacement of surfaces since a reference time: a cheap upper bound, and the exact value if the bound is too
/// coarse.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Displacement {
    /// Poses of the bodies at the reference time.
    start: Vec<(Vec2, f64)>,
    /// Upper bound of the largest displacement since `start` in m: the sum of largest speed times step. It is replaced
    /// by the exact value when the sum is too coarse.
    bound: f64,
}

impl Displacement {
    /// Makes the present poses the reference.
    pub fn reset(&mut self, bodies: &Bodies) {
        self.start.clear();
        (self.start).extend(bodies.state.iter().map(|s| (s.center, s.angle)));
        self.bound = 0.0;
    }

    /// The bodies move with surface speeds up to `speed` (m/s) for `dt` (s).
    pub fn advance(&mut self, speed: f64, dt: f64) {
        self.bound += speed * dt;
    }

    /// Whether the displacement of every surface is below `limit` (m).
    pub fn stays_below(&mut self, limit: f64, bodies: &Bodies) -> bool {
        self.bound(limit, bodies) < limit
    }

    /// Upper bound in m of the displacement; where it is above `coarse` (m), the largest `|c - c_ref| + R |theta -
    /// theta_ref|` of a body.
    pub fn bound(&mut self, coarse: f64, bodies: &Bodies) -> f64 {
        if self.bound >= coarse {
            let moved = bodies.state.iter().zip(&self.start);
            let moved = moved.map(|(state, (center, angle))| {
                (state.center - center).norm() + state.extent * (state.angle - angle).abs()
            });
            self.bound = moved.fold(0.0, f64::max);
        }
        self.bound
    }

    /// Reference poses of the bodies; empty if there is no reference yet.
    pub fn start(&self) -> &[(Vec2, f64)] {
        &self.start
    }
}
