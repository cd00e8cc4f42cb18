//! Which cases can be run: what no coupled run would do is left out, since no clause says what a solver does there.

use interface::Vec2;
use interface::config::OverlapMeasure;
use mechanics::mass::swept;
use mechanics::outline::{nearest, thickness};
use mechanics::reference::bodies::{BLUR, Body, Expected, Oracle, Vec3, Who, shared};
use mechanics::reference::law::{Law, Pair};

use super::case::Case;

/// Most by which a point moves towards or along what it touches in a step, as a share of its radius; a run allows half.
const MOVES: f64 = 0.45;
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

/// Whether a coupled run may have a step, in which the bodies have moved from these `poses`.
pub fn is_sound(case: &Case, oracle: &Oracle, poses: &[Vec3], expected: &Expected) -> bool {
    let bodies = &case.config.bodies;
    let too_deep = expected.touches.iter().any(|touch| match touch.who {
        Who::Point(id, b, _) => {
            // Not near the middle of a polygon, and not as deep in what has no inside.
            let own = radius(case, id);
            touch.overlap
                > match &oracle.bodies[b].parts()[..] {
                    [(outline, a)] if outline.len() > 2 => {
                        let of_disc = (swept(outline, *a).area / std::f64::consts::PI).sqrt();
                        (a + (1.0 + BLUR) * own).max(own + INSIDE * of_disc)
                    }
                    _ => DEEP * own,
                }
        }
        Who::Points(p, q) => touch.overlap > 0.5 * radius(case, p).min(radius(case, q)),
        // `is_through` looks at them.
        Who::Bodies(..) if case.config.overlap == OverlapMeasure::Area => false,
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
    let area = case.config.body_contact.is_some() && case.config.overlap == OverlapMeasure::Area;
    !(too_deep || too_far || (area && is_through(oracle, poses)))
}

/// Whether two bodies that share an area reach through one another, at these `poses` or after the step.
fn is_through(oracle: &Oracle, poses: &[Vec3]) -> bool {
    let now: Vec<_> = oracle.bodies.iter().map(Body::corners).collect();
    let mut then = oracle.bodies.clone();
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

/// Whether a point passes a body that it is near by more than it may, from `before` to `now` (m).
pub fn passes(case: &Case, oracle: &Oracle, now: &[Vec2], before: &[Vec2]) -> bool {
    let walkers = case.points.iter().zip(now).zip(before);
    walkers.into_iter().any(|((point, now), before)| {
        oracle.bodies.iter().any(|body| {
            let moved = now - before - body.moved(now - body.pose.xy());
            let far = |(outline, a): &(Vec<Vec2>, f64)| {
                nearest(outline, *now).distance > a + 3.0 * point.info.radius
            };
            // Inside, from one side of the middle to another.
            let turned = |(outline, _): &(Vec<Vec2>, f64)| {
                let seen = [now - moved, *now].map(|x| (x, nearest(outline, x)));
                let [one, other] = seen.map(|(x, near)| (x - near.point) * near.distance.signum());
                let inside = seen.iter().any(|(_, near)| near.distance < 0.0);
                inside && one.dot(&other) < 0.2 * one.norm() * other.norm()
            };
            let parts = body.parts();
            moved.norm() > MOVES * point.info.radius && !parts.iter().all(far)
                || parts.iter().any(turned)
        })
    })
}

/// Whether a chain goes through a disc: it is as near to the centre as no chain comes that is pressed from outside.
pub fn pierces(case: &Case, oracle: &Oracle, now: &[Vec2]) -> bool {
    case.segments().any(|ends| {
        let most = 0.6 * case.points[ends[0]].info.radius;
        let near = |(center, _)| nearest(&ends.map(|k| now[k]), center).distance <= most;
        oracle.bodies.iter().flat_map(Body::outline).any(near)
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
