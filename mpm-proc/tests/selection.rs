//! What a block that flies measures, and how far it has travelled.

use interface::config::{Probe, Transfer};
use interface::message::wire::ImpForce;
use interface::solver::MpmSolver;

use crate::blocks::{Stepper, block, configured, everywhere};

/// A block that flies: mass, extent and centre are those of its points at `t_n`, the velocity is that of the flight, and so are
/// those of a probe.
#[test]
fn a_measurement_of_a_block_that_flies() {
    let mut config = block();
    config.transfer = Transfer::Apic;
    config.groups[0].velocity = [0.3, -0.2];
    config.probes = vec![Probe {
        name: "corner".into(),
        points: "block".into(),
        within: [[0.1, 0.3], [0.2, 0.4]],
    }];
    let mut mpm = configured(&config);
    let mut stepper = Stepper::new();
    stepper.run(&mut mpm, 2e-4, 3);
    let points = mpm.points();
    stepper.step(&mut mpm, 2e-4, true, &[]).unwrap();
    let groups = &mpm.measurement().groups;
    let of = |fold: fn(f64, f64) -> f64, a: usize| {
        let x = points.iter().map(|p| p.position[a]);
        x.reduce(fold).expect("points")
    };
    for a in 0..2 {
        assert_eq!(groups[0].lower[a], of(f64::min, a));
        assert_eq!(groups[0].upper[a], of(f64::max, a));
        let mean = of(|x, y| x + y, a) / points.len() as f64;
        assert!((groups[0].position[a] - mean).abs() < 1e-12);
        let corner = groups[1].position[a] - [0.15, 0.35][a] - 6e-4 * [0.3, -0.2][a];
        assert!(corner.abs() < 1e-12, "{corner}");
        for group in &groups[..2] {
            let off = group.velocity[a] - [0.3, -0.2][a];
            assert!(off.abs() < 1e-12, "{:?}", group.velocity);
        }
    }
    for (group, mass) in groups.iter().zip([60.0, 10.0]) {
        assert!((group.mass - mass).abs() < 1e-9, "{}", group.mass);
        let kinetic = 0.5 * mass * (0.3 * 0.3 + 0.2 * 0.2);
        assert!((group.kinetic / kinetic - 1.0).abs() < 1e-11);
    }
}

/// Points that a body presses on move by a pass of their own; the travel is still that of the flight.
#[test]
fn a_block_that_flies_travels_at_its_speed_while_a_body_presses() {
    let mut config = block();
    config.groups[0].velocity = [0.3, -0.2];
    let mut mpm = configured(&config);
    let count = mpm.select_imps(&everywhere()).len();
    let mut forces = vec![ImpForce::default(); count];
    forces[count / 2].force = [1e-9, 0.0]; // of 60 kg/m
    let mut stepper = Stepper::new();
    for n in 1..4 {
        stepper.step(&mut mpm, 2e-4, false, &forces).unwrap();
        let way = 0.3_f64.hypot(0.2) * 2e-4 * f64::from(n);
        assert!((mpm.travel() / way - 1.0).abs() < 1e-9, "{}", mpm.travel());
    }
}
