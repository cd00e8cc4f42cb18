//! Section 7: the force where a point is on the outline to the last bit; in random cases it is there within rounding.

use interface::config::{BodyShape, Motion};

use super::scene::{RADIUS, SPHERO, STIFFNESS, body, elastic, scene};
use crate::bench::{Bench, Points};
use crate::clause::{Clause, clauses};
use crate::mutant::Flaw;
use crate::verdict::{Judgement, near};

pub const CLAUSES: &[Clause] = clauses! {
    Must "F-7e" "a point on the outline is pushed outwards" by on_the_outline, needs: &["shape:rectangle"];
        - "has no normal on the outline": Flaw::forces(|_, forces| {
            for force in forces
                .iter_mut()
                .filter(|f| (f.force[1] - 1800.0).abs() < 1e-6)
            {
                force.force = [0.0; 2];
            }
        });
};

fn on_the_outline(bench: &Bench) -> Judgement {
    let rectangle = BodyShape::Rectangle {
        width: 0.25,
        height: 0.125,
    };
    let fixed = body(rectangle, [0.0; 2], Motion::Fixed);
    // Numbers without rounding: the point is on the upper edge to the last bit.
    let points = Points::new().with([0.03125, 0.0625], [0.0; 2], RADIUS, 0.5);
    let mut play = bench.run_bodies(&scene(vec![fixed], elastic()))?;
    play.set(&points.set);
    let got = play.measured(0.0, &points.states)?.0.forces[0].force;
    let want = STIFFNESS * (SPHERO + RADIUS);
    near("force along x", got[0], 0.0, 1e-12 * want)?;
    near("force along y", got[1], want, 1e-12 * want)?;
    Ok(format!("{:.1} N/m outwards", got[1]))
}
