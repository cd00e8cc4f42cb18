//! Every scene of the catalogue runs and shows what it must; what it leaves is complete and reads back.

use crate::harness::{Place, RunFiles, at_once, catalogue, has, root, scene};
use crate::hashes::{Outcome, QUICK_VARIANT, Row, WAYS, WORKERS, baseline};
use coupler::record::Summary;
use coupler::record::summary::EnergyLedger;
use coupler::scene::Scene;
use serde_json::Value;

/// `summary.json` reads back, in finite numbers, and says what holds of every run.
#[track_caller]
fn assert_complete(files: &RunFiles) {
    let summary = Summary::read(&files.dir).expect("a summary");
    let spent = &summary.spent;
    // A process that a scene does not need does not run.
    let parties = [
        ("mpm", summary.points > 0),
        ("dem", summary.bodies > 0),
        ("coupler", true),
    ];
    for (party, _) in parties.into_iter().filter(|(_, takes_part)| *takes_part) {
        let (all, stepping) = (spent.cpu_s[party], spent.stepping_cpu_s[party]);
        assert!(
            0.0 <= stepping && stepping <= all,
            "{party}: {stepping} of {all} s"
        );
        let parts = spent.wall_by_part[party];
        let times = [parts.compute, parts.exchange, parts.wait];
        assert!(times.iter().all(|time| *time >= 0.0), "{party}: {parts:?}");
    }
    assert!(spent.stepping_wall_s < spent.wall_s);
    let EnergyLedger {
        start,
        end,
        residual_max,
        ..
    } = summary.energy;
    let energies = [start, end]
        .into_iter()
        .flat_map(|energies| energies.parts());
    let mut numbers = energies
        .map(|(_, energy)| energy)
        .chain([residual_max, summary.momentum_error]);
    assert!(numbers.all(f64::is_finite), "{summary:?}");
    let booked: u64 = summary.dt_bound_by.values().sum();
    assert_eq!(summary.steps, booked, "every step is bound by something");
    let (shortest, longest) = (summary.dt_min.unwrap(), summary.dt_max.unwrap());
    assert!(0.0 < shortest && shortest <= longest);
}

/// A scene's quick variant passes with the bits of its row, in whatever way it is run; what it leaves is whole, and the
/// scene file among it the same scene.
fn runs_and_reads_back(row: &Row, way: &str) {
    let place = Place::new();
    let options = format!("--variant {QUICK_VARIANT} {way}");
    let ended = place.run("out", &scene(&row.case.scene), &options);
    let ended = ended.expect(0);
    place.assert_clean(&ended.runs);
    let files = RunFiles::read(&place.path("out"));
    // The names of the columns are among them.
    assert_eq!(Outcome::of(&files, 0, None), row.outcome, "{way:?}");
    assert_complete(&files);
    assert_eq!(files.text("status"), "done");
    assert_eq!(files.summary["reason"], Value::Null);
    let checks = files.summary["checks"].as_array().unwrap();
    assert!(!checks.is_empty(), "a scene checks something");
    for check in checks {
        assert_eq!(check["pass"], true, "{check}");
    }
    let history = files.history();
    history.assert_sound();
    assert_eq!(
        history.column("time [s]").last(),
        Some(&files.number("time"))
    );
    let left = Scene::load(&place.path("out/scene.toml"), None, &[]).expect("a scene");
    assert_eq!(left.hash, files.text("scene_hash"));
}

/// But for those at the edge, not all of which are to reach their end.
#[test]
fn every_scene_passes_and_reads_back() {
    let rows = baseline()
        .into_iter()
        .filter(|row| row.case.variant == QUICK_VARIANT && !row.case.is_at_the_edge());
    let rows: Vec<_> = rows.zip(WAYS.into_iter().cycle()).collect();
    let mut scenes = catalogue();
    scenes.retain(|path| !path.starts_with(root().join("scenes/extreme")));
    assert_eq!(rows.len(), scenes.len(), "each has a variant `quick`");
    let failed = at_once(WORKERS, &rows, |(row, way)| {
        let passes = std::panic::catch_unwind(|| runs_and_reads_back(row, way));
        passes.err().map(|_| row.case.scene.clone())
    });
    let failed: Vec<_> = failed.into_iter().flatten().collect();
    assert!(
        failed.is_empty(),
        "these fail, with the reasons above: {failed:?}"
    );
}

