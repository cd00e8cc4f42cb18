//! A run directory belongs to one run, keeps what users put there, and says how a run ended.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::Command;

use crate::harness::{Place, QUICK, RunFiles, has, scene, signal};

/// Takes some tenths of a second.
const LONG: &str = "--variant quick --set time.end=3 --set check=[]";

fn hard() -> String {
    scene("jiang2020/collision_hard")
}

/// D4: both ended with status 0 and files of each other.
#[test]
fn a_second_run_with_the_same_directory_is_refused_and_told_who_has_it() {
    let place = Place::new();
    let mut first = place.start_run("out", &scene("jiang2020/normal_force"), LONG);
    first.stepping("out");
    let pid = first.pid();
    let holder = format!("is in use by process {pid}");
    place.run("out", &hard(), QUICK).expect(2).says(&[&holder]);
    let out = place.path("out");
    place.tandem("resume out").expect(2).says(&[&holder]);
    // The lock is that of the directory, not only of the file in it.
    fs::remove_file(out.join(".tandem.lock")).unwrap();
    place
        .run("out", &hard(), QUICK)
        .expect(2)
        .says(&["is in use by", &pid.to_string()]);
    signal(first.pid(), "INT");
    first.end().expect(130);
    // A lock is not left behind.
    place.run("out", &hard(), QUICK).expect(0);
}

/// D7: a folder of the user's own was emptied.
#[test]
fn what_a_user_has_put_into_the_directory_stays() {
    let place = Place::new();
    let with_frames = format!("{QUICK} --set output.frames=1e-3");
    let out = place.path("out");
    fs::create_dir_all(out.join("frames")).unwrap();
    fs::write(out.join("frames/mine.txt"), "mine").unwrap();
    fs::write(out.join("notes.md"), "mine").unwrap();
    for _ in 0..2 {
        place.run("out", &hard(), &with_frames).expect(0);
        assert!(out.join("frames/frames.pvd").exists());
        for mine in ["frames/mine.txt", "notes.md"] {
            assert_eq!(fs::read_to_string(out.join(mine)).unwrap(), "mine");
        }
    }
    // What the user has put there under a name of Tandem's is in the way.
    let other = place.path("other");
    fs::create_dir_all(&other).unwrap();
    fs::write(other.join("bodies.csv"), "mine").unwrap();
    place
        .run("other", &hard(), QUICK)
        .expect(2)
        .says(&["bodies.csv is not a file of an earlier run"]);
    let names = fs::read_dir(&other).unwrap();
    assert_eq!(names.count(), 1, "nothing else is written there");
}

/// D8: bodies and frames of another scene stayed beside the new scene.
#[test]
fn a_new_run_leaves_nothing_of_the_earlier_one() {
    let place = Place::new();
    let with_frames = format!("{QUICK} --set output.frames=1e-3");
    place.run("out", &hard(), &with_frames).expect(0);
    let out = place.path("out");
    assert!(out.join("bodies.csv").exists() && out.join("frames").exists());
    // A scene without bodies and without frames.
    let wave = scene("chen2023/wave_1d");
    place.run("out", &wave, QUICK).expect(0);
    for gone in ["bodies.csv", "frames", ".tandem.next", ".tandem.earlier"] {
        assert!(!out.join(gone).exists(), "{gone}");
    }
    assert_eq!(RunFiles::read(&out).text("scene"), "wave_1d");
}

/// D8: the finished result was gone before it was known that the new run starts.
#[test]
fn a_run_that_fails_to_start_leaves_the_earlier_result() {
    let place = Place::new();
    place.run("out", &hard(), QUICK).expect(0);
    let out = place.path("out");
    let all = |dir: &Path| {
        [
            "summary.json",
            "history.csv",
            "bodies.csv",
            "scene.toml",
            "log.jsonl",
        ]
        .map(|name| fs::read(dir.join(name)).unwrap())
    };
    let before = all(&out);
    let silent = format!("{QUICK} --dem \"sh -c 'echo no licence >&2; exit 7'\"");
    for _ in 0..2 {
        let ended = place.run("out", &hard(), &silent).expect(3).says(&[
            "the dem solver ended with exit status 7",
            "last lines of dem.log:",
        ]);
        for phrase in ["the earlier result in", "failed-start"] {
            has(&ended.stdout, phrase);
        }
        assert!(all(&out) == before);
        let failed = RunFiles::read(&out.join("failed-start"));
        assert_eq!(failed.text("status"), "failed");
        assert!(failed.text("reason").contains("\n  no licence"));
        let log = fs::read_to_string(out.join("failed-start/dem.log")).unwrap();
        assert_eq!(log, "no licence\n");
    }
    place.run("out", &hard(), QUICK).expect(0);
    assert!(!out.join("failed-start").exists());
}

