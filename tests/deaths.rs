//! Whoever dies or falls silent, the others end soon, say who it was, and leave no trace but the run directory.

use std::collections::BTreeSet;
use std::path::Path;
use std::time::{Duration, Instant};

use conformance::Flaw;
use interface::message::control::{Notice, Party};
use interface::message::wire::flags;
use interface::message::{Message, Payload};
use interface::transport::domain::Domain;

use crate::harness::{
    Ended, PATIENCE, Place, RunFiles, Running, at_once, dice, has, lives, quoted, scene, segments,
    signal, until,
};

/// From a death to the end of the run. It takes some ms; the limit is for a machine that is busy with other things, and shorter
/// than the 30 s for which a silent solver is waited for.
const SOON: Duration = Duration::from_secs(20);

/// A block that rests on the floor: an exchange of forces in every step, for minutes if it is let.
fn start_long<'a>(place: &'a Place, out: &str, more: &str) -> Running<'a> {
    // The first check is over at the start; the other, which the study of the scene needs, never.
    let check = r#"check=[{name="early",value="t",to=0,at_most=1,source="s"},{name="normal force is the weight",value="t",reference=0,tolerance=9,source="s"}]"#;
    let long = "--variant quick --set time.end=20 --set output.every=1e-4";
    let scene = scene("jiang2020/normal_force");
    place.start_run(out, &scene, &format!("{long} --set '{check}' {more}"))
}

/// Lets a run go on for a while that differs from call to call; printed in case the test fails.
fn a_random_while() {
    let while_ms = 50 + dice(500);
    println!("after {while_ms} ms");
    std::thread::sleep(Duration::from_millis(while_ms));
}

/// What holds of every run directory of a run that was ended: what was recorded up to then is there, with the bodies and the
/// checks that are over.
#[track_caller]
fn assert_kept(dir: &Path) -> RunFiles {
    let files = RunFiles::read(dir);
    let history = files.history();
    history.assert_sound();
    let last = *history.column("time [s]").last().unwrap();
    let (time, every) = (files.number("time"), 1e-4);
    assert!(
        time > 0.0 && (last - time).abs() <= 2.0 * every,
        "recorded up to {last}, stopped at {time}"
    );
    assert!(dir.join("scene.toml").is_file());
    let reason = files.text("reason");
    assert!(!reason.is_empty());
    let checks = files.summary["checks"].as_array().unwrap();
    assert_eq!((checks.len(), &checks[0]["name"]), (1, &"early".into()));
    let bodies = std::fs::read_to_string(dir.join("bodies.csv")).unwrap();
    assert!(bodies.lines().count() > 1);
    files
}

/// Kills a solver in mid run.
fn a_solver_is_killed(party: &str) {
    let place = Place::new();
    let mut run = start_long(&place, "out", "");
    let (mpm, dem) = (run.solver("out", "mpm"), run.solver("out", "dem"));
    run.stepping("out");
    a_random_while();
    let runs = run.runs();
    assert_eq!(runs.len(), 1);
    assert!(
        !segments(&runs).is_empty(),
        "a run that goes on has segments: the test below can fail"
    );
    let death = Instant::now();
    signal(if party == "mpm" { mpm } else { dem }, "KILL");
    let ended = run.end().expect(3);
    let took = death.elapsed();
    println!("the run ended {took:.0?} after the death of {party}");
    assert!(took < SOON, "{took:?}");
    assert!(!lives(mpm) && !lives(dem));
    place.assert_clean(&ended.runs);

    let files = assert_kept(&place.path("out"));
    assert_eq!(files.text("status"), "failed");
    assert!(files.number("steps") > 0.0);
    // Who, how, and at which step, in the summary and on standard error alike.
    let reason = files.text("reason");
    let begin = format!("the {party} solver was killed by signal 9 at step ");
    let step: u64 = reason
        .strip_prefix(&begin)
        .and_then(|rest| rest.split(|c: char| !c.is_ascii_digit()).next())
        .and_then(|step| step.parse().ok())
        .unwrap_or_else(|| panic!("not `{begin}N`: {reason}"));
    // It had reported all steps but those of the last grant, and the opening step.
    let steps = files.summary["steps"].as_u64().unwrap();
    assert!(
        step >= steps && step <= steps + 64 + 1,
        "killed at step {step} after {steps} steps"
    );
    ended.says(&[&begin]);
}

#[test]
fn a_killed_mpm_ends_the_run() {
    a_solver_is_killed("mpm");
}

