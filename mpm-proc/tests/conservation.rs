//! Momentum and angular momentum, and motion without strain.

use interface::config::{ShapeFunction, Spacing, StressUpdate, Transfer};
use interface::message::wire::ImpForce;
use interface::solver::MpmSolver;

use crate::blocks::{Random, Stepper, block, configured, disc_fill, everywhere, points_fill};

/// A cloud that is pushed and turned has what it was given, with its affine parts, to rounding.
#[test]
fn affine_transfers_conserve_momentum_and_angular_momentum() {
    for shape in [ShapeFunction::QuadraticBspline, ShapeFunction::CubicBspline] {
        let mut random = Random::new(7);
        let mut config = block();
        (config.shape, config.transfer) = (shape, Transfer::Apic);
        // With it points move with the velocity that they take.
        config.stress_update = StressUpdate::Usl;
        let places = (0..700).map(|_| [random.between(0.0, 0.6), random.between(0.2, 0.8)]);
        config.groups[0].fill = points_fill(places.collect());
        config.groups[0].spacing = Spacing::Distance(0.02);
        let mut mpm = configured(&config);
        let count = mpm.select_imps(&everywhere()).len();
        let mut any = || random.between(-900.0, 900.0);
        let forces = (0..count).map(|_| ImpForce {
            force: [any(), any()],
            couple: 1e-2 * any(),
            ..ImpForce::default()
        });
        let forces: Vec<ImpForce> = forces.collect();
        let mut stepper = Stepper::new();
        for n in 0..20 {
            let pushed = if n < 5 {
                forces.clone()
            } else {
                vec![ImpForce::default(); count]
            };
            stepper
                .step(&mut mpm, 2e-4, true, &pushed)
                .expect("a sound step");
        }
        let ledger = mpm.measurement().ledger;
        let scale = (2.0 * ledger.kinetic * mpm.measurement().groups[0].mass).sqrt();
        assert!(scale > 1.0, "{scale}");
        for a in 0..2 {
            let off = ledger.momentum[a] - ledger.contact_impulse[a];
            assert!(off.abs() < 1e-12 * scale, "{shape:?}: {off:e}");
        }
        let off = ledger.angular_momentum - ledger.contact_moment;
        assert!(off.abs() < 1e-12 * scale, "{shape:?}: {off:e}");
    }
}

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
