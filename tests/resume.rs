//! A run that is cut short at any moment goes on from its newest checkpoint to the same bits.
//!
//! The normal command does this with one scene. All scenes and variants that take less than two minutes:
//!
//!     TANDEM_TABLE=docs/results/resume.md cargo test --release --workspace --test tandem-tests -- --ignored --nocapture every_scene_that_is_killed
//!
//! `TANDEM_SCENES=silo` leaves out scenes without `silo` in their name, `TANDEM_LONGEST=20` those that take more than 20 s,
//! `TANDEM_SHORTEST=3` those that take less than 3 s, `TANDEM_NIGHT` all but a quarter, as in [`hashes`].

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::harness::bits::bits;
use crate::harness::{
    Ended, PATIENCE, Place, RunFiles, at_once, dice, python_can_join, root, scene, signal, until,
};
use crate::hashes;
use interface::recording::{End, Playback};

/// A coupled run with frames that takes a second or two, and how it keeps checkpoints.
const LONG: &str = "--variant quick --set time.end=0.1 --set output.every=1e-3 \
    --set output.frames=0.02 --set check=[] --set output.checkpoint.time=0.004";

fn scene_of_the_test() -> String {
    scene("jiang2020/normal_force")
}

/// Changed rows before the checkpoint were kept without a word.
#[test]
fn a_table_that_was_changed_before_the_checkpoint_is_named_and_not_continued() {
    let place = Place::new();
    let mut run = place.start_run("run", &scene_of_the_test(), LONG);
    run.stepping("run");
    run.has_rows("run");
    signal(run.pid(), "INT");
    run.end().expect(130);
    let dir = place.path("run");
    for name in ["history.csv", "course.csv"] {
        let before = fs::read(dir.join(name)).unwrap();
        let mut changed = before.clone();
        // A digit of the first row.
        let at = before.iter().position(|&b| b == b'\n').unwrap() + 1;
        changed[at] = b'7';
        fs::write(dir.join(name), &changed).unwrap();
        let ended = place.tandem("resume run").expect(2);
        ended.says(&[
            name,
            "bytes, which it had at the checkpoint, were changed",
            "starts the run again",
        ]);
        assert!(
            fs::read(dir.join(name)).unwrap() == changed,
            "it was touched"
        );
        fs::write(dir.join(name), &before).unwrap();
    }
    // The history begins anew behind the checkpoint, as asked; the other table goes on.
    let course = fs::read_to_string(dir.join("course.csv")).unwrap();
    let history = fs::read_to_string(dir.join("history.csv")).unwrap();
    let changed = history.replacen('\n', "\n7", 1);
    fs::write(dir.join("history.csv"), &changed).unwrap();
    let ended = place.tandem("resume run --new-tables").expect(0);
    ended.says(&["history.csv.changed"]);
    let read = |name: &str| fs::read_to_string(dir.join(name)).unwrap();
    assert_eq!(read("history.csv.changed"), changed);
    let header = |table: &str| table.lines().next().unwrap().to_owned();
    let new = read("history.csv");
    assert_eq!(header(&new), header(&history));
    let time = |line: Option<&str>| {
        line.unwrap()
            .split(',')
            .next()
            .unwrap()
            .parse::<f64>()
            .unwrap()
    };
    assert!(time(new.lines().nth(1)) > time(history.lines().nth(1)));
    assert!(read("course.csv").starts_with(&course[..course.len() / 2]));
}

/// What must be the same byte for byte: the history, the course, the frames and their list, the bodies, the state.
#[track_caller]
pub fn assert_same(dir: &Path, undisturbed: &Path) {
    let [ours, theirs] = [dir, undisturbed].map(|dir| bits(dir).expect("a summary"));
    assert!(ours.keys().eq(theirs.keys()), "other files");
    for (name, bytes) in &theirs {
        assert!(ours[name] == *bytes, "{name} differs");
    }
}

fn checkpoints(dir: &Path) -> Vec<PathBuf> {
    let mut paths = names_of_checkpoints(dir);
    paths.retain(|path| path.extension().is_some_and(|e| e == "tandem"));
    paths
}

/// Waits until a run has a checkpoint, and a random while longer.
#[track_caller]
fn a_while_after_a_checkpoint(dir: &Path) {
    let there = until(PATIENCE, || (!checkpoints(dir).is_empty()).then_some(()));
    assert!(there.is_some(), "no checkpoint is written");
    std::thread::sleep(Duration::from_millis(dice(150)));
}

