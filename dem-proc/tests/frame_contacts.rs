//! The contacts in a frame add up to the loads of the bodies, for every measure of the overlap.

use crate::small_scenes::*;
use dem_proc::Sdem;
use interface::config::{BodyConfig, BodyShape, DemConfig, GroupPair, Motion, OverlapMeasure};
use interface::message::wire::{ContactState, ImpInfo};
use interface::solver::DemSolver;

/// A floor, a block askew on it and a disc on the block, with two points that press on block and disc, after some steps: friction
/// has a history.
fn pile(overlap: OverlapMeasure) -> (Sdem, Points) {
    // The measure by area needs sharp corners: the same outlines without rounding, and a square in place of the disc.
    let sharp = overlap == OverlapMeasure::Area;
    let (rounding, grown) = if sharp { (0.0, 0.2) } else { (0.1, 0.0) };
    let rectangle = |width, height| BodyShape::Rectangle {
        width: width + grown,
        height: height + grown,
    };
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

#[test]
fn without_points_only_contacts_of_bodies_are_reported() {
    let ball = |y| BodyConfig {
        position: [0.0, y],
        ..body(BodyShape::Disc, 0.5)
    };
    let mut config = scene(vec![ball(0.0), ball(0.9)], spring(1e4));
    config.bodies[0].motion = Motion::Fixed;
    let mut dem = configured(&config);
    dem.contact(&OPENING, &[], &mut []).unwrap();
    let contacts = DemSolver::contacts(&dem, &OPENING, &[]);
    let [contact] = contacts[..] else {
        panic!("{contacts:?}")
    };
    let (a, b) = (contact.body, contact.other);
    assert!((a, b) == (0, 1) || (a, b) == (1, 0));
    let up = if a == 1 { 1.0 } else { -1.0 };
    assert!((contact.force[1] - up * 1000.0).abs() < 1e-9);
    assert!((contact.position[1] - 0.45).abs() < 1e-12);
}

/// Points of a group that lie on a floor, and points of another one that slide on them: what is told adds up to the force
/// on each point. Contacts of two points were left out.
#[test]
fn contacts_of_pairs_of_points_add_up_to_the_forces_on_the_points() {
    let law = frictional(1e4, 5e3, 0.4);
    let floor = BodyShape::Rectangle {
        width: 4.0,
        height: 0.2,
    };
    let config = DemConfig {
        group_pairs: vec![GroupPair {
            between: [0, 1],
            law,
        }],
        ..scene(vec![fixed(floor, 0.1)], law)
    };
    let mut dem = configured(&config);
    let of_group = |id, group| ImpInfo {
        group,
        ..info(id, 0.05, 1.0)
    };
    let mut points = Points::new(&[
        (of_group(7, 0), at(0.01, 0.245)),
        (of_group(8, 0), at(0.19, 0.245)),
        (of_group(11, 1), at(0.1, 0.246)),
        (of_group(12, 1), at(0.03, 0.34)),
    ]);
    points.states[3].velocity = [2.0, -0.1];
    dem.imp_set(&points.set);
    let mut before = 0.0;
    for _ in 0..20 {
        points.step(&mut dem, &step(before, 1e-4));
        before = 1e-4;
    }
    let step = step(1e-4, 1e-4);
    dem.contact(&step, &points.states, &mut points.forces)
        .unwrap();
    let contacts = DemSolver::contacts(&dem, &step, &points.states);
    let pairs = contacts.iter().filter(|c| c.with == 2);
    let ids: Vec<_> = pairs.clone().map(|c| [c.body, c.other]).collect();
    assert_eq!(ids, [[7, 11], [7, 12], [8, 11]], "{contacts:?}");
    for (info, got) in points.set.iter().zip(&points.forces) {
        let mut sum = [0.0; 2];
        for contact in &contacts {
            let sign = match contact.with {
                1 | 2 if contact.other == info.id => -1.0,
                2 if contact.body == info.id => 1.0,
                _ => continue,
            };
            sum = [0, 1].map(|i| sum[i] + sign * contact.force[i]);
        }
        for (sum, got) in sum.iter().zip(got.force) {
            assert!((sum - got).abs() < 1e-10, "{}: {sum} {got}", info.id);
        }
    }
    // It acts between the two, and that of 12 on 7 drags: friction is told too.
    let sliding = pairs.clone().find(|c| c.other == 12).unwrap();
    let [p, q] = [0, 3].map(|slot: usize| points.states[slot].position);
    for i in 0..2 {
        let middle = 0.5 * (p[i] + q[i]);
        assert!((sliding.position[i] - middle).abs() < 1e-12);
    }
    let across = [q[1] - p[1], p[0] - q[0]];
    let along = sliding.force[0] * across[0] + sliding.force[1] * across[1];
    assert!(along.abs() > 0.05, "{sliding:?}");
}
