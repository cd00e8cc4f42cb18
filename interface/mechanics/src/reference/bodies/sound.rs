//! Steps that a coupled run may have: beyond them no clause says what a solver does.

use interface::config::OverlapMeasure;
use interface::message::wire::ImpInfo;

use super::{BLUR, Body, Expected, Oracle, Vec3, Who, shared};
use crate::mass::swept;
use crate::outline::thickness;

/// Most by which a point moves towards or along what it touches in a step, as a share of its radius; a run allows half.
pub const MOVES: f64 = 0.45;
/// Deepest overlap of a point, as a share of its radius; and of its centre in a polygon, as a share of the radius of a disc of the
/// same area.
const DEEP: f64 = 0.95;
const INSIDE: f64 = 0.5;
/// Deepest overlap of two bodies, as a share of the sum of their sphero-radii; of an area its mean depth, as a share of the
/// thickness of the thinner one.
const DEEP_BODIES: f64 = 0.3;
/// Least width of an area that two bodies share over its square root.
const NARROW: f64 = 0.4;
/// Most by which a body turns in a step, in rad.
const TURNS: f64 = 0.3;

impl Oracle {
    /// Whether a coupled run may have the step that was last taken, in which the bodies have moved from these `poses`; of all
    /// points that there may be.
    pub fn is_sound(&self, poses: &[Vec3], expected: &Expected, points: &[ImpInfo]) -> bool {
        let bodies = &self.config.bodies;
        let radius = |id: u64| {
            let point = points.iter().find(|point| point.id == id);
            point.map_or(0.0, |point| point.radius)
        };
        let too_deep = expected.touches.iter().any(|touch| match touch.who {
            Who::Point(id, b, _) => {
                // Not near the middle of a polygon, and not as deep in what has no inside.
                let own = radius(id);
                touch.overlap
                    > match &self.bodies[b].parts()[..] {
                        [(outline, a)] if outline.len() > 2 => {
                            let of_disc = (swept(outline, *a).area / std::f64::consts::PI).sqrt();
                            (a + (1.0 + BLUR) * own).max(own + INSIDE * of_disc)
                        }
                        _ => DEEP * own,
                    }
            }
            Who::Points(p, q) => touch.overlap > 0.5 * radius(p).min(radius(q)),
            // `is_through` looks at them.
            Who::Bodies(..) if self.config.overlap == OverlapMeasure::Area => false,
            Who::Bodies(i, _, j, _) => {
                let both = bodies[i].sphero_radius + bodies[j].sphero_radius;
                touch.overlap > DEEP_BODIES * both || touch.moved > 0.2 * both
            }
        });
        // Points that keep near a body move with it, so only what bodies do to one another is left.
        let radii = points.iter().map(|point| point.radius);
        let most = MOVES * radii.fold(f64::INFINITY, f64::min);
        let moves = self.bodies.iter().zip(poses);
        let too_far = moves.map(|(b, pose)| b.pose - pose).any(|moved| {
            let finite = moved.norm().is_finite();
            !finite || moved.z.abs() > TURNS || moved.xy().norm() > most
        });
        let area =
            self.config.body_contact.is_some() && self.config.overlap == OverlapMeasure::Area;
        !(too_deep || too_far || (area && self.is_through(poses)))
    }

    /// Whether two bodies that share an area reach through one another, at these `poses` or after the step.
    fn is_through(&self, poses: &[Vec3]) -> bool {
        let now: Vec<_> = self.bodies.iter().map(Body::corners).collect();
        let mut then = self.bodies.clone();
        then.iter_mut()
            .zip(poses)
            .for_each(|(body, pose)| body.pose = *pose);
        let then: Vec<_> = then.iter().map(Body::corners).collect();
        let pairs = (0..now.len()).flat_map(|j| (0..j).map(move |i| [i, j]));
        pairs.into_iter().any(|[i, j]| {
            let both = [&then, &now].map(|at| shared(&at[i], &at[j]));
            let thinner = thickness(&now[i]).min(thickness(&now[j]));
            let deep = both.iter().flatten().any(|shared| {
                let (area, width) = (shared.area, shared.push.norm());
                area > DEEP_BODIES * thinner * width || width < NARROW * area.sqrt()
            });
            let turned = matches!(both, [Some(then), Some(now)] if then.push.dot(&now.push) < 0.0);
            deep || turned
        })
    }
}
