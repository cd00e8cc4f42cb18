//! Motion against closed forms.

use interface::config::{MaterialModel, ShapeFunction, Transfer, Wall};
use interface::solver::MpmSolver;

use crate::blocks::{BULK, SHEAR, Stepper, block, configured, elastic_model, rectangle_fill};

const SCHEMES: [(ShapeFunction, Transfer); 5] = [
    (ShapeFunction::Ugimp, Transfer::Flip),
    (ShapeFunction::Ugimp, Transfer::Pic),
    (ShapeFunction::QuadraticBspline, Transfer::Apic),
    (ShapeFunction::QuadraticBspline, Transfer::Flip),
    (
        ShapeFunction::CubicBspline,
        Transfer::Blend { pic_fraction: 0.01 },
    ),
];

#[test]
fn free_flight_is_a_parabola() {
    for (shape, transfer) in SCHEMES {
        let mut config = block();
        (config.shape, config.transfer) = (shape, transfer);
        config.groups[0].velocity = [1.0, 2.0];
        config.gravity = [0.0, -10.0];
        let mut mpm = configured(&config);
        let start = mpm.points();
        let mut stepper = Stepper::new();
        // Leapfrog is exact for constant acceleration; a step that varies must not matter.
        for n in 0..200 {
            let dt = if n % 3 == 0 { 4e-4 } else { 9e-4 };
            stepper
                .step(&mut mpm, dt, false, &[])
                .expect("a sound step");
        }
        stepper
            .step(&mut mpm, 0.0, true, &[])
            .expect("a sound step");
        let t = stepper.time;
        for (a, b) in start.iter().zip(mpm.points()) {
            assert!((b.position[0] - a.position[0] - t).abs() < 1e-12);
            assert!((b.position[1] - a.position[1] - 2.0 * t + 5.0 * t * t).abs() < 1e-12);
            assert!((b.velocity[1] - 2.0 + 10.0 * t).abs() < 1e-11);
        }
        let ledger = mpm.measurement().ledger;
        assert!((ledger.applied_impulse[1] + 10.0 * t * 60.0).abs() < 1e-9);
        assert!(ledger.elastic < 1e-15 * ledger.kinetic);
    }
}

/// Two halves that run into each other: what the stress does is stored, to second order of the step; the rate form keeps a
/// part of it for itself, however short the step.
#[test]
fn the_work_of_the_stress_is_stored_where_the_law_has_an_energy() {
    let (bulk_modulus, shear_modulus) = (BULK, SHEAR);
    let gap = |model, dt: f64| {
        let mut config = block();
        (config.shape, config.transfer) = (ShapeFunction::Ugimp, Transfer::Flip);
        config.materials[0].model = model;
        let mut other = config.groups[0].clone();
        other.name = "other".into();
        other.fill = rectangle_fill([0.4, 0.35], [0.7, 0.55]);
        (config.groups[0].velocity, other.velocity) = ([4.0, 0.0], [-4.0, 0.0]);
        config.groups.push(other);
        let mut mpm = configured(&config);
        let mut stepper = Stepper::new();
        let (mut most, mut off) = (0.0_f64, 0.0_f64);
        while stepper.time < 0.02 {
            stepper.step(&mut mpm, dt, true, &[]).expect("a sound step");
            let ledger = mpm.measurement().ledger;
            most = most.max(ledger.elastic);
            off = off.max((ledger.stress_work - ledger.elastic).abs());
        }
        off / most
    };
    let hencky = elastic_model(bulk_modulus, shear_modulus);
    let [coarse, fine] = [2e-4, 1e-4].map(|dt| gap(hencky, dt));
    assert!(fine < 1e-3 && coarse > 3.0 * fine, "{coarse:e} {fine:e}");
    let rate = MaterialModel::Hypoelastic {
        bulk_modulus,
        shear_modulus,
    };
    let [coarse, fine] = [2e-4, 1e-4].map(|dt| gap(rate, dt));
    assert!(fine > 1e-2 && coarse < 1.2 * fine, "{coarse:e} {fine:e}");
}

/// A wall with friction begins to act when the surface is at it, not where the mass at its nodes begins.
#[test]
fn a_block_flies_freely_until_it_is_at_a_wall_with_friction() {
    for (shape, transfer) in SCHEMES {
        let mut config = block();
        (config.shape, config.transfer) = (shape, transfer);
        let bottom = config.domain[0][1];
        config.walls.bottom = Wall::Friction { coefficient: 0.5 };
        config.groups[0].velocity = [0.5, -1.0];
        // Half a cell above, so it is there after 0.025 s.
        config.groups[0].fill = rectangle_fill([0.1, bottom + 0.025], [0.4, bottom + 0.225]);
        let mut mpm = configured(&config);
        let mut stepper = Stepper::new();
        let mut impulse = |steps| {
            stepper.run(&mut mpm, 1e-4, steps);
            stepper
                .step(&mut mpm, 0.0, true, &[])
                .expect("a sound step");
            mpm.measurement().ledger.applied_impulse
        };
        assert_eq!(impulse(245), [0.0; 2], "{shape:?} {transfer:?}");
        let [along, up] = impulse(20);
        assert!(up > 0.0, "{shape:?} {transfer:?}: {up} N s/m");
        assert!(
            along < 0.0 && along >= -0.5 * up * (1.0 + 1e-12),
            "{along} {up}"
        );
    }
}