#[test]
fn a_killed_dem_ends_the_run() {
    a_solver_is_killed("dem");
}

/// Kills the coupler in mid run; returns the ids of its run when both solvers have ended by themselves.
fn a_coupler_is_killed(place: &Place, out: &str) -> BTreeSet<String> {
    let mut run = start_long(place, out, "");
    let (mpm, dem) = (run.solver(out, "mpm"), run.solver(out, "dem"));
    run.stepping(out);
    a_random_while();
    let runs = run.runs();
    signal(run.pid(), "KILL");
    let ended = run.end();
    assert_eq!(ended.signal(), Some(9));
    let alone = until(SOON, || (!lives(mpm) && !lives(dem)).then_some(()));
    assert!(
        alone.is_some(),
        "mpm lives: {}, dem lives: {}",
        lives(mpm),
        lives(dem)
    );
    assert!(
        !place.temporary().is_empty(),
        "nobody was there to remove it"
    );
    runs
}

#[test]
fn a_killed_coupler_ends_the_solvers_and_clean_removes_what_is_left() {
    let place = Place::new();
    let runs = a_coupler_is_killed(&place, "out");
    let clean = place.tandem("clean").expect(0);
    has(&clean.stdout, "1 dead run");
    place.assert_clean(&runs);
    // Only what is whole is there.
    assert!(!place.path("out/summary.json").exists());
    let clean = place.tandem("clean").expect(0);
    has(&clean.stdout, "0 dead run");
}

/// What a killed coupler has recorded reads back up to less than its last second.
#[test]
fn a_killed_coupler_leaves_a_history_of_whole_rows_and_the_next_run_removes_the_rest() {
    let place = Place::new();
    let runs = a_coupler_is_killed(&place, "out");
    let history = place.path("out/history.csv");
    if std::fs::metadata(&history).unwrap().len() > 0 {
        crate::harness::History::read(&history);
    }
    let hard = scene("jiang2020/collision_hard");
    let next = place.run("next", &hard, "--variant quick").expect(0);
    next.says(&["removed the files of the dead run"]);
    place.assert_clean(&runs);
}

/// Stops a solver without killing it, for longer than the run's patience.
fn a_solver_is_stopped(party: &str, other: &str) {
    let place = Place::new();
    let more = "--set coupling.deadline=0.5 --patience 1";
    let mut run = start_long(&place, "out", more);
    let (stopped, others) = (run.solver("out", party), run.solver("out", other));
    run.stepping("out");
    a_random_while();
    signal(stopped, "STOP");
    let ended = run.end().expect(3);
    assert!(!lives(stopped) && !lives(others));
    place.assert_clean(&ended.runs);
    let files = assert_kept(&place.path("out"));
    assert_eq!(files.text("status"), "failed");
    let reason = files.text("reason");
    let stopped = format!("the {party} solver has been stopped by a signal");
    has(reason, &stopped);
    has(reason, "step ");
    ended.says(&[&stopped]);
}

#[test]
fn a_stopped_mpm_is_named_when_patience_ends_and_removed() {
    a_solver_is_stopped("mpm", "dem");
}

#[test]
fn a_stopped_dem_is_named_when_patience_ends_and_removed() {
    a_solver_is_stopped("dem", "mpm");
}

/// An interrupt ends a run in order.
fn a_run_is_interrupted(name: &str, more: &str) {
    let place = Place::new();
    let mut run = start_long(&place, "out", more);
    run.stepping("out");
    a_random_while();
    signal(run.pid(), name);
    let ended = run.end().expect(130);
    place.assert_clean(&ended.runs);
    let files = assert_kept(&place.path("out"));
    assert_eq!(files.text("status"), "interrupted");
    has(files.text("reason"), "interrupted at t = ");
    assert!(files.number("steps") > 0.0);
}

#[test]
fn an_interrupt_ends_a_run_in_order() {
    a_run_is_interrupted("INT", "");
}

#[test]
fn a_termination_ends_a_run_in_one_process_in_order() {
    a_run_is_interrupted("TERM", "--in-process");
}

