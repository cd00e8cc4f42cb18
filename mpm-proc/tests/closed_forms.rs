//! Waves, vibration and rotation against closed forms, with the observed order of convergence.

use std::f64::consts::PI;

use interface::config::{ShapeFunction, StressUpdate, Transfer, Wall};
use interface::solver::MpmSolver;

use crate::blocks::{Stepper, block, configured, disc_fill, elastic_model, rectangle_fill};

/// Nothing strains a disc that all moves alike, whatever nodes its points pass. They start at binary fractions of the cell
/// and move by one in a step, so that rows of them come to lie on nodes, and next to nodes by rounding.
#[test]
fn a_disc_in_uniform_translation_stays_unstrained() {
    let dt = 2.0_f64.powi(-12);
    for shape in [
        ShapeFunction::Linear,
        ShapeFunction::Ugimp,
        ShapeFunction::QuadraticBspline,
    ] {
        for update in [StressUpdate::Usf, StressUpdate::Musl, StressUpdate::Usavg] {
            for velocity in [[4.0, 0.0], [1.0, 0.3], [8.0, -4.0]] {
                let mut config = block();
                config.domain = [[-2.0, -2.0], [6.0, 2.0]];
                config.cell = 2.0_f64.powi(-4);
                (config.shape, config.transfer) = (shape, Transfer::Flip);
                config.stress_update = update;
                config.groups[0].fill = disc_fill([0.0, 0.0], 0.25);
                config.groups[0].velocity = velocity;
                let mut mpm = configured(&config);
                let mut stepper = Stepper::new();
                let case = format!("{shape:?} {update:?} {velocity:?}");
                for n in 0..1500 {
                    let limits = stepper.step(&mut mpm, dt, n % 100 == 99, &[]);
                    let limits = limits.expect("a sound step");
                    assert!(limits.omega_sq * dt * dt < 4.0, "{case}, step {n}");
                }
                let ledger = mpm.measurement().ledger;
                assert!(
                    ledger.elastic <= 1e-12 * ledger.kinetic,
                    "{case}: {:e} of {:e} J/m",
                    ledger.elastic,
                    ledger.kinetic
                );
                let mass = 2.0 * ledger.kinetic / (velocity[0].powi(2) + velocity[1].powi(2));
                for a in 0..2 {
                    let off = ledger.momentum[a] - mass * velocity[a];
                    assert!(off.abs() <= 1e-12 * mass, "{case}: {off:e} N s/m");
                }
            }
        }
    }
}

/// First bending mode of a clamped beam, plane stress: `f = 1.8751^2/(2 pi) sqrt(E I/(rho A L^4))`, Timoshenko's
/// correction for a slenderness of 10 is minus 0.9 %.
#[test]
fn a_cantilever_vibrates_at_its_frequency() {
    let mut config = block();
    let (length, height) = (1.0, 0.1);
    config.domain = [[0.0, 0.0], [1.25, 0.5]];
    config.cell = 0.0125;
    (config.shape, config.transfer) = (ShapeFunction::Ugimp, Transfer::Flip);
    config.plane = interface::config::Plane::Stress;
    let (young, nu) = (1e6, 0.3);
    config.materials[0].model =
        elastic_model(young / (3.0 * (1.0 - 2.0 * nu)), young / (2.0 * (1.0 + nu)));
    config.walls.left = Wall::Fixed;
    config.groups[0].fill = rectangle_fill([0.0, 0.2], [length, 0.2 + height]);
    config.groups[0].fields.velocity = Some(["0".into(), "0.02 * x^2".into()]);
    let mut mpm = configured(&config);
    let tip = mpm.points().len() - 1;
    let rest = mpm.points()[tip].position[1];
    let mut stepper = Stepper::new();
    let dt = 1e-4;
    // The deflection returns to zero after half a period.
    let mut crossings = Vec::new();
    let mut before = 1.0;
    for _ in 0..30_000 {
        stepper.run(&mut mpm, dt, 1);
        let now = mpm.points()[tip].position[1] - rest;
        if before * now < 0.0 {
            crossings.push(stepper.time - dt * now / (now - before));
        }
        before = now;
        if crossings.len() == 3 {
            break;
        }
    }
    let period = crossings[2] - crossings[0];
    let inertia = height.powi(3) / 12.0;
    let frequency = 1.8751_f64.powi(2) / (2.0 * PI)
        * (young * inertia / (1000.0 * height * f64::powi(length, 4))).sqrt()
        * 0.991;
    println!("cantilever: {} of {frequency} Hz", 1.0 / period);
    assert!(
        (1.0 / period / frequency - 1.0).abs() < 0.03,
        "{} {frequency}",
        1.0 / period
    );
}
