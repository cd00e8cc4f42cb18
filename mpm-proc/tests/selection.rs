//! IMP selection against looking at every point and every outline.

use interface::Vec2;
use interface::config::{Fill, Probe, Spacing, Transfer};
use interface::message::wire::{EnvelopeVertex, ImpForce};
use interface::solver::MpmSolver;
use mechanics::outline::nearest;

use crate::against_reference::everywhere;
use crate::blocks::{Random, Stepper, block, configured};

#[test]
fn the_selection_is_that_of_brute_force() {
    let mut random = Random::new(11);
    let mut config = block();
    config.groups[0].fill = Fill::Rectangle {
        lower: [-0.1, 0.2],
        upper: [0.7, 0.8],
    };
    config.groups[0].spacing = Spacing::Distance(0.011);
    config.groups[0].velocity = [1.0, 0.5];
    config.cell = 0.02;
    let mut mpm = configured(&config);
    let mut stepper = Stepper::new();
    let mut found = 0;
    for round in 0..30 {
        stepper.run(&mut mpm, 1e-4, 5);
        assert!(mpm.travel() > 0.0);
        // A disc, a segment, a triangle, a star with forty vertices.
        let mut envelopes = Vec::new();
        for (body, count) in [1, 2, 3, 40].into_iter().enumerate() {
            let centre = [random.between(-0.2, 0.8), random.between(0.1, 0.9)];
            let size = random.between(0.01, 0.5);
            let reach = random.between(0.0, 0.05);
            let turn = random.between(0.0, 6.0);
            for i in 0..count {
                let angle = turn + std::f64::consts::TAU * f64::from(i) / f64::from(count);
                let radius = size * if i % 2 == 0 { 1.0 } else { 0.6 };
                envelopes.push(EnvelopeVertex {
                    body: body as u64,
                    position: [
                        centre[0] + radius * angle.cos(),
                        centre[1] + radius * angle.sin(),
                    ],
                    reach,
                });
            }
        }
        let chosen: Vec<u64> = mpm.select_imps(&envelopes).iter().map(|i| i.id).collect();
        assert_eq!(mpm.travel(), 0.0);
        // Half of the stretched spacing: the rectangle is 73 x 55 boxes.
        let radius = 0.5 * (0.8_f64 / 73.0).min(0.6 / 55.0);
        let expected: Vec<u64> = mpm
            .points()
            .iter()
            .filter(|p| {
                envelopes.chunk_by(|a, b| a.body == b.body).any(|body| {
                    let outline: Vec<Vec2> = body.iter().map(|v| v.position.into()).collect();
                    nearest(&outline, p.position.into()).distance
                        <= body[0].reach + radius + config.skin
                })
            })
            .map(|p| p.id)
            .collect();
        assert_eq!(chosen, expected, "round {round}");
        found += chosen.len();
    }
    assert!(found > 1000);
    assert!(mpm.select_imps(&[]).is_empty());
    assert!(mpm.imp_states().is_empty());
}

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
