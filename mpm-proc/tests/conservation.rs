//! Momentum and angular momentum.

use interface::config::{ShapeFunction, Spacing, StressUpdate, Transfer};
use interface::message::wire::ImpForce;
use interface::solver::MpmSolver;

use crate::blocks::{Random, Stepper, block, configured, everywhere, points_fill};

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
