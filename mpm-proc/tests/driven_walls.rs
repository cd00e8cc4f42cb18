//! Walls that move along themselves.

use interface::config::{InitialFields, MpmConfig, ShapeFunction, Transfer, Wall};
use interface::message::wire::Ledger;
use interface::solver::MpmSolver;

use crate::blocks::{
    BULK, SHEAR, Stepper, block, configured, neo_hookean_model, rectangle_fill, walls,
};
use mpm_proc::Mpm;

const HEIGHT: f64 = 0.8;
const LENGTH: f64 = 1.0;
const SPEED: f64 = 2.0;

/// A slab that fills the domain, without an end along x, between a wall at rest below and one that moves above.
fn slab(shape: ShapeFunction, transfer: Transfer) -> MpmConfig {
    let mut config = block();
    (config.shape, config.transfer) = (shape, transfer);
    config.materials[0].model = neo_hookean_model(BULK, SHEAR);
    config.walls = walls(
        Wall::Periodic,
        Wall::Periodic,
        Wall::Fixed,
        Wall::Driven { speed: SPEED },
    );
    config.groups[0].fill = rectangle_fill([-0.2, 0.1], [0.8, 0.9]);
    config
}

/// The slab after `steps` of 1e-4 s, the last of them measured.
fn run(config: &MpmConfig, steps: usize) -> (Mpm, Ledger) {
    let mut mpm = configured(config);
    let mut stepper = Stepper::new();
    stepper.run(&mut mpm, 1e-4, steps);
    stepper
        .step(&mut mpm, 1e-4, true, &[])
        .expect("a sound step");
    let ledger = mpm.measurement().ledger;
    (mpm, ledger)
}

const KINDS: [(ShapeFunction, Transfer); 5] = [
    (ShapeFunction::Linear, Transfer::Flip),
    (ShapeFunction::Ugimp, Transfer::Flip),
    (ShapeFunction::QuadraticBspline, Transfer::Apic),
    (ShapeFunction::QuadraticBspline, Transfer::Flip),
    (ShapeFunction::CubicBspline, Transfer::Apic),
];

/// Couette's shear: the velocity stays linear, the stress is `G gamma` in a Neo-Hookean solid at any shear, and the wall's
/// work is what the slab holds.
#[test]
fn a_slab_shears_in_closed_form() {
    for (shape, transfer) in KINDS {
        if shape == ShapeFunction::Linear {
            continue; // a point that comes upon a node counts for one of the cells beside it only
        }
        let mut config = slab(shape, transfer);
        config.groups[0].fields = InitialFields {
            velocity: Some([format!("{SPEED}*(y-0.1)/{HEIGHT}"), "0".into()]),
            stress: None,
        };
        let start = configured(&config).points();
        let (mpm, ledger) = run(&config, 1000);
        let time = 1000.0 * 1e-4;
        let gamma = SPEED * time / HEIGHT; // 0.25
        for (a, b) in start.iter().zip(mpm.points()) {
            let share = (a.position[1] - 0.1) / HEIGHT;
            // Positions are of the end of the step that was measured at its start.
            let way = b.position[0] - a.position[0] - SPEED * (time + 1e-4) * share;
            let dx = way - LENGTH * (way / LENGTH).round();
            assert!(dx.abs() < 1e-11, "{shape:?} {transfer:?}: {dx:e} m");
            let dy = b.position[1] - a.position[1];
            assert!(dy.abs() < 1e-11, "{shape:?} {transfer:?}: {dy:e} m");
        }
        let held = 0.5 * SHEAR * gamma * gamma * HEIGHT * LENGTH;
        for (what, value) in [("elastic", ledger.elastic), ("driven", ledger.driven_work)] {
            let error = value / held - 1.0;
            assert!(
                error.abs() < 1e-9,
                "{shape:?} {transfer:?}: {what} {error:e}"
            );
        }
        // Top and bottom hold each other.
        assert!(ledger.applied_impulse[0].abs() < 1e-9 * SHEAR * gamma * LENGTH * time);
    }
}
