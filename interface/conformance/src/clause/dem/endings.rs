//! Sections 1, 2, 9 and 11: how a session ends, in order or not.

use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use interface::control::{Notice, Order};
use interface::stage::{Kind, Message};
use rustix::process::{Pid, Signal, kill_process};

use super::scene::one_disc;
use crate::bench::{Bench, Play, Session, Start, configure};
use crate::clause::{Clause, machine};
use crate::verdict::{Judgement, Unmet, broken, require};

pub const CLAUSES: &[Clause] = &[
    Clause::must("S-9a", "ends at Abort, without a word", abort),
    Clause::must(
        "S-9b",
        "ends at Abort while it waits for the states of a step",
        abort_in_step,
    )
    .after(&["S-9a"]),
    Clause::must("X-3a", "ends when the coupler is gone", orphan).covers(&["C29"]),
    Clause::must(
        "X-3b",
        "ends when the coupler is gone, waiting for the states of a step",
        orphan_in_step,
    )
    .covers(&["C29"])
    .after(&["X-3a"]),
    Clause::must(
        "S-11a",
        "names the peer that is silent, at the deadline",
        silent_peer,
    )
    .covers(&["C29"]),
    Clause::must(
        "S-11b",
        "names the coupler when it is silent, at the deadline",
        silent_coupler,
    )
    .covers(&["C29"])
    .after(&["S-11a"]),
    Clause::must("D-2a", "lives until Close", lives_till_close),
    Clause::must("X-1a", "a failure names clause and step", named).covers(&["C36"]),
    Clause::must("X-2a", "ends with status 0 after Close", closed).of_processes(),
    Clause::must("X-2b", "ends with status 3 after a failure", failed).of_processes(),
    Clause::must(
        "X-2c",
        "ends with status 2 if it was not told to join",
        unjoined,
    )
    .of_processes(),
    Clause::must("X-5a", "goes on after Ctrl-C", interrupted)
        .of_processes()
        .covers(&["C30"]),
    Clause::must("O-6a", "removes nothing of the run's", removes_nothing).of_processes(),
];

/// A nap of 10 ms, and much for a machine that is busy.
const SOON: Duration = Duration::from_secs(1);

/// The session after a measured opening step.
fn begun(bench: &Bench) -> Result<Play<'_>, Unmet> {
    let mut play = bench.play(&one_disc())?;
    play.step(0.0, &[])?;
    Ok(play)
}

/// Waits for the end of a solver that may say nothing before it.
fn ends_silently(mut session: Session) -> Judgement {
    let start = Instant::now();
    let end = session.end(SOON);
    let end = end.ok_or_else(|| broken("its end", format_args!("it lives {SOON:?} later")))?;
    if let Some(notice) = session.take(Kind::Notice)? {
        return Err(broken(
            "no notice",
            format_args!("{:?}", notice.as_notice()),
        ));
    }
    Ok(format!(
        "{end}, {:.0} ms later",
        start.elapsed().as_secs_f64() * 1e3
    ))
}

fn abort(bench: &Bench) -> Judgement {
    let mut play = begun(bench)?;
    play.abort()?;
    ends_silently(play.session)
}

fn abort_in_step(bench: &Bench) -> Judgement {
    let mut play = begun(bench)?;
    play.grant(1e-4, 1, false)?;
    std::thread::sleep(Duration::from_millis(20));
    play.abort()?;
    ends_silently(play.session)
}

fn orphan(bench: &Bench) -> Judgement {
    let play = begun(bench)?;
    play.session.stage.release();
    ends_silently(play.session)
}

fn orphan_in_step(bench: &Bench) -> Judgement {
    let mut play = begun(bench)?;
    play.grant(1e-4, 1, false)?;
    std::thread::sleep(Duration::from_millis(20));
    play.session.stage.release();
    ends_silently(play.session)
}

/// Of the clauses on silence, in s.
const DEADLINE: f64 = 0.2;

/// A run with [`DEADLINE`].
fn impatient(bench: &Bench) -> Result<Play<'_>, Unmet> {
    let mut session = bench.session()?;
    session.hello()?;
    let mut order = configure(&one_disc());
    order.deadline = DEADLINE;
    session.ready(&order)?;
    Ok(Play::new(session, 1))
}

fn silent_coupler(bench: &Bench) -> Judgement {
    let mut play = impatient(bench)?;
    play.step(0.0, &[])?;
    machine::silent_coupler(&mut play.session, DEADLINE)
}