/// D16: an interrupt was heard only when a solver that was stopped went on.
#[test]
fn an_interrupt_is_heard_while_a_stopped_solver_is_waited_for() {
    for (party, name) in [("mpm", "INT"), ("dem", "TERM")] {
        let place = Place::new();
        let mut run = start_long(&place, "out", "");
        let stopped = run.solver("out", party);
        run.stepping("out");
        a_random_while();
        signal(stopped, "STOP");
        std::thread::sleep(Duration::from_millis(100));
        let asked = Instant::now();
        signal(run.pid(), name);
        let ended = run.end().expect(130);
        let took = asked.elapsed();
        assert!(took < SOON, "{took:?}");
        place.assert_clean(&ended.runs);
        let files = assert_kept(&place.path("out"));
        assert_eq!(files.text("status"), "interrupted");
        let words = format!("interrupted while the {party} solver was stopped");
        assert!(files.text("reason").contains(&words));
    }
}

/// While a solver that never comes is waited for.
#[test]
fn an_interrupt_is_heard_before_the_solvers_have_come() {
    let place = Place::new();
    let mut run = start_long(&place, "out", "--dem \"sh -c 'exec sleep 600'\"");
    run.solver("out", "mpm");
    signal(run.pid(), "INT");
    let ended = run.end().expect(130);
    place.assert_clean(&ended.runs);
    let files = RunFiles::read(&place.path("out"));
    assert_eq!(files.text("status"), "interrupted");
}

/// The variables that make a process of this program a solver of the bodies with a flaw: its run, the flaw, and the file that it
/// writes where it hangs.
const FLAWED: [&str; 3] = ["TANDEM_FLAWED", "TANDEM_FLAW", "TANDEM_FLAW_FILE"];

/// No test, but what the next ones start.
#[test]
fn a_process_that_is_told_to_has_a_flaw() {
    let [Ok(run), Ok(flaw), Ok(file)] = FLAWED.map(std::env::var) else {
        return;
    };
    let mut reports = 0;
    let passing = Flaw::passing(move |message| {
        if let ("pieces", Payload::Saved(state)) = (flaw.as_str(), &message.payload)
            && message.header.flags & flags::LAST == 0
        {
            // No flaw: more than wait in a channel.
            let of = |piece: &[u8]| Message::new(message.header, Payload::Saved(piece.to_vec()));
            return state.chunks(state.len().div_ceil(9)).map(of).collect();
        }
        let mut hangs = flaw == "goodbye" && matches!(message.as_notice(), Ok(Notice::Bye));
        if let Payload::Report(_) = &message.payload {
            reports += 1;
            hangs |= flaw == "report" && reports == 30;
        }
        if hangs {
            std::fs::write(&file, "").unwrap();
            loop {
                std::thread::sleep(PATIENCE);
            }
        }
        vec![message]
    });
    let domain = Domain::join(&run).unwrap();
    mutant::serve(&domain, Party::Dem, passing);
}

/// The command of a solver of the bodies that has this flaw.
pub fn flawed(place: &Place, flaw: &str) -> String {
    let [run, name, file] = FLAWED;
    let script = format!(
        "{run}=$2 {name}={flaw} {file}=\"{}\" exec \"{}\" --exact {} --nocapture >/dev/null",
        place.path("hangs").display(),
        std::env::current_exe().unwrap().display(),
        "deaths::a_process_that_is_told_to_has_a_flaw",
    );
    format!("sh -c '{script}' sh")
}

/// Starts a run with it. Its deadline is longer than the patience of this test.
fn start_flawed<'a>(place: &'a Place, flaw: &str) -> Running<'a> {
    let command = flawed(place, flaw);
    let more = "--variant quick --set check=[] --set coupling.deadline=3600 --dem";
    let more = format!("{more} {}", quoted(&command));
    place.start_run("out", &scene("jiang2020/collision_hard"), &more)
}

/// Interrupts runs whose solver hangs `at` a place, one once and one twice.
fn a_run_that_hangs_is_interrupted(at: &str) {
    let ways = [(1, "they did not answer"), (2, "it was asked twice")];
    at_once(ways.len(), &ways, |&(signals, reason)| {
        a_run_that_hangs_is_signalled(at, signals, reason);
    });
}

fn a_run_that_hangs_is_signalled(at: &str, signals: usize, reason: &str) {
    let place = Place::new();
    let mut run = start_flawed(&place, at);
    let dem = run.solver("out", "dem");
    let hangs = place.path("hangs");
    until(PATIENCE, || hangs.exists().then_some(())).expect("the solver hangs");
    for _ in 0..signals {
        signal(run.pid(), "INT");
        std::thread::sleep(Duration::from_millis(100));
    }
    let ended = run.end().expect(130);
    assert!(!lives(dem));
    place.assert_clean(&ended.runs);
    let files = RunFiles::read(&place.path("out"));
    assert_eq!(files.text("status"), "interrupted");
    has(files.text("reason"), reason);
}