fn resume(place: &Place, out: &str) -> Ended {
    place.tandem(&format!("resume {out} --log json"))
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
    let ended = resume(&place, "torn");
    ended.expect(0).says(&["is damaged", "passed over"]);
    assert_same(&dir, &place.path("whole"));
}

#[test]
fn what_cannot_be_resumed_is_refused_with_the_reason() {
    let place = Place::new();
    let scene = scene_of_the_test();
    let (none, _) = LONG.rsplit_once("--set").unwrap();
    place.run("none", &scene, none).expect(0);
    resume(&place, "none")
        .expect(2)
        .says(&["has no checkpoint"]);
    resume(&place, "nowhere").expect(2).says(&["scene.toml"]);
    place.run("other", &scene, LONG).expect(0);
    // Another scene in the place of the one that was run.
    let file = place.path("other").join("scene.toml");
    let text = fs::read_to_string(&file).unwrap();
    fs::write(&file, text.replace("end = 0.1", "end = 0.11")).unwrap();
    let ended = resume(&place, "other");
    ended.expect(2).says(&["is not of this run", "scene hash"]);
}

/// A recording is of the run up to where it was cut short: the rest is not recorded, and the result is as without it.
#[test]
fn a_recording_ends_where_its_run_was_cut_short() {
    let place = Place::new();
    let scene = scene_of_the_test();
    place.run("whole", &scene, LONG).expect(0);
    let dir = place.path("killed");
    let run = place.start_run("killed", &scene, &format!("{LONG} --record"));
    a_while_after_a_checkpoint(&dir);
    signal(run.pid(), "KILL");
    run.end();
    let recording = dir.join("recording.tandem");
    let before = fs::read(&recording).unwrap();
    let ended = resume(&place, "killed").expect(0);
    ended.says(&["continues without its recording"]);
    assert_same(&dir, &place.path("whole"));
    assert_eq!(fs::read(&recording).unwrap(), before);
    let end = Playback::verify(&recording).unwrap();
    assert!(matches!(end, End::Torn { .. }), "{end:?}");
    let ended = place.tandem("replay killed/recording.tandem --dem --in-process");
    let ended = ended.expect(0);
    assert!(ended.stdout.contains("the same, to the bit"), "{ended:#?}");
}

/// The discs in Python without `save`: the run says so when it begins, and `resume` says what to do.
#[test]
fn a_run_of_a_solver_that_cannot_save_says_so_and_is_started_again() {
    if !python_can_join() {
        return;
    }
    let place = Place::new();
    let folder = root().join("python/examples").display().to_string();
    let discs = format!(
        r#"import sys
sys.path.insert(0, {folder:?})
import disc_dem
able = disc_dem.Discs.capabilities
disc_dem.Discs.capabilities = tuple(can for can in able if can != "save")
sys.exit(disc_dem.serve_dem(disc_dem.Discs()))
"#
    );
    let discs = place.write("discs.py", &discs);
    let command = format!("python3 '{}'", discs.display());
    let scene = scene("jiang2020/collision_hard");
    let keeps = "--set output.checkpoint.time=2e-4 --set output.checkpoint.end=true";
    let run = format!("--variant quick --dem \"{command}\" {keeps}");
    let unable = "this run cannot be resumed: the dem `";
    let ended = place.run("whole", &scene, &run).expect(0);
    assert_eq!(ended.stderr.matches(unable).count(), 1, "{ended:#?}");
    let mut running = place.start_run("killed", &scene, &run);
    running.stepping("killed");
    signal(running.pid(), "KILL");
    running.end();
    let dir = place.path("killed");
    assert!(checkpoints(&dir).is_empty());
    let ended = resume(&place, "killed --trust").expect(2);
    ended.says(&[unable, "starts it again and leaves"]);
    // As it says.
    let scene = "killed/scene.toml";
    place.run("again", scene, "--trust").expect(0);
    assert_same(&place.path("again"), &place.path("whole"));
    // No scene begins with a state that is not there.
    let from = format!("--trust --set start.from={}", place.path("whole").display());
    let ended = place.run("branch", scene, &from).expect(2);
    ended.says(&["has no checkpoint", unable]);
}

/// Ways in which the parts of a run are done.
const WAYS: [&str; 4] = ["", "--in-process", "--threads 2", "--window 7"];

/// When a run is killed.
#[derive(Debug, Clone, Copy)]
enum When {
    /// Within the first 150 ms.
    StartUp,
    /// At a moment of its whole time.
    Anywhere,
    /// When a file of a checkpoint appears or changes its name.
    Checkpoint,
}

