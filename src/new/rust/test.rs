//! Tests of NAME. The second one starts `tandem`, or what `$TANDEM` names.

use std::process::Command;

use interface::config::{BodyConfig, BodyInertia, BodyShape, ContactLaw, DemConfig};
use interface::forces::{Forces, Load, Points};
use interface::message::wire::{ImpInfo, ImpState};
use interface::solver::DemSolver;
use interface::step::Step;
use solver::Solver;

#[test]
fn a_point_is_pushed_away_and_the_disc_the_other_way() {
    let disc = BodyConfig {
        name: "disc".into(),
        shape: BodyShape::Disc,
        sphero_radius: 0.1,
        inertia: BodyInertia::Mass(2.0),
        ..BodyConfig::default()
    };
    let mut solver = Solver::default();
    let config = DemConfig {
        bodies: vec![disc],
        point_contact: ContactLaw::linear(1e4, 5e3, 0.1, 0.0),
        threads: 1,
        ..DemConfig::default()
    };
    solver.configure(&config).expect("it is taken");
    let step = Step {
        index: 1,
        time: 0.0,
        dt_before: 1e-3,
        dt: 1e-3,
        measure: false,
    };
    // 0.01 m deep: 100 N.
    let set = [ImpInfo { radius: 0.01, mass: 1.0, ..ImpInfo::default() }];
    let states = [ImpState { position: [0.1, 0.0], ..ImpState::default() }];
    let mut forces = Forces::default();
    forces.clear(&states, solver.bodies().iter().map(|body| Load::none(body, [1.0; 3])));
    let points = Points { set: &set, states: &states };
    solver.contact(&step, &points, &mut forces).expect("no fault");
    solver.advance(&step).expect("no fault");
    assert!((forces.on_points()[0].force[0] - 100.0).abs() < 1e-9);
    assert!((solver.bodies()[0].velocity[0] + 100.0 / 2.0 * 1e-3).abs() < 1e-12);
}

#[test]
fn the_kit_passes_it() {
    let tandem = std::env::var("TANDEM").unwrap_or_else(|_| "tandem".into());
    let mut kit = Command::new(tandem);
    kit.args(["conformance", "--require", "held", "--cases", "100", "--dem"]);
    kit.arg(format!("'{}'", env!("CARGO_BIN_EXE_NAME")));
    let judged = kit.output().expect("tandem starts: name it in $TANDEM");
    let verdict = String::from_utf8_lossy(&judged.stdout);
    assert!(judged.status.success(), "{verdict}");
}