/// The constant of the rod's closed form: the end of an elastic rod presses a rigid one through a spring, its own wave and
/// the echo of it relieve it (the scene says how).
#[test]
fn the_rod_is_measured_by_its_closed_form() {
    let text = std::fs::read_to_string(scene("jiang2020/rod")).unwrap();
    let table: toml::Table = text.parse().unwrap();
    let written = table["constants"]["v_spring"].as_float().unwrap();
    let (length, density, modulus, v0) = (0.01, 2000.0, 5e5 + 4.0 / 3.0 * 3.7e5, 2.0);
    let stiffness = table["contact"]["linear"]["normal_stiffness"]
        .as_float()
        .unwrap()
        / 5e-4;
    let impedance = f64::sqrt(density * modulus);
    let steps_per_echo = 20_000;
    let dt = 2.0 * length * f64::sqrt(density / modulus) / f64::from(steps_per_echo);
    // Heun's rule; the echo is known from before.
    let mut forces = vec![0.0];
    let (mut overlap, mut v) = (0.0, 0.0);
    let echo = |forces: &[f64], k: usize| {
        let before = k.checked_sub(steps_per_echo as usize);
        before.map_or(0.0, |k| 2.0 / impedance * forces[k])
    };
    let rates = |overlap: f64, v: f64, echo: f64| {
        let force = f64::max(0.0, stiffness * overlap);
        let inertia = density * length;
        [v0 - force / impedance - echo - v, force / inertia]
    };
    for k in 0..2 * steps_per_echo as usize {
        let a = rates(overlap, v, echo(&forces, k));
        let b = rates(overlap + dt * a[0], v + dt * a[1], echo(&forces, k + 1));
        overlap += 0.5 * dt * (a[0] + b[0]);
        v += 0.5 * dt * (a[1] + b[1]);
        forces.push(f64::max(0.0, stiffness * overlap));
    }
    assert!(overlap < 0.0, "contact is over before the second echo");
    assert!((v / written - 1.0).abs() < 1e-7, "{v} {written}");
}

/// The default run directory, the streams, and the text that people see.
#[test]
fn without_options_results_go_to_runs_and_checks_to_standard_output() {
    let place = Place::new();
    let bounce = scene("verification/point_bounce");
    let ended = place.tandem(&format!("run '{bounce}' --variant quick"));
    let ended = ended.expect(0);
    let files = RunFiles::read(&place.path("runs/point_bounce-quick"));
    for check in files.summary["checks"].as_array().unwrap() {
        has(&ended.stdout, check["name"].as_str().unwrap());
    }
    has(&ended.stdout, "results in runs/point_bounce-quick");
    // No bar where standard error is not a terminal.
    assert!(
        !ended.stderr.contains('\u{1b}') && !ended.stderr.contains('\r'),
        "{}",
        ended.stderr
    );
}

/// Below tan 33 = 0.649 nothing holds the block of `sudden_load`, and its check of standing says so.
#[test]
fn a_block_that_slides_does_not_pass_for_one_that_stands() {
    let place = Place::new();
    let set = "--variant quick --set contact.linear.friction=0.64";
    let scene = scene("verification/sudden_load");
    place.run("out", &scene, set).expect(1);
    let files = RunFiles::read(&place.path("out"));
    assert_eq!(files.text("status"), "check_failed");
    let stands = "it stands: how far friction under its weight would still slide for its work, over how far it has gone";
    assert_eq!(files.check(stands)["pass"], false);
    assert_eq!(files.check("no energy is lost")["pass"], true);
}
