//! The contacts in a frame add up to the loads of the bodies, for every measure of the overlap.

use crate::small_scenes::*;
use dem_proc::Sdem;
use interface::config::{BodyConfig, BodyShape, DemConfig, OverlapMeasure};
use interface::message::wire::ContactState;
use interface::solver::DemSolver;

/// A floor, a block askew on it and a disc on the block, with two points that press on block and disc, after some steps: friction
/// has a history.
fn pile(overlap: OverlapMeasure) -> (Sdem, Points) {
    // The measure by area needs sharp corners: the same outlines without rounding, and a square in place of the disc.
    let sharp = overlap == OverlapMeasure::Area;
    let (rounding, grown) = if sharp { (0.0, 0.2) } else { (0.1, 0.0) };
    let rectangle = |width, height| rectangle_shape(width + grown, height + grown);
    let block = BodyConfig {
        position: [0.0, 0.695],
        velocity: [0.3, -0.1],
        angle: 0.05,
        ..body(rectangle(1.0, 1.0), rounding)
    };
    let disc = BodyConfig {
        position: [0.2, 1.57],
        velocity: [-0.2, -0.1],
        ..if sharp {
            body(rectangle(0.4, 0.4), 0.0)
        } else {
            body(BodyShape::Disc, 0.3)
        }
    };
    let config = DemConfig {
        overlap,
        ..scene(
            vec![fixed(rectangle(4.0, 0.2), rounding), block, disc],
            frictional(1e4, 5e3, 0.4),
        )
    };
    let mut dem = configured(&config);
    let mut points = Points::new(&[
        (info(7, 0.05, 1.0), at(-0.62, 0.8)),
        (info(9, 0.05, 1.0), at(0.2, 1.9)),
    ]);
    dem.imp_set(&points.set);
    let mut before = 0.0;
    for _ in 0..20 {
        points.step(&mut dem, &step(before, 1e-4));
        before = 1e-4;
    }
    (dem, points)
}

#[test]
fn contacts_add_up_to_the_loads_of_each_body() {
    let measures = [
        OverlapMeasure::EachEdge,
        OverlapMeasure::NearestEdge,
        OverlapMeasure::Area,
    ];
    for measure in measures {
        let (mut dem, mut points) = pile(measure);
        let step = step(1e-4, 1e-4);
        dem.contact(&step, &points.states, &mut points.forces)
            .unwrap();
        let contacts = DemSolver::contacts(&dem, &step, &points.states);
        let bodies = &dem.measurement().bodies;
        let of_points = contacts.iter().filter(|c| c.with == 1);
        let others: Vec<u64> = of_points.map(|c| c.other).collect();
        assert_eq!(others, [7, 9], "{measure:?}");
        assert!(contacts.len() >= 4, "{measure:?}: {contacts:?}");
        let mut slides = false;
        for (b, body) in (0..).zip(bodies) {
            let (mut force, mut torque) = ([0.0; 2], 0.0);
            for contact in &contacts {
                let ContactState {
                    body: first,
                    other,
                    with,
                    position,
                    force: f,
                } = *contact;
                let sign = match (first == b, with == 0 && other == b) {
                    (true, _) => 1.0,
                    (_, true) => -1.0,
                    _ => continue,
                };
                let arm = [0, 1].map(|i| position[i] - body.position[i]);
                force = [force[0] + sign * f[0], force[1] + sign * f[1]];
                torque += sign * (arm[0] * f[1] - arm[1] * f[0]);
                slides |= f[0].abs() > 1e-3;
            }
            let scale = 1e-10 * (1.0 + body.body_force[1].abs());
            for (i, got) in force.into_iter().enumerate() {
                let expected = body.body_force[i] + body.point_force[i];
                assert!(
                    (got - expected).abs() < scale,
                    "{measure:?} body {b}: {got} {expected}"
                );
            }
            let expected = body.body_torque + body.point_torque;
            assert!(
                (torque - expected).abs() < scale,
                "{measure:?} body {b}: {torque} {expected}"
            );
        }
        assert!(slides, "{measure:?}: friction acts");
    }
}
