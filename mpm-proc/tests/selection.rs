//! How far a block that flies has travelled.

use interface::message::wire::ImpForce;
use interface::solver::MpmSolver;

use crate::blocks::{Stepper, block, configured, everywhere};

/// Points that a body presses on move by a pass of their own; the travel is still that of the flight.
#[test]
fn a_block_that_flies_travels_at_its_speed_while_a_body_presses() {
    let mut config = block();
    config.groups[0].velocity = [0.3, -0.2];
    let mut mpm = configured(&config);
    let count = mpm.select_imps(&everywhere()).len();
    let mut forces = vec![ImpForce::default(); count];
    forces[count / 2].force = [1e-9, 0.0]; // of 60 kg/m
    let mut stepper = Stepper::new();
    for n in 1..4 {
        stepper.step(&mut mpm, 2e-4, false, &forces).unwrap();
        let way = 0.3_f64.hypot(0.2) * 2e-4 * f64::from(n);
        assert!((mpm.travel() / way - 1.0).abs() < 1e-9, "{}", mpm.travel());
    }
}
