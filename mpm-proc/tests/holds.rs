//! Held points and probes.

use core::f64::consts::PI;

use interface::config::{Hold, ShapeFunction, Spacing, StressUpdate, Transfer, Wall};
use interface::solver::MpmSolver;

use crate::blocks::{Stepper, block, configured, elastic_model, rectangle_fill, walls};

fn hold(within: [[f64; 2]; 2], [hold_x, hold_y]: [bool; 2]) -> Hold {
    Hold {
        name: "support".into(),
        points: "block".into(),
        within,
        hold_x,
        hold_y,
    }
}

/// A bar between slip walls, of `E = 1e5`, `nu = 0` and `c = 10 m/s`, held in the middle. Either half swings in its first mode,
/// `u = a/(2 pi c) |sin(2 pi x)| sin(2 pi c t)`, so that the support takes the jump of the stress, `2 E a/c sin(2 pi c t)` per
/// height. Returns the relative rms error of the displacement, and the largest error of the support's force over its
/// amplitude.
fn held_bar(shape: ShapeFunction, cells: u32) -> [f64; 2] {
    let (speed, amplitude, stiffness) = (10.0, 1e-6, 1e5);
    let cell = 1.0 / f64::from(cells);
    let mut config = block();
    (config.shape, config.transfer) = (shape, Transfer::Flip);
    config.stress_update = StressUpdate::Usavg;
    config.cell = cell;
    config.domain = [[0.0, 0.0], [1.0, 2.0 * cell]];
    config.walls = walls(Wall::Slip, Wall::Slip, Wall::Slip, Wall::Slip);
    config.materials[0].model = elastic_model(stiffness / 3.0, stiffness / 2.0);
    let [lower, upper] = config.domain;
    config.groups[0].fill = rectangle_fill(lower, upper);
    // An odd number of columns: one stands in the middle.
    config.groups[0].spacing = Spacing::Counts([3 * cells + 1, 6]);
    config.groups[0].fields.velocity = Some([format!("{amplitude}*abs(sin(2*pi*x))"), "0".into()]);
    let middle = [[0.5 - 1e-6, 0.0], [0.5 + 1e-6, 1.0]];
    config.forcing.holds = vec![hold(middle, [true, false])];
    let mut mpm = configured(&config);
    let start = mpm.points();
    let omega = 2.0 * PI * speed;
    let end = 0.7 * PI / omega;
    let steps = (end * speed * 10.0 / cell).ceil();
    let dt = end / steps;
    let mut stepper = Stepper::new();
    let (mut sum, mut worst): (f64, f64) = (0.0, 0.0);
    let force = 2.0 * stiffness * amplitude / speed * 2.0 * cell;
    for n in 0..steps as usize {
        let time = stepper.time;
        stepper.step(&mut mpm, dt, true, &[]).expect("a sound step");
        let held = mpm.measurement().groups[1];
        assert_eq!(held.contact_force[1], 0.0);
        sum += held.contact_force[0];
        // The mean over a tenth of the time: single steps have the noise of the points that cross cells.
        if (n + 1) % (steps as usize / 10) == 0 {
            let k = steps as usize / 10;
            let mean = sum / k as f64 / force;
            let [t1, t0] = [time + 0.5 * dt, time + 0.5 * dt - k as f64 * dt];
            let exact = ((omega * t0).cos() - (omega * t1).cos()) / (omega * (t1 - t0));
            worst = worst.max((mean.abs() - exact).abs());
            sum = 0.0;
        }
    }
    let (mut error, mut scale) = (0.0, 0.0);
    for (a, b) in start.iter().zip(mpm.points()) {
        let exact =
            amplitude / omega * (2.0 * PI * a.position[0]).sin().abs() * (omega * end).sin();
        error += (b.position[0] - a.position[0] - exact).powi(2);
        scale += exact.powi(2);
    }
    [f64::sqrt(error / scale), worst]
}

#[test]
fn a_bar_that_is_held_in_the_middle_swings_as_two() {
    for shape in [ShapeFunction::Linear, ShapeFunction::QuadraticBspline] {
        let errors = [16, 32, 64].map(|n| held_bar(shape, n));
        println!("{shape:?}: {errors:?}");
        // The displacement bends at the support, within reach of one shape function: first order.
        let order = 0.5 * (errors[0][0] / errors[2][0]).log2();
        assert!((0.7..1.5).contains(&order), "{shape:?}: {order} {errors:?}");
        assert!(errors[2][0] < 0.02, "{shape:?}: {errors:?}");
        assert!(errors[2][1] < 0.04, "{shape:?}: {errors:?}");
    }
}
