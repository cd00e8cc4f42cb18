//! Points of two groups that touch (Chen 2023), as far as the kit's random cases do not judge it (`kit.rs`): threads, and
//! passage.

use crate::small_scenes::{Points, configured, info, linear_law, step};
use interface::config::{DemConfig, GroupPair};
use interface::message::wire::ImpState;
use interface::solver::DemSolver;

/// Of the points of either group in m.
const RADIUS: [f64; 2] = [0.05, 0.1];
const DT: f64 = 1e-4;

/// Groups 0 and 1 touch; there are no bodies.
fn scene(friction: f64, threads: usize) -> DemConfig {
    DemConfig {
        group_pairs: vec![GroupPair {
            between: [1, 0],
            law: linear_law(1e5, 5e4, friction, 0.0),
        }],
        skin: 0.02,
        threads,
        ..DemConfig::default()
    }
}

/// Points of these groups, at these places (m), with these velocities (m/s); identities are ten times their number.
fn points(all: impl IntoIterator<Item = (u32, [f64; 2], [f64; 2])>) -> Points {
    let point = |(id, (group, position, velocity)): (u64, (u32, _, _))| {
        let mut info = info(10 * id, RADIUS[group as usize], 2.0);
        info.group = group;
        let state = ImpState {
            position,
            velocity,
            ..ImpState::default()
        };
        (info, state)
    };
    Points::new(&(0..).zip(all).map(point).collect::<Vec<_>>())
}

#[test]
fn a_state_goes_on_to_the_same_bits_on_any_number_of_threads() {
    // Two blocks that are thrown at one another.
    let mut heap = points((0..60_u32).map(|i| {
        let (group, [x, y]) = (i / 30, [f64::from(i % 5), f64::from(i % 30 / 5)]);
        let side = 2.0 * RADIUS[group as usize];
        let from = [1.3 * f64::from(group), 0.03 * f64::from(group)];
        let speed = if group == 0 { 4.0 } else { -6.0 };
        let place = [from[0] + side * x, from[1] + side * y];
        (group, place, [speed, 0.5 * f64::from(i % 3)])
    }));
    let mut dem = configured(&scene(0.4, 1));
    dem.imp_set(&heap.set);
    for i in 0..800 {
        heap.step(&mut dem, &step(if i == 0 { 0.0 } else { DT }, DT));
    }
    let saved = dem.save().unwrap();
    let mut others = [1, 3].map(|threads| {
        let mut other = configured(&scene(0.4, threads));
        other.imp_set(&heap.set);
        other.restore(&saved).unwrap();
        (other, heap.clone())
    });
    for i in 0..800 {
        heap.step(&mut dem, &step(DT, DT));
        assert!(i > 0 || heap.forces.iter().any(|f| f.force != [0.0; 2]));
        for (other, points) in &mut others {
            points.step(other, &step(DT, DT));
            assert_eq!(points.forces, heap.forces, "step {i}");
            assert_eq!(other.measurement(), dem.measurement(), "step {i}");
        }
    }
    // Of a scene without pairs it is no state.
    let without = DemConfig {
        group_pairs: Vec::new(),
        ..scene(0.4, 1)
    };
    assert!(configured(&without).restore(&saved).is_err());
}

#[test]
fn points_that_would_pass_through_one_another_stop_the_run() {
    let mut points = points([(0, [0.0; 2], [100.0, 0.0]), (1, [0.16, 0.001], [0.0; 2])]);
    let mut dem = configured(&scene(0.0, 1));
    dem.imp_set(&points.set);
    let fault = (0..100).find_map(|_| {
        points.states[0].position[0] += 100.0 * DT;
        let told = dem.contact(&step(DT, DT), &points.states, &mut points.forces);
        told.err()
    });
    let text = fault.expect("a fault").to_string();
    assert!(
        text.contains("points 0 and 10 of groups 0 and 1 overlap"),
        "{text}"
    );
}
