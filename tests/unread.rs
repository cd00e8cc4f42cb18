//! Nobody reads what a run says: the run goes on and loses nothing.

use std::fs;
use std::io::{PipeReader, pipe};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use crate::harness::{PATIENCE, Place, RunFiles, scene, until, words};

/// Solvers that are not told why the coupler is silent give up after half a second and two more.
const DEADLINE: &str = "--variant quick --set coupling.deadline=0.5";

/// The reading end of a pipe with no room, and the writing end.
fn full_pipe() -> (PipeReader, Stdio) {
    let (reader, writer) = pipe().unwrap();
    let filled = Command::new("dd")
        .args(["if=/dev/zero", "bs=4096", "count=16", "status=none"])
        .stdout(writer.try_clone().unwrap())
        .status();
    assert!(filled.unwrap().success());
    (reader, writer.into())
}

fn start(place: &Place, stderr: Stdio, line: &str) -> Child {
    Command::new(env!("CARGO_BIN_EXE_tandem"))
        .args(words(line))
        .env("TANDEM_RUNTIME_DIR", place.temporary_path())
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(stderr)
        .spawn()
        .expect("the program starts")
}

#[track_caller]
fn ends_well(child: &mut Child) {
    let status = until(PATIENCE, || child.try_wait().unwrap());
    if status.is_none() {
        child.kill().unwrap();
    }
    assert_eq!(status.expect("it ends").code(), Some(0));
}

#[track_caller]
fn assert_same_hash(ours: &Path, theirs: &Path) {
    let [ours, theirs] = [ours, theirs].map(RunFiles::read);
    assert_eq!(ours.text("state_hash"), theirs.text("state_hash"));
}

#[test]
fn a_run_whose_standard_error_nobody_reads_goes_on() {
    let place = Place::new();
    let scene = scene("jiang2020/drop_hard");
    place.run("read", &scene, DEADLINE).expect(0);
    let out = place.path("unread");
    let (reader, stderr) = full_pipe();
    let how = format!("--log json --out '{}'", out.display());
    let mut run = start(&place, stderr, &format!("run '{scene}' {DEADLINE} {how}"));
    ends_well(&mut run);
    drop(reader);
    assert_same_hash(&out, &place.path("read"));
    // The log has what the pipe had no room for.
    let log = fs::read_to_string(out.join("log.jsonl")).unwrap();
    assert!(log.contains("\"joined\"") && log.contains("\"ready\""));
}
