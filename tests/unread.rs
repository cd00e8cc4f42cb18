//! Nobody reads what a run says: the run goes on and loses nothing.

use std::fs;
use std::io::{PipeReader, pipe};
use std::process::{Child, Command, Stdio};

use crate::harness::{PATIENCE, Place, python_can_join, scene, until, words};

const TANDEM: &str = env!("CARGO_BIN_EXE_tandem");
/// Solvers that do not know why the coupler is silent give up after half a second and two more.
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

fn start(place: &Place, program: &[&str], stderr: Stdio, line: &str) -> Child {
    Command::new(program[0])
        .args(&program[1..])
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

#[test]
fn a_run_whose_standard_error_nobody_reads_goes_on() {
    let place = Place::new();
    let scene = scene("jiang2020/drop_hard");
    place.run("read", &scene, DEADLINE).expect(0);
    let out = place.path("unread");
    let (reader, stderr) = full_pipe();
    let how = format!("--log json --out '{}'", out.display());
    let line = format!("run '{scene}' {DEADLINE} {how}");
    let mut run = start(&place, &[TANDEM], stderr, &line);
    ends_well(&mut run);
    drop(reader);
    assert_eq!(place.state_hash("unread"), place.state_hash("read"));
    // The log has what the pipe had no room for.
    let log = fs::read_to_string(out.join("log.jsonl")).unwrap();
    assert!(log.contains("\"joined\"") && log.contains("\"ready\""));
}

/// A program in a terminal of its own, where somebody has pressed Ctrl-S.
const STOPPED: &str = "
import os, pty, sys, termios
ours, theirs = pty.openpty()
termios.tcflow(theirs, termios.TCOOFF)
os.set_inheritable(ours, True)
os.dup2(theirs, 2)
os.execv(sys.argv[1], sys.argv[1:])";

/// The first state of the bar was drawn by the thread of the run, which waited for the terminal.
#[test]
fn a_run_on_a_stopped_terminal_goes_on() {
    if !python_can_join() {
        return;
    }
    let place = Place::new();
    let scene = scene("jiang2020/drop_hard");
    place.run("read", &scene, DEADLINE).expect(0);
    let out = place.path("unread").display().to_string();
    let line = format!("run '{scene}' {DEADLINE} --out '{out}'");
    let mut run = start(
        &place,
        &["python3", "-c", STOPPED, TANDEM],
        Stdio::null(),
        &line,
    );
    ends_well(&mut run);
    assert_eq!(place.state_hash("unread"), place.state_hash("read"));
}
