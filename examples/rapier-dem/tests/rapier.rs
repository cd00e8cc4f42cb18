//! Scenes of the catalogue with rapier as the bodies' side, all parties in one thread.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use coupler::record::rundir::RunDir;
use coupler::record::summary::{Status, Summary};
use coupler::run::{RunOptions, Solvers, run};
use coupler::scene::Scene;
use interface::config::DemConfig;
use interface::solver::{DemSolver, MpmSolver};
use rapier_dem::Rapier;
use tempfile::TempDir;

fn continuum() -> Box<dyn MpmSolver> {
    Box::new(mpm_proc::Mpm::default())
}

fn rapier() -> Box<dyn DemSolver> {
    Box::new(Rapier::default())
}

fn built_in() -> Box<dyn DemSolver> {
    Box::new(dem_proc::Sdem::default())
}

fn catalogue(name: &str) -> PathBuf {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    scenes.join(name).with_extension("toml")
}

/// What a run shows: its summary, and the columns of its history.
struct Shown {
    summary: Summary,
    header: Vec<String>,
    rows: Vec<Vec<f64>>,
}

fn show(name: &str, variant: &str, set: &[&str], dem: fn() -> Box<dyn DemSolver>) -> Shown {
    let set: Vec<String> = set.iter().map(ToString::to_string).collect();
    let scene = Scene::load(&catalogue(name), Some(variant), &set).unwrap();
    let place = TempDir::new().unwrap();
    let dir = RunDir::create(&place.path().join("out"), &scene.resolved_toml).unwrap();
    let options = RunOptions {
        patience: std::time::Duration::from_mins(1),
        stepping: None,
        solvers: Solvers::InProcess {
            mpm: continuum,
            dem,
        },
        threads: 1,
        window: None,
        record: false,
        trace: None,
        progress: false,
        screen: None,
        interrupt: Arc::default(),
        at_once: Arc::default(),
        save: Arc::default(),
    };
    let summary = run(&scene, &options, &dir, None).summary;
    let text = std::fs::read_to_string(place.path().join("out/history.csv")).unwrap();
    let mut lines = text.lines().map(|line| line.split(','));
    let header = lines.next().unwrap().map(String::from).collect();
    let numbers = lines.map(|line| line.map(|n| n.parse().unwrap()).collect());
    Shown {
        summary,
        header,
        rows: numbers.collect(),
    }
}

#[test]
fn a_collision_passes_every_check_of_its_scene() {
    let shown = show("jiang2020/collision_hard", "quick", &[], rapier);
    assert_eq!(shown.summary.status, Status::Done, "{:#?}", shown.summary);
}

/// Without contact between bodies rapier has nothing to add, and the springs are the built-in ones, so that only rounding
/// is left: sums in another order over some hundred steps.
#[test]
fn a_block_flies_and_tumbles_as_with_the_built_in_solver() {
    for variant in ["quick", "rough"] {
        let [a, b] = [built_in, rapier].map(|dem| show("verification/tumble", variant, &[], dem));
        assert_eq!(b.summary.status, Status::Done, "{:#?}", b.summary);
        assert_eq!(a.rows.len(), b.rows.len());
        for (k, name) in a
            .header
            .iter()
            .enumerate()
            .filter(|(_, name)| !name.starts_with("residual"))
        {
            let largest = a
                .rows
                .iter()
                .fold(0.0, |most: f64, row| most.max(row[k].abs()));
            let apart = a.rows.iter().zip(&b.rows).map(|(x, y)| (x[k] - y[k]).abs());
            let apart = apart.fold(0.0, f64::max);
            assert!(
                apart <= 1e-9 * largest,
                "{variant}: `{name}` differs by {apart:e} of {largest:e}"
            );
        }
    }
}

/// The blocks as one law has them, without the gate that is driven (docs/solver-authors.md).
const WITHOUT_GATE: [&str; 4] = [
    "time.end=0.3",
    "contact_pair=[]",
    "body_contact={linear={normal_stiffness=6e4,tangential_stiffness=3e3,friction=0.6}}",
    "dem.body.4={name=\"gate\",shape=\"disc\",sphero_radius=0.01,position=[2.0,2.0],motion=\"fixed\"}",
];

/// The sand pushes the two upper blocks off the glued one, which rests on nothing but its being fixed.
#[test]
fn blocks_rest_on_one_another_by_impulses_until_the_sand_comes() {
    let shown = show("jiang2020/blocks", "quick", &WITHOUT_GATE, rapier);
    let reached = [Status::Done, Status::CheckFailed];
    assert!(
        reached.contains(&shown.summary.status),
        "{:#?}",
        shown.summary
    );
    assert!(shown.summary.momentum_error < 1e-12);
    let column = |name: &str| shown.header.iter().position(|h| h == name).unwrap();
    let (turned, y) = (column("turned_2 [degree]"), column("y_2 [m]"));
    let before = shown.rows.iter().take_while(|row| row[0] < 0.2);
    for row in before {
        assert!(
            row[turned].abs() < 0.1 && (row[y] - 0.027).abs() < 1e-4,
            "it does not rest: {row:?}"
        );
    }
    let last = shown.rows.last().unwrap();
    // Less than with springs (docs/solver-authors.md), so that the scene's own check of it does not hold.
    assert!(last[turned] > 1.0, "it has not been pushed: {last:?}");
}

#[test]
fn what_rapier_cannot_do_is_refused_by_its_key() {
    let scene = Scene::load(&catalogue("verification/tumble"), None, &[]).unwrap();
    let config = scene.dem.unwrap();
    let refusal = |change: &dyn Fn(&mut serde_json::Value)| {
        let mut changed = serde_json::to_value(&config).unwrap();
        change(&mut changed);
        let changed: DemConfig = serde_json::from_value(changed).unwrap();
        Rapier::default()
            .configure(&changed)
            .unwrap_err()
            .to_string()
    };
    let damped = refusal(&|c| c["contact"]["linear"]["damping_ratio"] = 0.1.into());
    assert!(
        damped.contains("contact.linear.damping_ratio: there are no dashpots"),
        "{damped}"
    );
    let driven = refusal(&|c| c["body"][0]["motion"] = "driven".into());
    assert!(driven.contains("dem.body.0.motion"), "{driven}");
    let notch = refusal(&|c| {
        let vertices = [[0.0, 0.0], [0.02, 0.0], [0.004, 0.004], [0.0, 0.02]];
        c["body"][0]["shape"] = serde_json::json!({"polygon": {"vertices": vertices}});
    });
    assert!(
        notch.contains("dem.body.0.shape: only discs, segments and convex polygons"),
        "{notch}"
    );
}
