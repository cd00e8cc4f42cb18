//! Points that leave the domain and are removed.

use interface::config::{Leaving, MpmConfig, Spacing};
use interface::solver::MpmSolver;

use crate::blocks::{Stepper, block, configured, everywhere};

/// The block flies through the open left wall, spinning, under gravity.
fn flying() -> MpmConfig {
    let mut config = block();
    config.leaving = Leaving::Remove;
    config.gravity = [0.0, -9.81];
    config.cell = 0.025;
    config.groups[0].spacing = Spacing::PerCell(4);
    config.groups[0].velocity = [-3.0, 1.0];
    config.groups[0].fields.velocity = Some(["-(y-0.4)".into(), "x-0.25".into()]);
    config
}

#[test]
fn points_outside_are_removed_with_their_momentum_and_energy() {
    let mut mpm = configured(&flying());
    let all = mpm.points().len();
    let mut stepper = Stepper::new();
    let (mut start, mut seen) = (None, Vec::new());
    let mut scale: f64 = 0.0;
    for _ in 0..140 {
        stepper.run(&mut mpm, 2e-4, 9);
        stepper
            .step(&mut mpm, 2e-4, true, &[])
            .expect("a sound step");
        let l = mpm.measurement().ledger;
        let p = [0, 1].map(|a| l.momentum[a] - l.applied_impulse[a]);
        let e = l.kinetic + l.elastic + l.gravity - l.driven_work;
        let (p0, e0) = *start.get_or_insert((p, e));
        scale = scale.max(l.kinetic);
        assert!((e - e0).abs() < 1e-6 * scale, "{e} {e0}");
        for a in 0..2 {
            assert!((p[a] - p0[a]).abs() < 1e-10, "{:e}", p[a] - p0[a]);
        }
        let group = mpm.measurement().groups[0];
        let left = mpm.points();
        assert!(left.windows(2).all(|w| w[0].id < w[1].id));
        assert!(left.iter().all(|p| p.position[0] >= -0.2));
        seen.push(left.len());
        assert!(group.mass <= 60.0 + 1e-9 && group.position.iter().all(|x| x.is_finite()));
    }
    assert!(seen.windows(2).all(|w| w[0] >= w[1]));
    assert_eq!((seen[0], seen[seen.len() - 1]), (all, 0));
    assert!(seen.iter().any(|n| *n > 0 && *n < all));
    // Nothing is left, and nothing is reported.
    let measurement = mpm.measurement();
    assert_eq!(measurement.groups[0].mass, 0.0);
    assert_eq!(measurement.ledger.momentum, [0.0; 2]);
}

#[test]
fn a_removed_imp_asks_for_a_new_set() {
    let mut mpm = configured(&flying());
    let before = mpm.select_imps(&everywhere()).len();
    let mut stepper = Stepper::new();
    while mpm.points().len() == before {
        assert!(mpm.travel().is_finite());
        stepper.run(&mut mpm, 2e-4, 1);
    }
    assert_eq!(mpm.travel(), f64::INFINITY);
    let ids: Vec<u64> = mpm.points().iter().map(|p| p.id).collect();
    let set: Vec<u64> = mpm
        .select_imps(&everywhere())
        .iter()
        .map(|i| i.id)
        .collect();
    assert_eq!(set, ids);
    assert_eq!(mpm.imp_states().len(), ids.len());
    assert_eq!(mpm.travel(), 0.0);
}