fn silent_peer(bench: &Bench) -> Judgement {
    let mut play = impatient(bench)?;
    play.grant(0.0, 1, true)?;
    let start = Instant::now();
    let failure = play.session.failure()?;
    let waited = start.elapsed().as_secs_f64();
    let in_time = waited > 0.8 * DEADLINE && waited < DEADLINE + SOON.as_secs_f64();
    require(
        in_time,
        format_args!("Failed after {DEADLINE} s"),
        format_args!("after {waited:.2} s"),
    )?;
    require(
        failure.message.contains("mpm"),
        "a message that names the mpm",
        &failure.message,
    )?;
    Ok(format!("after {waited:.2} s: {}", failure.message))
}

fn lives_till_close(bench: &Bench) -> Judgement {
    let mut play = begun(bench)?;
    play.session.order(&Order::Drain)?;
    match play.session.notice()? {
        Notice::Bye => {}
        other => return Err(broken("Bye", format_args!("{other:?}"))),
    }
    if let Some(end) = play.session.end(Duration::from_millis(100)) {
        return Err(broken("a solver that waits for Close", end));
    }
    play.session.order(&Order::Close)?;
    let end = play.session.end(SOON);
    end.ok_or_else(|| {
        broken(
            "its end after Close",
            format_args!("it lives {SOON:?} later"),
        )
    })
}

fn named(bench: &Bench) -> Judgement {
    let mut play = begun(bench)?;
    let mut grant = play.next_grant(f64::NAN, 1, false);
    grant.steps = 1;
    play.send_grant(&grant)?;
    let failure = play.session.failure()?;
    let said = failure.message.contains("G-2") && failure.step == 1;
    require(
        said,
        "clause G-2 and step 1",
        format_args!("step {}: {}", failure.step, failure.message),
    )?;
    Ok(failure.message)
}

/// Waits for the end of a process, which shall have this status.
fn status(mut session: Session, expected: i32) -> Judgement {
    let end = session.end(Duration::from_secs(2));
    let end = end.unwrap_or_else(|| "lives 2 s later".into());
    let expected = format!("ended with exit status {expected}");
    require(end == expected, expected, &end)?;
    Ok(end)
}

fn closed(bench: &Bench) -> Judgement {
    status(begun(bench)?.close()?, 0)
}

fn failed(bench: &Bench) -> Judgement {
    let mut session = bench.session()?;
    session.hello()?;
    session.order(&Order::Drain)?;
    session.failure()?;
    session.order(&Order::Abort("the solver failed".into()))?;
    status(session, 3)
}

fn unjoined(bench: &Bench) -> Judgement {
    let Start::Command(command) = &bench.subject.start else {
        return Err(Unmet::OutOfSight("it can be seen of a process only"));
    };
    let mut child = Command::new(&command[0])
        .args(&command[1..])
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .map_err(|e| broken("a solver that starts", e))?;
    let start = Instant::now();
    loop {
        match child.try_wait() {
            Ok(Some(status)) => {
                let got = interface::process::describe(status);
                require(status.code() == Some(2), "ended with exit status 2", &got)?;
                return Ok(got);
            }
            _ if start.elapsed() > bench.startup => {
                let _ = child.kill();
                let _ = child.wait();
                let got = format_args!("it lives {:?} later", bench.startup);
                return Err(broken("its end", got));
            }
            _ => std::thread::sleep(Duration::from_millis(1)),
        }
    }
}

fn interrupted(bench: &Bench) -> Judgement {
    let mut play = begun(bench)?;
    let pid = play.session.pid().and_then(|pid| i32::try_from(pid).ok());
    let pid = pid.and_then(Pid::from_raw).expect("a process has an id");
    kill_process(pid, Signal::INT).map_err(|e| broken("a process that takes a signal", e))?;
    std::thread::sleep(Duration::from_millis(20));
    play.step(1e-4, &[])?;
    play.close()?;
    Ok("the next step is done".into())
}

fn removes_nothing(bench: &Bench) -> Judgement {
    let mut play = begun(bench)?;
    let run = std::env::temp_dir().join(format!("tandem-{}", play.session.stage.domain().id()));
    play.session.close()?;
    let end = play.session.end(Duration::from_secs(2));
    end.ok_or_else(|| broken("its end after Close", "it lives 2 s later"))?;
    let lock = run.join("lock");
    require(
        lock.is_file(),
        "the run's directory with its lock",
        "they are gone",
    )?;
    // The channels are still there: what is sent waits for somebody to take it.
    play.session.send(&Message::order(&Order::Close))?;
    Ok("the run's directory, lock and channels are there".into())
}
