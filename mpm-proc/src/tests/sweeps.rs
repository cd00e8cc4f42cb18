//! What a sweep sums for the next step is what a sweep of its own would sum there.

use interface::config::{
    Drift, Fill, GridContact, MpmConfig, ShapeFunction, StressUpdate, Transfer, Wall,
};
use interface::message::wire::{EnvelopeVertex, ImpForce};
use interface::solver::MpmSolver;

use super::{Stepper, bits, block, configured};

/// A block that falls on a floor, bounces and is pressed at one corner: where bits depend on every sum. Returns its points after
/// 80 steps, which sum over the points in sweeps of their own if `apart`.
fn after(config: &MpmConfig, apart: bool) -> Vec<u64> {
    let mut mpm = configured(config);
    let corner = [[0.35, 0.25], [0.9, 0.25], [0.9, 0.4], [0.35, 0.4]];
    let envelope = corner.map(|position| EnvelopeVertex {
        body: 0,
        position,
        reach: 0.0,
    });
    // Contact on the grid does without bodies.
    let pressed = if config.grid_contact.is_none() {
        mpm.select_imps(&envelope).len()
    } else {
        0
    };
    let press = ImpForce {
        force: [-2.0, 1.0],
        stiffness: 1e3,
    };
    let forces = vec![press; pressed];
    let mut stepper = Stepper::new();
    stepper.step(&mut mpm, 0.0, true, &forces).expect("opened");
    let mut all = Vec::new();
    for step in 0..80 {
        if apart {
            mpm.scheme().forget_sums();
        }
        mpm.imp_states();
        let given = if step < 40 { &forces[..] } else { &[] };
        let limits = stepper.step(&mut mpm, 1e-4, step % 7 == 0, given);
        let limits = limits.expect("a sound step");
        all.extend([limits.omega_sq, limits.speed].map(f64::to_bits));
    }
    all.extend(bits(&mpm));
    all
}

#[test]
fn a_step_does_not_depend_on_who_has_summed() {
    let mut falling = block();
    falling.walls.bottom = Wall::Slip;
    falling.domain = [[0.0, 0.2], [0.9, 0.8]];
    falling.groups[0].fill = Fill::Rectangle {
        lower: [0.1, 0.23],
        upper: [0.4, 0.43],
    };
    falling.groups[0].velocity = [9.0, -3.0];
    falling.gravity = [0.0, -9.81];
    let check = |what: &str, change: &dyn Fn(&mut MpmConfig)| {
        for update in [
            StressUpdate::Usf,
            StressUpdate::Usl,
            StressUpdate::Musl,
            StressUpdate::Usavg,
        ] {
            let mut config = falling.clone();
            config.stress_update = update;
            config.drift = Drift::of(update, None);
            change(&mut config);
            let [fused, apart] = [false, true].map(|apart| after(&config, apart));
            assert!(fused == apart, "{what}, {update:?}");
        }
    };
    check("APIC", &|_| ());
    check("FLIP", &|c| c.transfer = Transfer::Flip);
    check("XPIC", &|c| c.transfer = Transfer::Xpic { order: 2 });
    check("spin", &|c| {
        (c.transfer, c.groups[0].keeps_spin) = (Transfer::Flip, true);
    });
    check("hats", &|c| {
        (c.shape, c.transfer) = (ShapeFunction::Linear, Transfer::Flip);
        if c.stress_update == StressUpdate::Usl {
            c.shape = ShapeFunction::Ugimp; // hats are unstable with it
        }
    });
    check("a body force", &|c| {
        c.forcing.body_force = Some(["3*sin(9*t)".into(), "x".into()]);
    });
    check("periodic walls", &|c| {
        (c.walls.left, c.walls.right) = (Wall::Periodic, Wall::Periodic);
    });
    check("a rigid grain", &|c| {
        let mut floor = c.groups[0].clone();
        (floor.name, floor.rigid) = ("floor".into(), true);
        floor.velocity = [0.5, 0.0];
        floor.fill = Fill::Rectangle {
            lower: [0.1, 0.2],
            upper: [0.6, 0.23],
        };
        c.groups.push(floor);
        (c.grid_contact, c.drift) = (Some(GridContact { friction: 0.3 }), Drift::Nodal);
    });
}
