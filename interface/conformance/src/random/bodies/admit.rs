//! Which cases can be run: what no coupled run would do is left out, since no clause says what a solver does there.

use interface::Vec2;
use mechanics::outline::nearest;
use mechanics::reference::bodies::{Expected, Oracle, Vec3, Who};
use mechanics::reference::law::{Law, Pair};

use super::case::Case;

/// Most by which a point moves towards or along what it touches in a step, as a share of its radius; a run allows half.
const MOVES: f64 = 0.45;
/// Deepest overlap of a point, as a share of its radius.
const DEEP: f64 = 0.95;
/// Deepest overlap of two bodies, as a share of the sum of their sphero-radii.
const DEEP_BODIES: f64 = 0.3;
/// Most by which a body turns in a step, in rad.
const TURNS: f64 = 0.3;

/// Whether a coupled run may have a step, in which the bodies have moved from these `poses`.
pub fn is_sound(case: &Case, oracle: &Oracle, poses: &[Vec3], expected: &Expected) -> bool {
    let bodies = &case.config.bodies;
    let too_deep = expected.touches.iter().any(|touch| match touch.who {
        Who::Point(id, ..) => touch.overlap > DEEP * radius(case, id),
        Who::Points(p, q) => touch.overlap > 0.5 * radius(case, p).min(radius(case, q)),
        Who::Bodies(i, _, j, _) => {
            let both = bodies[i].sphero_radius + bodies[j].sphero_radius;
            touch.overlap > DEEP_BODIES * both || touch.moved > 0.2 * both
        }
    });
    // Points that keep near a body move with it, so only what bodies do to one another is left.
    let radii = case.points.iter().map(|p| p.info.radius);
    let most = MOVES * radii.fold(f64::INFINITY, f64::min);
    let moves = oracle.bodies.iter().zip(poses);
    let too_far = moves.map(|(b, pose)| b.pose - pose).any(|moved| {
        let finite = moved.norm().is_finite();
        !finite || moved.z.abs() > TURNS || moved.xy().norm() > most
    });
    !too_deep && !too_far
}

/// Whether a point passes a body that it is near by more than it may, from `before` to `now` (m).
pub fn passes(case: &Case, oracle: &Oracle, now: &[Vec2], before: &[Vec2]) -> bool {
    let walkers = case.points.iter().zip(now).zip(before);
    walkers.into_iter().any(|((point, now), before)| {
        oracle.bodies.iter().any(|body| {
            let moved = now - before - body.moved(now - body.pose.xy());
            let far = |(outline, a): &(Vec<Vec2>, f64)| {
                nearest(outline, *now).distance > a + 3.0 * point.info.radius
            };
            moved.norm() > MOVES * point.info.radius && !body.parts().iter().all(far)
        })
    })
}

/// The smallest length of a case in m: of what is smaller by far, nothing is told.
pub fn smallest(case: &Case) -> f64 {
    let points = case.points.iter().map(|p| p.info.radius);
    let bodies = case.config.bodies.iter().map(|b| b.sphero_radius);
    let lengths = points.chain(bodies.filter(|a| *a > 0.0));
    lengths.reduce(f64::min).unwrap_or(1.0)
}

/// Energy in J/m and impulse in N s/m that a contact of a case has if it is as deep as the smallest length.
pub fn typical(case: &Case) -> (f64, f64) {
    let radius = smallest(case);
    let mass = case.points.first().map_or(1.0, |point| point.info.mass);
    let law = Law::of(&case.config.point_contact, Pair { mass, radius });
    let stiffness = law.normal_stiffness(radius);
    let impulse = (stiffness * mass).sqrt() * radius;
    (stiffness * radius * radius, impulse)
}

fn radius(case: &Case, id: u64) -> f64 {
    let point = case.points.iter().find(|p| p.info.id == id);
    point.map_or(0.0, |p| p.info.radius)
}
