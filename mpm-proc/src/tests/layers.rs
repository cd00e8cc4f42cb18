//! A grid layer for each group (Chen 2023): groups that lie on top of one another feel nothing.

use interface::config::{Fill, GridContact, MpmConfig, ShapeFunction, Transfer};
use interface::message::wire::{EnvelopeVertex, ImpForce};
use interface::solver::MpmSolver;

use super::{Stepper, bits, block, configured};

/// Two blocks that overlap, on layers, on their way through one another.
fn crossing() -> MpmConfig {
    let mut config = block();
    config.layers = true;
    let group = |name: &str, x: f64, v: f64| interface::config::GroupConfig {
        name: name.into(),
        fill: Fill::Rectangle {
            lower: [x, 0.3],
            upper: [x + 0.2, 0.5],
        },
        velocity: [v, 0.0],
        contact_radius: Some(0.0125),
        ..config.groups[0].clone()
    };
    config.groups = vec![group("left", 0.0, 3.0), group("right", 0.15, -2.0)];
    config
}

#[test]
fn one_group_on_a_layer_has_the_bits_of_the_continuum() {
    for (shape, transfer) in [
        (ShapeFunction::QuadraticBspline, Transfer::Apic),
        (ShapeFunction::Ugimp, Transfer::Flip),
        (ShapeFunction::Linear, Transfer::Pic),
    ] {
        let mut config = block();
        (config.shape, config.transfer) = (shape, transfer);
        config.groups[0].velocity = [1.0, -0.5];
        let mut plain = configured(&config);
        config.layers = true;
        let mut layered = configured(&config);
        for mpm in [&mut plain, &mut layered] {
            let mut stepper = Stepper::new();
            stepper.step(mpm, 0.0, true, &[]).unwrap();
            stepper.run(mpm, 2e-4, 100);
            stepper.step(mpm, 2e-4, true, &[]).unwrap();
        }
        assert_eq!(bits(&plain), bits(&layered));
        assert_eq!(plain.measurement(), layered.measurement());
        assert_eq!(plain.points(), layered.points());
    }
}

/// The IMPs of pairs are those of brute force, and those near bodies as well.
#[test]
fn points_near_another_group_are_imps() {
    let mut config = crossing();
    config.group_pairs = vec![[1, 0]];
    config.groups[0].velocity = [0.0; 2];
    config.groups[1].fill = Fill::Rectangle {
        lower: [0.23, 0.35],
        upper: [0.5, 0.7],
    };
    config.groups[1].contact_radius = Some(0.02);
    config.skin = 0.03;
    let mut mpm = configured(&config);
    let disc = [EnvelopeVertex {
        body: 0,
        position: [0.0, 0.3],
        reach: 0.04,
    }];
    let points = mpm.points();
    for envelopes in [&[][..], &disc] {
        let chosen: Vec<(u64, u32)> = mpm
            .select_imps(envelopes)
            .iter()
            .map(|i| (i.id, i.group))
            .collect();
        let radius = [0.0125, 0.02];
        let apart = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
        let expected: Vec<(u64, u32)> = points
            .iter()
            .filter(|p| {
                let near = |q: &&interface::message::wire::PointState| {
                    q.group != p.group && apart(p.position, q.position) <= 0.0125 + 0.02 + 0.03
                };
                let body = |e: &EnvelopeVertex| {
                    apart(p.position, e.position) <= e.reach + radius[p.group as usize] + 0.03
                };
                points.iter().any(|q| near(&q)) || envelopes.iter().any(body)
            })
            .map(|p| (p.id, p.group))
            .collect();
        assert!(expected.len() > 10);
        assert_eq!(chosen, expected);
    }
}

/// Forces reach the layer of their point, the limit is that of the worst layer, and a state goes on to the same bits.
#[test]
fn forces_are_of_the_layers_and_a_state_goes_on() {
    let mut config = crossing();
    config.group_pairs = vec![[0, 1]];
    config.skin = 0.03;
    config.groups[1].fill = Fill::Rectangle {
        lower: [0.22, 0.3],
        upper: [0.42, 0.5],
    };
    config.groups[0].velocity = [0.0; 2];
    config.groups[1].velocity = [0.0; 2];
    let mut mpm = configured(&config);
    let groups: Vec<u32> = mpm.select_imps(&[]).iter().map(|i| i.group).collect();
    assert!(groups.contains(&0) && groups.contains(&1));
    let forces: Vec<ImpForce> = groups
        .iter()
        .map(|&g| ImpForce {
            force: [if g == 0 { -1.0 } else { 2.0 }, 0.0],
            stiffness: 100.0,
        })
        .collect();
    let (dt, mut stepper) = (1e-4, Stepper::new());
    let limits = stepper.step(&mut mpm, dt, true, &forces).unwrap();
    assert!(limits.contact_omega_sq > 0.0);
    let told = mpm.measurement().clone();
    for (g, state) in told.groups.iter().enumerate() {
        let count = groups.iter().filter(|&&of| of == g as u32).count();
        let force = count as f64 * [-1.0, 2.0][g];
        assert!((state.contact_force[0] - force).abs() < 1e-12);
        assert_eq!(state.contacts as usize, count);
        // The first kick is half a step.
        let points = mpm.points();
        let own = points.iter().filter(|p| p.group == g as u32);
        let momentum: f64 = own.map(|p| p.mass * p.velocity[0]).sum();
        assert!((momentum - 0.5 * dt * force).abs() < 1e-12 * (0.5 * dt * force).abs());
    }
    assert_eq!(told.ledger.contacts as usize, groups.len());
    let saved = mpm.save().unwrap();
    let mut other = configured(&config);
    other.restore(&saved).unwrap();
    let mut ends = Vec::new();
    for mpm in [&mut mpm, &mut other] {
        let mut stepper = Stepper {
            index: stepper.index,
            time: stepper.time,
            before: stepper.before,
        };
        for _ in 0..50 {
            stepper.step(mpm, dt, false, &forces).unwrap();
        }
        ends.push((bits(mpm), mpm.imp_states().to_vec()));
    }
    assert_eq!(ends[0], ends[1]);
}

#[test]
fn what_does_not_go_with_layers_is_refused() {
    let refused = |change: &dyn Fn(&mut MpmConfig), key: &str| {
        let mut config = crossing();
        config.groups[1].fill = Fill::Rectangle {
            lower: [0.3, 0.3],
            upper: [0.5, 0.5],
        };
        change(&mut config);
        let refusal = crate::Mpm::new().configure(&config).unwrap_err();
        assert!(refusal.key.starts_with(key), "{refusal:?}");
    };
    refused(&|c| c.group_pairs = vec![[0, 2]], "group_pair.0");
    refused(&|c| c.group_pairs = vec![[1, 1]], "group_pair.0");
    refused(&|c| c.group_pairs = vec![[0, 1], [1, 0]], "group_pair.1");
    refused(
        &|c| {
            c.group_pairs = vec![[0, 1]];
            c.layers = false;
        },
        "mpm.layers",
    );
    refused(
        &|c| {
            c.grid_contact = Some(GridContact { friction: 0.0 });
            c.drift = interface::config::Drift::Nodal;
        },
        "mpm.layers",
    );
    // Groups that touch do not begin on top of one another.
    refused(
        &|c| {
            c.group_pairs = vec![[0, 1]];
            c.groups[1].fill = c.groups[0].fill.clone();
        },
        "mpm.points.1.fill",
    );
}
