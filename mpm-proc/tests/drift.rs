//! The energy balance of contact, and of large strains: what the drift and the strain of a step are there for.

use interface::config::{MaterialModel, ShapeFunction, StressUpdate, Transfer};
use interface::message::wire::ImpForce;
use interface::solver::MpmSolver;

use crate::blocks::{BULK, SHEAR, Stepper, block, configured, elastic_model, everywhere};

/// Where the wall is, on the left of the block, in m.
const WALL: f64 = 0.1;

/// A block at `speed` (m/s) bounces off a wall of springs of `stiffness` (N/m) on each point. The largest change of the
/// total energy from the start to any step, over that at the start.
fn imbalance(
    update: StressUpdate,
    model: MaterialModel,
    speed: f64,
    stiffness: f64,
    dt: f64,
) -> f64 {
    let mut config = block();
    config.shape = ShapeFunction::Ugimp;
    (config.transfer, config.stress_update) = (Transfer::Flip, update);
    config.materials[0].model = model;
    config.groups[0].velocity = [-speed, 0.0];
    let mut mpm = configured(&config);
    mpm.select_imps(&everywhere());
    let mut stepper = Stepper::new();
    let (mut start, mut largest, mut pressed) = (None, 0.0_f64, 0.0_f64);
    while stepper.time < 0.012 {
        let overlap = |x: f64| (WALL + 0.0125 - x).max(0.0);
        let overlaps: Vec<f64> = mpm
            .points()
            .iter()
            .map(|p| overlap(p.position[0]))
            .collect();
        let forces = overlaps.iter().map(|o| ImpForce {
            force: [stiffness * o, 0.0],
            stiffness: if *o > 0.0 { stiffness } else { 0.0 },
            ..ImpForce::default()
        });
        stepper
            .step(&mut mpm, dt, true, &forces.collect::<Vec<_>>())
            .expect("a sound step");
        let ledger = mpm.measurement().ledger;
        let contact: f64 = overlaps.iter().map(|o| 0.5 * stiffness * o * o).sum();
        let total = ledger.kinetic + ledger.elastic + contact;
        let start = *start.get_or_insert(total);
        pressed = pressed.max(contact / start);
        largest = largest.max((total / start - 1.0).abs());
    }
    assert!(
        pressed > 0.01,
        "the block has hardly met the wall: {pressed}"
    );
    largest
}

const ELASTIC: MaterialModel = elastic_model(BULK, SHEAR);

/// Small strains, contact as stiff as the material: second order in the step. Where points moved with the velocities of the
/// nodes after the kick it was of first order.
#[test]
fn contact_balances_to_second_order() {
    for update in [StressUpdate::Usf, StressUpdate::Musl, StressUpdate::Usavg] {
        let [coarse, fine] = [4e-4, 2e-4].map(|dt| imbalance(update, ELASTIC, 0.03, 1e5, dt));
        assert!(fine < 1e-3, "{update:?}: {coarse:e} {fine:e}");
        assert!(coarse / fine > 3.0, "{update:?}: {coarse:e} {fine:e}");
    }
}