/// The coupler was deaf for up to two minutes, and a second Ctrl-C left the solvers and what is in shared memory.
#[test]
fn an_interrupt_is_heard_while_a_goodbye_is_waited_for() {
    a_run_that_hangs_is_interrupted("goodbye");
}

/// The first Ctrl-C waited for the report until `coupling.deadline`.
#[test]
fn an_interrupt_is_heard_while_a_report_is_waited_for() {
    a_run_that_hangs_is_interrupted("report");
}

/// It was ended by SIGBUS, without a word.
#[test]
fn shared_memory_that_vanishes_is_told() {
    let place = Place::new();
    let mut run = start_long(&place, "out", "");
    run.stepping("out");
    a_random_while();
    for name in segments(&run.runs()) {
        let segment = std::fs::OpenOptions::new()
            .write(true)
            .open(Path::new("/dev/shm").join(name));
        let _ = segment.and_then(|segment| segment.set_len(0));
    }
    run.end()
        .expect(3)
        .says(&["shared memory of the run vanished"]);
    let files = RunFiles::read(&place.path("out"));
    assert_eq!(files.text("status"), "failed");
    let reason = files.text("reason");
    has(reason, "shared memory of the run vanished");
    // Whoever was the first to end has not removed the run.
    place.tandem("clean").expect(0);
}

/// A run with another solver, which is none.
fn with_dem(place: &Place, command: &str) -> Ended {
    let more = format!("--variant quick --dem '{command}'");
    let hard = scene("jiang2020/collision_hard");
    let ended = place.run("out", &hard, &more).expect(3);
    place.assert_clean(&ended.runs);
    let files = RunFiles::read(&place.path("out"));
    assert_eq!(files.text("status"), "failed");
    has(&ended.stderr, files.text("reason"));
    ended
}

#[test]
fn a_solver_command_that_does_not_exist_is_named() {
    let place = Place::new();
    let missing = with_dem(&place, "/no/such/solver --fast").says(&[
        "cannot start the dem solver `/no/such/solver --fast`",
        "No such file",
    ]);
    // The other solver, hardly begun, hears of it: it ends by itself and need not be killed.
    assert!(!missing.stderr.contains("is killed"), "{}", missing.stderr);
    with_dem(&place, "/etc/passwd").says(&[
        "cannot start the dem solver `/etc/passwd`",
        "ermission denied",
    ]);
}

/// D14: the limit is the scene's, and the advice names it.
#[test]
fn the_limit_on_arrival_can_be_set() {
    let place = Place::new();
    let scene = scene("jiang2020/collision_hard");
    let late = "--set coupling.start_deadline=1 --dem \"sh -c 'exec sleep 600'\"";
    let ended = place.run("out", &scene, &format!("--variant quick {late}"));
    let ended = ended.expect(3).says(&[
        "nothing from the dem for 1",
        "its hello",
        "coupling.start_deadline",
    ]);
    assert!(ended.took < Duration::from_secs(20), "{:?}", ended.took);
    place.assert_clean(&ended.runs);
}

/// `tandem check ... | head`: what no program reads is not written, and the exit status is as ever.
#[test]
fn a_reader_that_leaves_is_no_death() {
    let unheard = |arguments: &[&str], stdout: bool| {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_tandem"));
        command.args(arguments);
        if stdout {
            command.stdout(writer);
        } else {
            command.stderr(writer);
        }
        let output = command.output().unwrap();
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert!(!stderr.contains("panicked"), "{stderr}");
        output.status.code()
    };
    let scene = scene("jiang2020/normal_force");
    assert_eq!(unheard(&["check", &scene], true), Some(0));
    assert_eq!(unheard(&["plan", &scene], true), Some(0));
    assert_eq!(unheard(&["schema"], true), Some(0));
    assert_eq!(unheard(&["check", "nowhere.toml"], false), Some(2));
}

/// `nohup` ignores SIGHUP for the program that it starts, a shell's job in the background Ctrl-C.
#[test]
fn a_signal_that_was_ignored_at_the_start_ends_no_run() {
    let place = Place::new();
    let scene = scene("jiang2020/normal_force");
    let line = format!(
        "run '{scene}' --variant quick --set check=[] --set time.end=0.3 --out '{}'",
        place.path("run").display()
    );
    let mut run = place.start_after("trap '' HUP INT", &line);
    run.stepping("run");
    for ignored in ["HUP", "INT"] {
        signal(run.pid(), ignored);
    }
    run.end().expect(0);
}