/// Names in the folder of checkpoints, those of files that are being written too.
fn names_of_checkpoints(dir: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(dir.join("checkpoints")).into_iter().flatten();
    let mut names: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    names.sort();
    names
}

/// Runs or resumes what is in `out` and kills it; whether there was something to kill.
fn killed(place: &Place, out: &str, run: &str, way: &str, when: When, wall: f64) -> bool {
    let dir = place.path(out);
    let before = names_of_checkpoints(&dir);
    let running = if checkpoints(&dir).is_empty() {
        place.start(&format!("run {run} --out {out} {way}"))
    } else {
        place.start(&format!("resume {out} {way}"))
    };
    let limit = Duration::from_secs_f64(wall + 1.0);
    match when {
        When::StartUp => std::thread::sleep(Duration::from_millis(dice(150))),
        When::Anywhere => {
            std::thread::sleep(Duration::from_micros(dice((1e6 * wall) as u64 + 1)));
        }
        When::Checkpoint => {
            until(limit, || {
                (names_of_checkpoints(&dir) != before || !crate::harness::lives(running.pid()))
                    .then_some(())
            });
        }
    }
    signal(running.pid(), "KILL");
    running.end_within(Duration::from_mins(10)).signal() == Some(9)
}

/// A scene with checkpoints and frames, killed three times; what became of it.
fn kill_three_times(name: &str, variant: &str) -> String {
    let place = Place::new();
    let file = scene(name);
    let table: toml::Table = fs::read_to_string(&file).unwrap().parse().unwrap();
    let number = |section: &str, key: &str| {
        let variants = table.get("variant").and_then(|all| all.get(variant));
        let set = variants.and_then(|set| set.get(format!("{section}.{key}")));
        let value = set.unwrap_or_else(|| &table[section][key]);
        value
            .as_float()
            .or(value.as_integer().map(|n| n as f64))
            .unwrap()
    };
    let (end, every) = (number("time", "end"), number("output", "every"));
    let frames = every * (end / every / 10.0).round().max(1.0);
    let set = format!("--set output.frames={frames} --set output.checkpoint.wall=0.05");
    let run = format!("'{file}' {set} {}", hashes::option(variant));
    let ended = place.start(&format!("run {run} --out whole"));
    let ended = ended.end_within(Duration::from_mins(30));
    let code = ended.status.code();
    let wall = RunFiles::read(&place.path("whole")).number("wall_s");
    let first = dice(4) as usize;
    let mut kills = Vec::new();
    for (n, when) in [When::StartUp, When::Anywhere, When::Checkpoint]
        .into_iter()
        .enumerate()
    {
        let way = WAYS[(first + n) % 4];
        if killed(&place, "killed", &run, way, when, wall) {
            let dir = place.path("killed");
            kills.push(format!("{when:?} ({})", checkpoints(&dir).len()));
        }
    }
    let dir = place.path("killed");
    let last = if checkpoints(&dir).is_empty() {
        format!("run {run} --out killed")
    } else {
        "resume killed".to_owned()
    };
    let last = place.start(&last).end_within(Duration::from_mins(30));
    assert_eq!(last.status.code(), code, "{name} {variant}: {last:#?}");
    assert_same(&dir, &place.path("whole"));
    let kills = kills.join(", ");
    format!("{name},{variant},{wall:.1},\"{kills}\",the same")
}

#[test]
#[ignore = "an hour"]
fn every_scene_that_is_killed_three_times_goes_on_to_the_same_bits() {
    let variable = |name: &str| std::env::var(name).unwrap_or_default();
    let wanted = variable("TANDEM_SCENES");
    let seconds = |name: &str, otherwise: f64| variable(name).parse().unwrap_or(otherwise);
    let lengths = seconds("TANDEM_SHORTEST", 0.0)..=seconds("TANDEM_LONGEST", 120.0);
    let mut rows = hashes::of_the_night(hashes::baseline());
    // What is reported of the last steps of a run that a solver stops depends on the window.
    rows.retain(|row| {
        row.case.scene.contains(&wanted) && lengths.contains(&row.wall) && row.outcome.exit != 3
    });
    let table = at_once(hashes::WORKERS, &rows, |row| {
        let line = kill_three_times(&row.case.scene, &row.case.variant);
        println!("{line}");
        line
    });
    assert!(!table.is_empty(), "no scene has `{wanted}` in its name");
    if let Some(file) = std::env::var_os("TANDEM_TABLE") {
        let head = "scene,variant,wall time in s,killed (checkpoints then),result";
        let text = format!("{head}\n{}\n", table.join("\n"));
        fs::write(root().join(file), text).unwrap();
    }
}
