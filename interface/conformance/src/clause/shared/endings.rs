//! Sections 1, 2, 9 and 11: how a session ends, in order or not.

use std::os::unix::process::CommandExt;
use std::process::{Command, Stdio};
use std::time::Duration;

use interface::hosted::Start;
use interface::message::control::{Order, Party};
use interface::message::{Kind, Message};
use interface::session::process;
use interface::transport::remains::taking_part;
use interface::transport::wait::until;
use rustix::process::{Pid, Signal, kill_process};

use super::run::{failure, led, order};
use crate::bench::{Bench, Run, Session};
use crate::clause::{Clause, clauses};
use crate::flaw::Flaw;
use crate::verdict::{Judgement, Unmet, broken, require};

pub const CLAUSES: &[Clause] = clauses! {
    Must "S-9a" "ends at Abort between windows" by |bench| ends(&mut Run::begun(bench)?.aborted()?);
    Must "S-9b" "ends at Abort while it waits for its peer"
        by |bench| ends(&mut in_a_step(bench)?.aborted()?), after: &["S-9a"];
    Must "S-9c" "says nothing after Abort" by silent, after: &["S-9a", "S-9b"];
    Must "X-3a" "ends when the coupler is gone" by |bench| orphan(Run::begun(bench)?);
    Must "X-3b" "ends when the coupler is gone, waiting for its peer" by |bench| orphan(in_a_step(bench)?),
        after: &["X-3a"];
    Must "S-11a" "names the peer that sends nothing, at the deadline" by silent_peer;
    Must "S-11b" "names the coupler when it sends nothing, at the deadline" by silent_coupler, after: &["S-11a"];
    Must "D-2a" "runs until Close" by lives_till_close;
    Must "X-1a" "a failure names clause and step" by named, after: &["G-2a"];
    Must "X-2a" "ends with status 0 after Close" by |bench| status(Run::begun(bench)?.closed()?.solver.end(SOON), 0),
        of_processes: true;
    Must "X-2b" "ends with status 3 after a failure" by failed, of_processes: true;
    Must "X-2c" "ends with status 2 if it was not told to join" by unjoined, of_processes: true;
    Must "X-5a" "continues after Ctrl-C" by interrupted, of_processes: true;
    Must "O-6a" "removes no file of the run" by removes_nothing, of_processes: true;
    Should "O-8a" "holds the lock that notes its part" by noted, of_processes: true;
};

/// A nap of 10 ms, the ordinary end of a process, and much for a machine that is busy.
const SOON: Duration = Duration::from_secs(2);

/// A run whose solver waits for its peer.
fn in_a_step(bench: &Bench) -> Result<Run<'_>, Unmet> {
    let mut run = Run::begun(bench)?;
    run.wait_for_peer()?;
    Ok(run)
}

/// Waits for the end of a solver.
fn ends(session: &mut Session) -> Judgement {
    let start = session.solver.elapsed();
    let end = session.solver.end(SOON);
    let end = end.ok_or_else(|| broken("its end", format_args!("it lives {SOON:?} later")))?;
    let later = session.solver.since(start);
    Ok(format!("{end}, {later:.0?} later"))
}

fn silent(bench: &Bench) -> Judgement {
    for run in [Run::begun, in_a_step] {
        let mut session = run(bench)?.aborted()?;
        session.solver.end(SOON);
        for kind in [Kind::Notice, Kind::Report] {
            let more = session.take(kind)?;
            let got = format_args!("{more:?}");
            require(more.is_none(), "nothing after Abort", got)?;
        }
    }
    Ok("between windows and in a step".into())
}

fn orphan(mut run: Run) -> Judgement {
    run.session.solver.release();
    ends(&mut run.session)
}

/// Of the clauses on silence, in s.
const DEADLINE: f64 = 0.2;

/// A run with [`DEADLINE`].
fn impatient(bench: &Bench) -> Result<Run<'_>, Unmet> {
    let mut order = order(bench);
    order.deadline = DEADLINE;
    led(bench, &order)
}

/// A failure that comes after `least` and before `most` (s) and names `who`.
fn gives_up(run: &mut Run, who: &str, [least, most]: [f64; 2]) -> Judgement {
    let start = run.session.solver.elapsed();
    let longest = Duration::from_secs_f64(most);
    let failure = run.session.failure_within(longest)?;
    let waited = run.session.solver.since(start).as_secs_f64();
    let words = format!("after {waited:.2} s: {}", failure.message);
    require(
        waited > least && failure.message.contains(who),
        format_args!("a failure between {least} and {most} s that names the {who}"),
        &words,
    )?;
    Ok(words)
}

