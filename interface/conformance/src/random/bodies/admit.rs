//! Which cases can be run: what no coupled run would do is left out, since no clause says what a solver does there.

use interface::Vec2;
use mechanics::outline::nearest;
use mechanics::reference::bodies::{Body, MOVES, Oracle};
use mechanics::reference::law::{Law, Pair};

use super::case::Case;

/// Whether a point passes a body that it is near by more than it may, from `before` to `now` (m).
pub fn passes(case: &Case, oracle: &Oracle, now: &[Vec2], before: &[Vec2]) -> bool {
    let walkers = case.points.iter().zip(now).zip(before);
    walkers.into_iter().any(|((point, now), before)| {
        oracle.bodies.iter().any(|body| {
            let from = body.carried(*before);
            let far = |(outline, a): &(Vec<Vec2>, f64)| {
                nearest(outline, *now).distance > a + 3.0 * point.info.radius
            };
            // Inside, from one side of the middle to another.
            let turned = |(outline, _): &(Vec<Vec2>, f64)| {
                let seen = [from, *now].map(|x| (x, nearest(outline, x)));
                let [one, other] = seen.map(|(x, near)| (x - near.point) * near.distance.signum());
                let inside = seen.iter().any(|(_, near)| near.distance < 0.0);
                inside && one.dot(&other) < 0.2 * one.norm() * other.norm()
            };
            let parts = body.parts();
            (now - from).norm() > MOVES * point.info.radius && !parts.iter().all(far)
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

/// The smallest length of a case in m: what is smaller by far is not compared.
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
