//! A grid layer for each group (Chen 2023): groups that lie on top of one another feel nothing.

use interface::config::{Fill, GridContact, MpmConfig, ShapeFunction, Transfer};
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
