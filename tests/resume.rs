//! A run that is cut short at any moment goes on from its newest checkpoint to the same bits.

mod harness;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use harness::{Place, RunFiles, dice, scene, signal, until};

/// A coupled run with frames that takes some tenths of a second, and how it keeps checkpoints.
const LONG: &[&str] = &[
    "--variant",
    "quick",
    "--set",
    "time.end=0.3",
    "--set",
    "output.every=1e-3",
    "--set",
    "output.frames=0.02",
    "--set",
    "check=[]",
    "--set",
    "output.checkpoint.time=0.004",
];

fn scene_of_the_test() -> String {
    scene("jiang2020/normal_force")
}

/// What must be the same byte for byte: the history, the course, the frames and their list, the bodies.
fn outputs(dir: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut all = BTreeMap::new();
    let frames = fs::read_dir(dir.join("frames")).unwrap();
    let paths = frames.map(|entry| entry.unwrap().path());
    let tables = ["history.csv", "course.csv", "bodies.csv"];
    for path in paths.chain(tables.map(|name| dir.join(name))) {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        all.insert(name, fs::read(&path).unwrap());
    }
    all
}

#[track_caller]
fn assert_same(dir: &Path, undisturbed: &Path) {
    let (ours, theirs) = (RunFiles::read(dir), RunFiles::read(undisturbed));
    assert_eq!(ours.text("state_hash"), theirs.text("state_hash"));
    assert_eq!(ours.number("steps"), theirs.number("steps"));
    let (ours, theirs) = (outputs(dir), outputs(undisturbed));
    let names = |all: &BTreeMap<String, Vec<u8>>| all.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(&ours), names(&theirs));
    for (name, bytes) in &theirs {
        assert!(ours[name] == *bytes, "{name} differs");
    }
}

fn checkpoints(dir: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(dir.join("checkpoints")).into_iter().flatten();
    let mut paths: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    paths.retain(|path| path.extension().is_some_and(|e| e == "tandem"));
    paths.sort();
    paths
}

#[test]
fn a_signal_saves_and_the_run_goes_on() {
    let place = Place::new();
    let mut run = place.start_run("saved", &scene_of_the_test(), &LONG[..LONG.len() - 2]);
    run.stepping("saved");
    signal(run.pid(), "USR1");
    run.end().expect(0);
    assert_eq!(checkpoints(&place.path("saved")).len(), 1);
}

/// Waits until a run has a checkpoint, and a random while longer.
#[track_caller]
fn a_while_after_a_checkpoint(dir: &Path) {
    let there = until(Duration::from_secs(30), || {
        (!checkpoints(dir).is_empty()).then_some(())
    });
    assert!(there.is_some(), "no checkpoint is written");
    std::thread::sleep(Duration::from_millis(dice(150)));
}

fn resume(place: &Place, out: &str, more: &[&str]) -> harness::Ended {
    let dir = place.path(out);
    let arguments = [&["resume", dir.to_str().unwrap(), "--log", "json"], more].concat();
    place.start(&arguments).end()
}

/// Whoever is killed, at whatever moment, twice; and the parts are run in different ways.
#[test]
fn a_run_that_is_killed_goes_on_to_the_same_bits() {
    let place = Place::new();
    let scene = scene_of_the_test();
    place.run("whole", &scene, LONG).expect(0);
    let ways: [&[&str]; 3] = [&["--threads", "2"], &["--window", "7"], &["--in-process"]];
    for (n, way) in ways.into_iter().enumerate() {
        let out = format!("killed_{n}");
        let dir = place.path(&out);
        let mut run = place.start_run(&out, &scene, LONG);
        a_while_after_a_checkpoint(&dir);
        let victim = match n {
            0 => run.pid(),
            1 => run.solver(&out, "mpm"),
            _ => run.solver(&out, "dem"),
        };
        signal(victim, "KILL");
        run.end();
        // Once more, unless it is through already.
        let path = dir.to_str().unwrap().to_owned();
        let second = place.start(&[&["resume", &path, "--log", "json"], way].concat());
        std::thread::sleep(Duration::from_millis(dice(100)));
        signal(second.pid(), "KILL");
        second.end();
        resume(&place, &out, &[]).expect(0);
        assert_same(&dir, &place.path("whole"));
    }
}

#[test]
fn an_interrupted_run_keeps_a_last_checkpoint() {
    let place = Place::new();
    let scene = scene_of_the_test();
    // The scene itself has no checkpoints.
    let seldom = &LONG[..LONG.len() - 2];
    place.run("whole", &scene, seldom).expect(0);
    let mut run = place.start_run("stopped", &scene, seldom);
    run.stepping("stopped");
    std::thread::sleep(Duration::from_millis(20 + dice(80)));
    signal(run.pid(), "TERM");
    let ended = run.end();
    let dir = place.path("stopped");
    if RunFiles::read(&dir).text("status") == "interrupted" {
        assert_eq!(checkpoints(&dir).len(), 1);
        resume(&place, "stopped", &[]).expect(0);
    } else {
        ended.expect(0);
    }
    assert_same(&dir, &place.path("whole"));
}

#[test]
fn a_torn_checkpoint_is_passed_over() {
    let place = Place::new();
    let scene = scene_of_the_test();
    place.run("whole", &scene, LONG).expect(0);
    let dir = place.path("torn");
    place.run("torn", &scene, LONG).expect(0);
    let all = checkpoints(&dir);
    assert_eq!(all.len(), 2, "the newest and the one before are kept");
    let bytes = fs::read(&all[1]).unwrap();
    fs::write(&all[1], &bytes[..bytes.len() / 2]).unwrap();
    let ended = resume(&place, "torn", &[]);
    ended.expect(0).says(&["is damaged", "passed over"]);
    assert_same(&dir, &place.path("whole"));
}

#[test]
fn what_cannot_be_resumed_is_refused_with_the_reason() {
    let place = Place::new();
    let scene = scene_of_the_test();
    let none = &LONG[..LONG.len() - 2];
    place.run("none", &scene, none).expect(0);
    resume(&place, "none", &[])
        .expect(2)
        .says(&["has no checkpoint"]);
    resume(&place, "nowhere", &[])
        .expect(2)
        .says(&["scene.toml"]);
    place.run("other", &scene, LONG).expect(0);
    // Another scene in the place of the one that was run.
    let file = place.path("other").join("scene.toml");
    let text = fs::read_to_string(&file).unwrap();
    fs::write(&file, text.replace("end = 0.3", "end = 0.31")).unwrap();
    let ended = resume(&place, "other", &[]);
    ended.expect(2).says(&["is not of this run", "scene hash"]);
}
