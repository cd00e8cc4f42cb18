//! Forces do not jump at the rebuild of a list. That they do not at a corner is for the kit to judge, whose points go round
//! outlines (`kit.rs`).

use crate::small_scenes::*;
use interface::config::{BodyConfig, ContactLaw, Motion};
use interface::solver::DemSolver;

/// The bits do not depend on the skin, and so not on when lists are rebuilt: with friction, damping, points and bodies.
#[test]
fn lists_leave_no_trace() {
    let run = |skin: f64| {
        let mut random = Random::new(4);
        let mut bodies = walls::open_box(0.8, 1.0, 0.05);
        for i in 0..16 {
            let shape = star(&mut random, 5, 0.06, 0.08);
            bodies.push(BodyConfig {
                position: [0.1 + 0.2 * f64::from(i % 4), 0.1 + 0.2 * f64::from(i / 4)],
                velocity: [random.between(-1.0, 1.0), -1.0],
                spin: random.between(-9.0, 9.0),
                ..body(shape, 0.02)
            });
        }
        let law = ContactLaw::linear(1e6, 3e5, 0.4, 0.1);
        let mut config = scene(bodies, law);
        config.gravity = [0.0, -9.81];
        config.skin = skin;
        // Between the bodies.
        let mut gap = |k: u64| 0.2 * (1 + k % 3) as f64 + random.between(-0.02, 0.02);
        let points: Vec<_> = (0..100_u64)
            .map(|i| (info(i, 0.01, 0.01), at(gap(i), gap(i / 3))))
            .collect();
        let mut points = Points::new(&points);
        let mut dem = configured(&config);
        dem.imp_set(&points.set);
        let dt = 1e-5;
        for i in 0..8000 {
            points.step(&mut dem, &step(if i == 0 { 0.0 } else { dt }, dt));
        }
        assert!(dem.measurement().ledger.friction_work > 0.0);
        (points.states.clone(), dem.measurement().clone())
    };
    let (few, often) = (run(0.1), run(0.004));
    assert_eq!(few.0, often.0);
    assert_eq!(few.1, often.1);
}

/// A damped point goes round a corner in one step: before it was nearest to an edge that it is too far from now to be listed with.
#[test]
fn a_list_of_this_step_knows_where_points_were() {
    let force = |skin: f64| {
        let square = polygon_shape(vec![[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]);
        let fixed = BodyConfig {
            motion: Motion::Fixed,
            ..body(square, 0.0)
        };
        let mut config = scene(vec![fixed], ContactLaw::linear(1e4, 0.0, 0.0, 0.3));
        config.skin = skin;
        let mut dem = configured(&config);
        let mut points = Points::new(&[(info(1, 0.1, 1.0), at(0.99, 1.05))]);
        dem.imp_set(&points.set);
        points.contact(&mut dem, &step(0.0, 0.01)).unwrap();
        dem.advance(&step(0.0, 0.01)).unwrap();
        points.states = vec![at(1.06, 0.97)];
        points.contact(&mut dem, &step(0.01, 0.01)).unwrap();
        points.forces[0].force
    };
    assert_eq!(force(0.5), force(1e-3));
}
