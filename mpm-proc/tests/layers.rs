//! A grid layer for each group (Chen 2023): groups that lie on top of one another feel nothing.

use interface::config::{ShapeFunction, Transfer};
use interface::solver::MpmSolver;

use crate::blocks::{Stepper, bits, block, configured};

#[test]
fn one_group_on_a_layer_has_the_bits_of_the_continuum() {
    for (shape, transfer) in [
        (ShapeFunction::QuadraticBspline, Transfer::Apic),
        (ShapeFunction::Ugimp, Transfer::Flip),
        (ShapeFunction::Linear, Transfer::Pic),
    ] {
        let mut config = block();
        (config.shape, config.transfer) = (shape, transfer);
        config.groups[0].velocity = [1.0, -0.5];
        let mut plain = configured(&config);
        config.layers = true;
        let mut layered = configured(&config);
        for mpm in [&mut plain, &mut layered] {
            let mut stepper = Stepper::new();
            stepper.step(mpm, 0.0, true, &[]).unwrap();
            stepper.run(mpm, 2e-4, 100);
            stepper.step(mpm, 2e-4, true, &[]).unwrap();
        }
        assert_eq!(bits(&plain), bits(&layered));
        assert_eq!(plain.measurement(), layered.measurement());
        assert_eq!(plain.points(), layered.points());
    }
}
