//! What the solver promises without a session: an evaluation that commits nothing, and capabilities that are true.

use interface::config::capability::SAVE;
use interface::config::{BodyConfig, BodyInertia, BodyShape, ContactLaw, DemConfig, Motion};
use interface::forces::{Forces, Load, Points};
use interface::message::wire::{ImpInfo, ImpState, Ledger};
use interface::solver::{Answer, DemSolver};
use interface::step::Step;
use rapier_dem::Rapier;

/// A block that falls on a floor.
fn scene() -> DemConfig {
    let law = ContactLaw::Linear {
        normal_stiffness: 1e4,
        tangential_stiffness: 5e3,
        friction: 0.3,
        damping_ratio: 0.0,
        damped_mass: 0.0,
    };
    let block = |name: &str, height: f64, y: f64, motion: Motion| BodyConfig {
        name: name.into(),
        shape: BodyShape::Rectangle { width: 0.8, height },
        sphero_radius: 0.01,
        inertia: BodyInertia::Mass(2.0),
        position: [0.0, y],
        motion,
        ..BodyConfig::default()
    };
    DemConfig {
        gravity: [0.0, -9.81],
        bodies: vec![
            block("floor", 0.1, -0.06, Motion::Fixed),
            block("block", 0.2, 0.12, Motion::Free),
        ],
        point_contact: law,
        body_contact: Some(law),
        skin: 0.01,
        threads: 1,
        ..DemConfig::default()
    }
}

fn step(i: u32, dt: f64, measure: bool) -> Step {
    Step {
        index: i.into(),
        time: 1e-3 * f64::from(i),
        dt_before: if i < 2 { 0.0 } else { 1e-3 },
        dt,
        measure,
    }
}

fn points(places: [[f64; 2]; 3]) -> [ImpState; 3] {
    places.map(|position| ImpState {
        position,
        velocity: [1.0, 0.0],
        ..ImpState::default()
    })
}

/// An evaluation of three points.
fn contact(dem: &mut Rapier, step: &Step, states: &[ImpState; 3]) -> (Forces, Answer) {
    let set = [0, 1, 2].map(|id| ImpInfo {
        id,
        radius: 0.02,
        mass: 0.5,
        ..ImpInfo::default()
    });
    let mut forces = Forces::default();
    let config = scene();
    let bodies = dem.bodies().into_iter().zip(&config.bodies);
    let loads = bodies.map(|(state, body)| Load::none(&state, body.motion.yielding()));
    forces.clear(states, loads);
    let points = Points { set: &set, states };
    let answer = dem.contact(step, &points, &mut forces).unwrap();
    (forces, answer)
}

/// Answers of a run in which points rub over the block, with or without a trial before each step.
fn run(trials: bool) -> (Vec<String>, Ledger) {
    let mut dem = Rapier::default();
    dem.configure(&scene()).unwrap();
    dem.envelopes();
    let mut trace = Vec::new();
    for i in 0..200 {
        let dt = if i == 0 { 0.0 } else { 1e-3 };
        let x = 1e-3 * f64::from(i);
        if trials {
            let elsewhere = points([[0.1, 0.24], [-x, 0.245], [0.3, 0.25]]);
            let step = step(i, 2.0 * dt, i % 2 == 0);
            contact(&mut dem, &step, &elsewhere);
        }
        let states = points([[x - 0.1, 0.245], [0.02, 0.25 - 0.02 * x], [0.4 - x, 0.24]]);
        let (forces, answer) = contact(&mut dem, &step(i, dt, true), &states);
        dem.advance(&step(i, dt, true)).unwrap();
        trace.push(format!("{forces:?} {answer:?} {:?}", dem.measurement()));
    }
    (trace, dem.measurement().unwrap().ledger)
}

#[test]
fn an_evaluation_leaves_no_trace() {
    let (once, ledger) = run(false);
    let (often, _) = run(true);
    assert!(
        ledger.friction_work > 0.0 && ledger.viscous_work != 0.0,
        "{ledger:?}"
    );
    for (i, (once, often)) in once.iter().zip(&often).enumerate() {
        assert_eq!(once, often, "step {i}");
    }
}

#[test]
fn what_is_listed_is_taken_and_the_rest_refused() {
    crate::capability_samples::check::<Rapier>();
    assert!(!Rapier::default().capabilities().has(SAVE));
}
