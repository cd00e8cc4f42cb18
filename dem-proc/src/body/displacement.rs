//! The displacement of surfaces since a reference time. It decides when lists are rebuilt and when envelopes are
//! requested.

use interface::Vec2;
use interface::solver::Refusal;
use serde::{Deserialize, Serialize};

use crate::body::bodies::Bodies;
use crate::saved::{count, finite};

/// Poses of the bodies at a reference time, to measure the displacement of their surfaces since then.
#[derive(Debug, Clone, Default)]
struct Reference(Vec<(Vec2, f64)>);

impl Reference {
    /// Stores the present poses.
    fn set(&mut self, bodies: &Bodies) {
        self.0.clear();
        self.0
            .extend(bodies.state.iter().map(|s| (s.center, s.angle)));
    }

    /// Upper bound of the displacement of any body's surface since the reference time, in m: `|c - c_ref| + R |theta -
    /// theta_ref|`.
    fn travelled(&self, bodies: &Bodies) -> f64 {
        let moved = bodies.state.iter().zip(&self.0);
        moved
            .map(|(state, (center, angle))| {
                (state.center - center).norm() + state.extent * (state.angle - angle).abs()
            })
            .fold(0.0, f64::max)
    }
}

/// The displacement of surfaces since a reference time: a cheap upper bound, and the exact value if the bound is too
/// coarse.
#[derive(Debug, Clone, Default)]
pub struct Displacement {
    start: Reference,
    /// Upper bound of the largest displacement since `start` in m: the sum of largest speed times step. It is replaced
    /// by the exact value when the sum is too coarse.
    bound: f64,
    /// The last answer. It replaces `bound` only when the bodies move, so that a step that is evaluated twice gets the
    /// same answer twice.
    found: Option<f64>,
}

impl Displacement {
    /// Makes the present poses the reference.
    pub fn reset(&mut self, bodies: &Bodies) {
        self.start.set(bodies);
        (self.bound, self.found) = (0.0, None);
    }

    /// The bodies move with surface speeds up to `speed` (m/s) for `dt` (s).
    pub fn advance(&mut self, speed: f64, dt: f64) {
        self.bound = self.found.take().unwrap_or(self.bound) + speed * dt;
    }

    /// Whether the displacement of every surface is below `limit` (m).
    pub fn stays_below(&mut self, limit: f64, bodies: &Bodies) -> bool {
        self.bound(limit, bodies) < limit
    }

    /// Upper bound in m of the displacement, exact where it is above `coarse` (m).
    pub fn bound(&mut self, coarse: f64, bodies: &Bodies) -> f64 {
        let mut bound = self.bound;
        if bound >= coarse {
            bound = self.start.travelled(bodies);
        }
        self.found = Some(bound);
        bound
    }

    /// Reference poses of the bodies; empty if there is no reference yet.
    pub fn start(&self) -> &[(Vec2, f64)] {
        &self.start.0
    }

    /// For a saved state.
    pub fn save(&self) -> SavedDisplacement {
        let Self {
            start,
            bound,
            found: _, // of an evaluation that nothing has followed
        } = self;
        let poses = start.0.iter().map(|(c, angle)| [c.x, c.y, *angle]);
        SavedDisplacement {
            poses: poses.collect(),
            bound: *bound,
        }
    }

    /// Restores what was saved.
    ///
    /// # Errors
    /// A refusal if it was saved for other bodies.
    pub fn restored(saved: &SavedDisplacement, bodies: &Bodies) -> Result<Self, Refusal> {
        let SavedDisplacement { poses, bound } = saved;
        if !poses.is_empty() {
            count("poses", poses.len(), bodies.len())?;
        }
        finite(|| "a pose".into(), poses.as_flattened())?;
        finite(|| "a distance travelled".into(), &[*bound])?;
        let poses = poses.iter().map(|&[x, y, angle]| (Vec2::new(x, y), angle));
        Ok(Self {
            start: Reference(poses.collect()),
            bound: *bound,
            found: None,
        })
    }
}

/// A [`Displacement`] in a saved state.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct SavedDisplacement {
    /// Reference centre (m) and angle (rad) of each body; empty if there is no reference yet.
    poses: Vec<[f64; 3]>,
    /// In m.
    bound: f64,
}
