//! The couples of friction on the surfaces of points: a single point in closed form.

use interface::config::{ShapeFunction, Spacing, Transfer};
use interface::message::wire::ImpForce;
use interface::solver::MpmSolver;

use crate::blocks::{Stepper, block, configured, everywhere, points_fill};

/// Let a point of APIC be alone on its nodes, `m_I = m S_I`. A couple `c` over a kick `k` gives them `c k g_I / (m S_I)`, so the
/// point gets no velocity and `B = c k / (2 m) [[0, -1], [1, 0]]`: the angular momentum `m (B_yx - B_xy) = c k`, with
/// `D = h^2/4` the spin `2 c k / (m h^2)` and the energy `(c k)^2 / (m h^2)`, wherever it lies between the nodes. A second equal
/// couple adds to them.
#[test]
fn a_couple_turns_a_single_point_and_does_not_move_it() {
    let (side, couple, dt) = (0.02, 0.3, 1e-4);
    for at in [[0.3, 0.3], [0.31, 0.293], [0.3249, 0.3251]] {
        let mut config = block();
        (config.shape, config.transfer) = (ShapeFunction::QuadraticBspline, Transfer::Apic);
        config.gravity = [0.0; 2];
        config.groups[0].fill = points_fill(vec![at]);
        config.groups[0].spacing = Spacing::Distance(side);
        config.groups[0].velocity = [0.0; 2];
        let mut mpm = configured(&config);
        mpm.select_imps(&everywhere());
        let press = ImpForce {
            couple,
            stiffness: 1.0,
            tangential: 1.0,
            ..ImpForce::default()
        };
        let (mass, h) = (1000.0 * side * side, config.cell);
        let mut stepper = Stepper::new();
        let mut given = 0.0;
        for n in 0..2 {
            let kick = 0.5 * (stepper.before + dt);
            stepper.step(&mut mpm, dt, true, &[press]).unwrap();
            given += couple * kick;
            let state = mpm.imp_states()[0];
            let spin = 2.0 * given / (mass * h * h);
            assert!(
                (state.spin / spin - 1.0).abs() < 1e-4,
                "{at:?} {n}: {} {spin}",
                state.spin
            );
            assert!(
                state.velocity.iter().all(|v| v.abs() < 1e-9 * spin * h),
                "{state:?}"
            );
        }
        // Without forces: the same before and after the kick. The stress of so small a turn takes less than the tolerance.
        stepper
            .step(&mut mpm, dt, true, &[ImpForce::default()])
            .unwrap();
        let kinetic = mpm.measurement().ledger.kinetic;
        let expected = given * given / (mass * h * h);
        assert!(
            (kinetic / expected - 1.0).abs() < 1e-4,
            "{at:?}: {kinetic} {expected}"
        );
        assert_eq!(mpm.imp_states()[0].spin, 0.0, "nothing rubs any more");
    }
}
