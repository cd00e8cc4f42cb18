//! Scenarios with the built-in solvers: an elastic block that falls on a disc, which stands on a wall and is free.
//!
//! More of them: `cargo test --release -p simulation -- --ignored`.

use crate::scenario::{Outcome, Scenario};
use crate::session::SolverPair;
use dem_proc::Sdem;
use mpm_proc::Mpm;

/// Soft enough that the plan's step of 1 ms is a twentieth of the stable one, fast enough that it meets the disc.
const BUILT_IN: SolverPair = SolverPair {
    name: "built-in solvers",
    configs: || {
        let material = r#"{"name": "jelly", "density": 1000, "model": {"linear_elastic": {"bulk_modulus": 2000, "shear_modulus": 1000}}}"#;
        let block = r#"{"name": "block", "material": 0, "fill": {"rectangle": {"lower": [0.4, 0.42], "upper": [0.6, 0.52]}},
            "spacing": {"distance": 0.05}, "velocity": [0, -3], "contact_radius": 0.01,
            "lattice": "grid", "fields": {"velocity": null, "stress": null}, "keeps_spin": false}"#;
        let mpm = format!(
            r#"{{"domain": [[0, 0], [1, 1]], "cell": 0.1, "gravity": [0, -9.81], "shape": "linear", "transfer": "flip",
            "stress_update": "usf", "contact_force": "point",
            "forcing": {{"body_force": null, "traction": [], "hold": [], "stage": []}}, "constants": {{}}, "leaving": "stop", "grid_contact": null, "layers": false,
            "group_pair": [], "interface": "points", "chain": [], "probe": [], "plane": "strain",
            "walls": {{"left": "open", "right": "open", "bottom": "open", "top": "open"}}, "material": [{material}], "points": [{block}],
            "skin": 0.02, "threads": 1}}"#
        );
        let law = r#"{"linear": {"normal_stiffness": 10000, "tangential_stiffness": 5000, "friction": 0.4,
            "damping_ratio": 0, "damped_mass": 0}}"#;
        let disc = r#"{"name": "disc", "shape": "disc", "sphero_radius": 0.1, "inertia": {"mass": 20}, "position": [0.48, 0.3],
            "motion": "free", "angle": 0, "velocity": [0, 0], "spin": 0, "surface": ""}"#;
        let wall = r#"{"name": "wall", "shape": {"segment": {"ends": [[0, 0.1], [1, 0.1]]}}, "sphero_radius": 0.1,
            "inertia": {"mass": 1}, "position": [0, 0], "motion": "fixed", "angle": 0, "velocity": [0, 0], "spin": 0, "surface": ""}"#;
        let dem = format!(
            r#"{{"gravity": [0, -9.81], "body": [{disc}, {wall}], "contact": {law}, "body_contact": {law}, "overlap": "each_edge", "contact_pair": [], "point_surfaces": [], "group_pair": [],
            "contact_resolution": null, "interface": "points",
            "skin": 0.02, "threads": 1}}"#
        );
        [mpm, dem]
    },
    measured: [1, 2],
    build: |_| (Box::new(Mpm::new()), Box::new(Sdem::default())),
};

#[track_caller]
fn hold(seeds: std::ops::Range<u64>) -> [u64; 3] {
    let mut outcomes = [0; 3];
    for seed in seeds {
        let scenario = Scenario::with(BUILT_IN, seed);
        match scenario.judge() {
            Ok((outcome, _)) => outcomes[outcome as usize] += 1,
            Err(what) => panic!("seed {seed}: {what}\n{scenario:#?}"),
        }
    }
    outcomes
}

#[test]
fn three_hundred_scenarios_hold_and_meet_every_outcome() {
    let outcomes = hold(0..300);
    assert!(outcomes.iter().all(|&count| count > 10), "{outcomes:?}");
    assert_eq!(outcomes.iter().sum::<u64>(), 300);
    let [whole, ..] = [Outcome::Whole as usize];
    assert!(outcomes[whole] > 50, "{outcomes:?}");
}

#[test]
#[ignore = "takes minutes"]
fn fifty_thousand_scenarios_hold() {
    println!("{:?}", hold(300..50_300));
}
