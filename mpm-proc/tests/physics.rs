//! Motion against closed forms.

use interface::config::{MaterialModel, ShapeFunction, Spacing, StressUpdate, Transfer, Wall};
use interface::solver::MpmSolver;

use crate::blocks::{
    BULK, SHEAR, Stepper, block, configured, disc_fill, elastic_model, rectangle_fill, stand,
};

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

/// A tower of one column of points under its own weight: `sigma_yy = -rho g (H - y)`, top sinks by `rho g H^2 / 2M`.
#[test]
fn a_column_settles_under_gravity() {
    for (shape, transfer) in [
        (ShapeFunction::Ugimp, Transfer::Pic),
        (ShapeFunction::QuadraticBspline, Transfer::Pic),
    ] {
        let mut config = block();
        (config.shape, config.transfer) = (shape, transfer);
        config.gravity = [0.0, -10.0];
        stand(&mut config, 1.0, 1.2);
        let mut mpm = configured(&config);
        let start = mpm.points();
        let mut stepper = Stepper::new();
        stepper.run(&mut mpm, 4e-4, 12_000);
        stepper
            .step(&mut mpm, 4e-4, true, &[])
            .expect("a sound step");
        let ledger = mpm.measurement().ledger;
        let modulus = BULK + 4.0 / 3.0 * SHEAR;
        let top = mpm.points().last().expect("points").position[1]
            - start.last().expect("points").position[1];
        let expected = -0.5 * 1000.0 * 10.0 / modulus;
        // Half a cell of 1.2 m is not loaded as the continuum is: a few per cent at 20 cells.
        assert!(
            (top / expected - 1.0).abs() < 0.05,
            "{shape:?}: {top} {expected}"
        );
        // Elastic energy per area: integral of sigma^2 / 2M = (rho g)^2 H^3 / 6M. The wall carries the weight.
        let energy = 0.2 * 1e8 / (6.0 * modulus);
        assert!(
            (ledger.elastic / energy - 1.0).abs() < 0.08,
            "{shape:?}: {} {energy}",
            ledger.elastic
        );
        assert!(ledger.kinetic < 1e-4 * energy, "{}", ledger.kinetic);
        assert!((ledger.momentum[1] - ledger.applied_impulse[1]).abs() < 1e-9 * 200.0 * 10.0 * 4.8);
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

/// A disc that swings and flies over the grid, without contact: updating stress first or (with velocities mapped again) last
/// is off by the same in first order, with opposite signs; half of each is of second order.
#[test]
fn half_of_each_stress_update_balances_to_second_order() {
    let residual = |update, dt: f64| {
        let mut config = block();
        (config.shape, config.transfer) = (ShapeFunction::Ugimp, Transfer::Flip);
        (config.cell, config.stress_update) = (0.01, update);
        config.groups[0].fill = disc_fill([0.1, 0.3], 0.03);
        config.groups[0].spacing = Spacing::Distance(0.005);
        config.groups[0].fields.velocity =
            Some(["2 + 30*(x - 0.1)".into(), "1 - 30*(y - 0.3)".into()]);
        let mut mpm = configured(&config);
        let mut stepper = Stepper::new();
        let (mut start, mut off) = (None, 0.0_f64);
        while stepper.time < 0.1 {
            stepper.step(&mut mpm, dt, true, &[]).expect("a sound step");
            let ledger = mpm.measurement().ledger;
            let total = ledger.kinetic + ledger.elastic;
            let change = total / *start.get_or_insert(total) - 1.0;
            off = if change.abs() > off.abs() {
                change
            } else {
                off
            };
        }
        off
    };
    let [first, last] = [StressUpdate::Usf, StressUpdate::Musl].map(|u| residual(u, 4e-5));
    assert!(first < 0.0 && last > 0.0, "{first:e} {last:e}");
    assert!((first + last).abs() < 0.5 * last, "{first:e} {last:e}");
    let [coarse, fine] = [4e-5, 2e-5].map(|dt| residual(StressUpdate::Usavg, dt).abs());
    assert!(coarse < 0.5 * last, "{coarse:e} {last:e}");
    assert!(coarse > 3.5 * fine, "{coarse:e} {fine:e}");
}

/// A free block whose halves run into each other: the energy of FLIP stays.
#[test]
fn a_ringing_block_keeps_its_energy() {
    let mut config = block();
    (config.shape, config.transfer) = (ShapeFunction::Ugimp, Transfer::Flip);
    config.cell = 0.02;
    config.groups[0].spacing = Spacing::PerCell(4);
    // Two halves that meet at 0.2 m/s each, joined by the grid.
    config.groups[0].fill = rectangle_fill([0.1, 0.3], [0.24, 0.5]);
    config.groups[0].velocity = [0.2, 0.0];
    let mut other = config.groups[0].clone();
    other.name = "right".into();
    other.fill = rectangle_fill([0.24, 0.3], [0.38, 0.5]);
    other.velocity = [-0.2, 0.0];
    config.groups.push(other);
    let mut mpm = configured(&config);
    let mut stepper = Stepper::new();
    let total = |mpm: &mpm_proc::Mpm| {
        let l = mpm.measurement().ledger;
        l.kinetic + l.elastic
    };
    // After a first crossing of the shock: FLIP dissipates what the grid does not resolve.
    stepper.run(&mut mpm, 1e-4, 300);
    stepper
        .step(&mut mpm, 1e-4, true, &[])
        .expect("a sound step");
    let early = total(&mpm);
    let mut largest: f64 = 0.0;
    for _ in 0..100 {
        stepper.run(&mut mpm, 1e-4, 99);
        stepper
            .step(&mut mpm, 1e-4, true, &[])
            .expect("a sound step");
        largest = largest.max(total(&mpm));
    }
    let late = total(&mpm);
    assert!(largest < 1.01 * early, "grew from {early} to {largest}");
    assert!(late > 0.7 * early, "fell from {early} to {late}");
    let ledger = mpm.measurement().ledger;
    assert!(
        ledger.elastic > 0.0
            && ledger.momentum[0].abs() < 1e-12
            && ledger.momentum[1].abs() < 1e-12
    );
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
