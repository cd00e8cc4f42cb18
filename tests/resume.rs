//! What `tandem resume` goes on from, and what it refuses. That a run which is killed at any moment goes on to the same bits is for
//! `chaos.rs` to show.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::harness::bits::bits;
use crate::harness::{
    Ended, PATIENCE, Place, dice, has, python_can_join, root, scene, signal, until,
};
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
    let mut run = place.start_run("my run", &scene_of_the_test(), LONG);
    run.stepping("my run");
    run.has_rows("my run");
    signal(run.pid(), "INT");
    let ended = run.end().expect(130);
    let dir = place.path("my run");
    let advice = format!("`tandem resume '{}'` continues", dir.display());
    has(&ended.stdout, &advice);
    for name in ["history.csv", "course.csv"] {
        let before = fs::read(dir.join(name)).unwrap();
        let mut changed = before.clone();
        // A digit of the first row.
        let at = before.iter().position(|&b| b == b'\n').unwrap() + 1;
        changed[at] = b'7';
        fs::write(dir.join(name), &changed).unwrap();
        let ended = place.tandem("resume 'my run'").expect(2);
        ended.says(&[
            name,
            "bytes, which it had at the checkpoint, were changed",
            "`tandem run 'my run/scene.toml' --out OTHER` starts the run again",
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
    place.write("my run/history.csv.changed", "mine");
    let ended = place.tandem("resume 'my run' --new-tables").expect(0);
    ended.says(&["history.csv.changed-2"]);
    let read = |name: &str| fs::read_to_string(dir.join(name)).unwrap();
    assert_eq!(read("history.csv.changed"), "mine");
    assert_eq!(read("history.csv.changed-2"), changed);
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
    let entries = fs::read_dir(dir.join("checkpoints")).into_iter().flatten();
    let mut paths: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    paths.retain(|path| path.extension().is_some_and(|e| e == "tandem"));
    paths.sort();
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
    for side in ["--dem", "--mpm --in-process"] {
        let replay = format!("replay killed/recording.tandem {side}");
        let replayed = place.tandem(&replay).expect(0).stdout;
        has(&replayed, "the same, to the bit");
        has(&replayed, "ends in the middle");
        assert!(!replayed.contains(": 0 steps"), "{replayed}");
    }
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