fn silent_peer(bench: &Bench) -> Judgement {
    let peer = match bench.subject.party {
        Party::Mpm => "dem",
        _ => "mpm",
    };
    let mut run = impatient(bench)?;
    run.step(0.0)?;
    run.wait_for_peer()?;
    gives_up(&mut run, peer, [0.5 * DEADLINE, DEADLINE + 1.0])
}

fn silent_coupler(bench: &Bench) -> Judgement {
    let mut run = impatient(bench)?;
    run.step(0.0)?;
    gives_up(&mut run, "coupler", [DEADLINE, DEADLINE + 3.0])
}

fn lives_till_close(bench: &Bench) -> Judgement {
    let mut run = Run::begun(bench)?;
    run.session.bye()?;
    if let Some(end) = run.session.solver.end(Duration::from_millis(100)) {
        return Err(broken("a solver that waits for Close", end));
    }
    run.session.order(&Order::Close)?;
    ends(&mut run.session)
}

fn named(bench: &Bench) -> Judgement {
    let failure = failure(bench, Flaw::grant(|grant| grant.dt = f64::NAN))?;
    let names_both = failure.message.contains("G-2") && failure.step == 1;
    let got = format_args!("step {}: {}", failure.step, failure.message);
    require(names_both, "clause G-2 and step 1", got)?;
    Ok(failure.message)
}

/// The end of a process, which shall have this status.
fn status(end: Option<String>, status: i32) -> Judgement {
    let end = end.unwrap_or_else(|| format!("lives {SOON:?} later"));
    let expected = format!("ended with exit status {status}");
    require(end == expected, expected, &end)?;
    Ok(end)
}

fn failed(bench: &Bench) -> Judgement {
    let mut session = bench.greeted()?;
    session.order(&Order::Drain)?;
    session.failure()?;
    session.order(&Order::Abort("the solver failed".into()))?;
    status(session.solver.end(SOON), 3)
}

fn unjoined(bench: &Bench) -> Judgement {
    let Start::Command(command) = &bench.subject.start else {
        return Err(Unmet::OutOfSight);
    };
    let mut words = Command::new(&command[0]);
    words.args(&command[1..]).stdin(Stdio::null());
    words.process_group(0);
    let child = words.stdout(Stdio::null()).stderr(Stdio::null()).spawn();
    let mut child = child.map_err(|e| broken("a solver that starts", e))?;
    let ended = until(bench.startup, Duration::from_millis(1), || {
        child.try_wait().ok().flatten()
    });
    process::kill(&mut child);
    let _ = child.wait();
    status(ended.map(process::describe), 2)
}

fn interrupted(bench: &Bench) -> Judgement {
    let mut run = Run::begun(bench)?;
    let pid = run
        .session
        .solver
        .pid()
        .and_then(|pid| i32::try_from(pid).ok());
    let pid = pid.and_then(Pid::from_raw).expect("a process has an id");
    kill_process(pid, Signal::INT).map_err(|e| broken("a process that takes a signal", e))?;
    run.session.solver.leave_alone(Duration::from_millis(20));
    run.step(1e-4)?;
    run.closed()?;
    Ok("the next step is done".into())
}

fn removes_nothing(bench: &Bench) -> Judgement {
    let mut session = Run::begun(bench)?.closed()?;
    let run = session
        .solver
        .domain()
        .ok_or(Unmet::OutOfSight)?
        .directory()
        .to_path_buf();
    ends(&mut session)?;
    let there = run.join("lock").is_file();
    require(there, "the run's directory with its lock", "they are gone")?;
    // The channels are still there: what is sent waits for somebody to take it.
    session.send(&Message::order(&Order::Close))?;
    Ok("the run's directory, lock and channels are there".into())
}

fn noted(bench: &Bench) -> Judgement {
    let run = Run::begun(bench)?;
    let domain = run.session.solver.domain().ok_or(Unmet::OutOfSight)?;
    let kit = std::process::id().to_string();
    let names = taking_part(domain.directory()).into_iter();
    let held: Vec<String> = names
        .filter_map(|name| {
            let (pid, _) = name.to_str()?.strip_prefix("joined-")?.split_once('.')?;
            // The kit takes part as the peer.
            (pid != kit && pid.parse::<u32>().is_ok()).then(|| pid.to_owned())
        })
        .collect();
    let expected = "a locked file `joined-PID.X` in the run's directory";
    require(!held.is_empty(), expected, "none but the kit's own")?;
    run.closed()?;
    Ok(format!("locked by process {}", held.join(", ")))
}