#[test]
fn modes_follow_the_umask() {
    let place = Place::new();
    let out = place.path("out");
    let line = format!(
        "run '{}' {QUICK} --out out --set output.checkpoint.time=0.001",
        hard()
    );
    place.start_after("umask 027", &line).end().expect(0);
    let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
    for name in ["summary.json", "scene.toml", "bodies.csv", "history.csv"] {
        assert_eq!(mode(&out.join(name)), 0o640, "{name}");
    }
    for entry in fs::read_dir(out.join("checkpoints")).unwrap() {
        assert_eq!(mode(&entry.unwrap().path()), 0o640);
    }
}

/// D6: no summary in any of 583 runs whose coupler was killed.
#[test]
fn a_killed_run_without_a_checkpoint_is_told_and_gets_a_summary() {
    let place = Place::new();
    let mut run = place.start_run("my run", &scene("jiang2020/normal_force"), LONG);
    run.stepping("my run");
    run.has_rows("my run");
    signal(run.pid(), "KILL");
    run.end();
    let out = place.path("my run");
    let resumed = place.tandem("resume 'my run'").expect(2);
    resumed.says(&[
        "its coupler was killed",
        "has no checkpoint",
        "`tandem run 'my run/scene.toml' --out OTHER` starts it again and leaves my run as it is; \
         `--out 'my run'` replaces what is there",
    ]);
    let nowhere = place.tandem("resume nowhere").expect(2);
    nowhere.says(&["scene.toml"]);
    let files = RunFiles::read(&out);
    assert_eq!(files.text("status"), "killed");
    assert!(files.text("reason").contains("its history ends at t ="));
    // A new run into the directory of one that was killed says it too.
    let mut run = place.start_run("again", &scene("jiang2020/normal_force"), LONG);
    run.stepping("again");
    signal(run.pid(), "KILL");
    run.end();
    place
        .run("again", &hard(), QUICK)
        .expect(0)
        .says(&["its coupler was killed"]);
}

/// D18: the exit status was 0.
#[test]
fn a_full_device_is_an_error_of_what_is_said() {
    for arguments in [&["schema"][..], &["plan", &hard()], &["check", &hard()]] {
        let full = fs::OpenOptions::new()
            .write(true)
            .open("/dev/full")
            .unwrap();
        let tandem = env!("CARGO_BIN_EXE_tandem");
        let ended = Command::new(tandem).args(arguments).stdout(full).output();
        let ended = ended.unwrap();
        let stderr = String::from_utf8(ended.stderr).unwrap();
        assert_eq!(ended.status.code(), Some(3), "{arguments:?}: {stderr}");
        has(&stderr, "No space left on device");
    }
}

/// D12: a full disk was reported as "cannot write summary.json", and the history ended in half a row. The limit on the size of
/// files stands for the disk.
#[test]
fn an_output_that_cannot_be_written_is_told_and_the_history_ends_with_a_row() {
    let place = Place::new();
    let out = place.path("out");
    let line = format!(
        "run '{}' {LONG} --out out --in-process --set output.every=1e-3",
        scene("jiang2020/normal_force")
    );
    let ended = place.start_after("trap '' XFSZ; ulimit -f 16", &line).end();
    let ended = ended.expect(3);
    let files = RunFiles::read(&out);
    let reason = files.text("reason");
    has(&ended.stderr, reason);
    // Which of the two tables is as long first depends on when their rows are written.
    for phrase in [".csv: File too large", "ulimit -f"] {
        assert!(reason.contains(phrase), "no `{phrase}` in: {reason}");
    }
    files.history().assert_sound();
    // The table that reached the limit has all rows that fit. It once lost all of its last piece.
    let size = |table| fs::metadata(out.join(table)).unwrap().len();
    let largest = size("history.csv").max(size("course.csv"));
    assert!((7_500..=8_192).contains(&largest), "{largest}");
}

/// A run that has reached its end counted as failed.
#[test]
fn a_checkpoint_that_cannot_be_written_is_a_warning() {
    let place = Place::new();
    let out = place.path("out");
    fs::create_dir(&out).unwrap();
    fs::write(out.join("checkpoints"), "a file of the user's").unwrap();
    let more = format!("{QUICK} --set output.checkpoint.time=0.001");
    let ended = place.run("out", &hard(), &more).expect(0);
    ended.says(&["no checkpoint at t = "]);
    assert_eq!(RunFiles::read(&out).text("status"), "done");
}
