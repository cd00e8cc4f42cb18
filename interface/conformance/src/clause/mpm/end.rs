//! Sections 2, 9 and 11: drain, close, and every other end.

use std::time::Duration;

use interface::control::Order;
use interface::stage::Kind;

use rustix::process::{Pid, Signal, kill_process};

use super::ledger::{frame, stressed};
use super::scene::{DT, IN_BLOCK, block, scene, single};
use crate::bench::{Bench, Flow, Session, configure};
use crate::clause::{Clause, machine};
use crate::verdict::{Judgement, Largest, Unmet, broken, require};

pub const CLAUSES: &[Clause] = &[
    Clause::must(
        "D-1a",
        "all points at the end, in order of their ids",
        points,
    )
    .after(&["T-1a"]),
    Clause::must(
        "D-1b",
        "the final points are numbered and of the next step",
        header,
    ),
    Clause::must(
        "R-5a",
        "with FRAME all points, as they are before the window, before the report",
        frame,
    )
    .after(&[
        "I-2a", "I-2b", "I-9a", "T-6b", "T-1a", "R-3b", "D-1a", "D-1b",
    ]),
    Clause::must("R-5b", "stress and volume of a point are right", stressed).after(&["R-5a"]),
    Clause::must("D-2a", "lives on after Bye until Close", lives).of_processes(),
    Clause::must("X-2a", "ends with status 0 after Close", closed).of_processes(),
    Clause::must("X-2b", "ends with status 3 after a failure", failed)
        .after(&["S-3a"])
        .of_processes(),
    Clause::must("S-9a", "ends on Abort while it waits for forces", aborted).covers(&["C29"]),
    Clause::must("S-9b", "says nothing after Abort", silent).after(&["S-9a"]),
    Clause::must(
        "S-11a",
        "gives up silent bodies at the deadline, by name",
        silence,
    )
    .covers(&["C29"]),
    Clause::must(
        "S-11b",
        "gives up a silent coupler at the deadline, by name",
        silent_coupler,
    )
    .covers(&["C29"])
    .after(&["S-11a"]),
    Clause::must("X-3a", "ends when its coupler is gone", orphan).covers(&["C29"]),
    Clause::must("X-5a", "does not end on Ctrl-C by itself", interrupt)
        .of_processes()
        .covers(&["C30"]),
];

/// Longest time that an end may take: a nap, and an ordinary end of a process on a busy machine.
const SOON: Duration = Duration::from_secs(2);

fn points(bench: &Bench) -> Judgement {
    let velocity = [0.6, -0.3];
    let config = scene(vec![
        block([0.2, 0.6], velocity),
        block([0.6, 0.2], velocity),
    ]);
    let mut flow = bench.flow(&config)?;
    let (first, _) = flow.free_step(DT)?;
    flow.coast(DT, 20)?;
    let t = 21.0 * DT;
    flow.free_step(0.0)?;
    let (_, points) = flow.drain()?;
    require(
        points.len() as u64 == 2 * IN_BLOCK,
        "128 points",
        points.len(),
    )?;
    let mut largest = Largest::default();
    for ((point, info), state) in points.iter().zip(&flow.set).zip(&first.states) {
        require(
            point.id == info.id,
            format_args!("point {}", info.id),
            point.id,
        )?;
        for i in 0..2 {
            let x = state.position[i] + t * velocity[i];
            largest.near("position", point.position[i], x, 1e-12, 1.0)?;
            largest.near("velocity", point.velocity[i], velocity[i], 1e-12, 1.0)?;
        }
    }
    Ok(format!("128 points within {largest} m or m/s"))
}

fn header(bench: &Bench) -> Judgement {
    let mut flow = bench.flow(&scene(vec![block([0.4; 2], [0.0; 2])]))?;
    flow.coast(DT, 3)?;
    let (header, _) = flow.drain()?;
    let said = (header.step, header.count);
    require(
        said == (3, IN_BLOCK),
        format_args!("{IN_BLOCK} points of step 3"),
        format_args!("{} of step {}", said.1, said.0),
    )?;
    Ok("64 points of step 3".into())
}

fn lives(bench: &Bench) -> Judgement {
    let mut flow = bench.flow(&single([0.0; 2]))?;
    flow.free_step(0.0)?;
    flow.drain()?;
    let end = flow.session.end(Duration::from_millis(150));
    require(
        end.is_none(),
        "a process that lives",
        format_args!("{end:?}"),
    )?;
    Ok("150 ms".into())
}

fn ends_with(end: Option<String>, status: u8) -> Judgement {
    let expected = format!("ended with exit status {status}");
    let end = end.unwrap_or_else(|| "still lives 2 s later".into());
    require(end == expected, &expected, &end)?;
    Ok(end)
}

fn closed(bench: &Bench) -> Judgement {
    let mut flow = bench.flow(&single([0.0; 2]))?;
    flow.free_step(0.0)?;
    flow.drain()?;
    flow.session.order(&Order::Close)?;
    ends_with(flow.session.end(SOON), 0)
}

fn failed(bench: &Bench) -> Judgement {
    let mut flow = bench.flow(&single([0.0; 2]))?;
    flow.session.order(&Order::Close)?;
    flow.session.failure()?;
    ends_with(flow.session.end(SOON), 3)
}

/// A run that is told to abort while the continuum waits for forces; whether it ended.
fn abort(bench: &Bench) -> Result<(Flow<'_>, Option<String>), Unmet> {
    let mut flow = bench.flow(&single([0.0; 2]))?;
    flow.grant(DT, 4, false)?;
    flow.states()?;
    flow.session
        .order(&Order::Abort("the kit has seen enough".into()))?;
    let end = flow.session.end(SOON);
    Ok((flow, end))
}

fn aborted(bench: &Bench) -> Judgement {
    match abort(bench)?.1 {
        Some(end) => Ok(end),
        None => Err(broken("an end", "still lives 2 s later")),
    }
}

fn silent(bench: &Bench) -> Judgement {
    let (mut flow, _) = abort(bench)?;
    let notice = flow.session.take(Kind::Notice)?;
    require(notice.is_none(), "nothing", format_args!("{notice:?}"))?;
    let report = flow.session.take(Kind::Report)?;
    require(report.is_none(), "nothing", format_args!("{report:?}"))?;
    Ok("nothing".into())
}

/// Of the clauses on silence, in s.
const DEADLINE: f64 = 0.3;

/// A run with [`DEADLINE`].
fn impatient(bench: &Bench) -> Result<Flow<'_>, Unmet> {
    let mut order = configure(&single([0.0; 2]));
    order.deadline = DEADLINE;
    bench.flow_by(&order)
}

fn silent_coupler(bench: &Bench) -> Judgement {
    let mut flow = impatient(bench)?;
    flow.free_step(0.0)?;
    machine::silent_coupler(&mut flow.session, DEADLINE)
}

fn silence(bench: &Bench) -> Judgement {
    let mut flow = impatient(bench)?;
    flow.grant(DT, 4, false)?;
    flow.states()?;
    let failure = flow.session.failure()?;
    require(
        failure.message.contains("dem"),
        "the silent party by its name",
        &failure.message,
    )?;
    Ok(failure.message)
}

fn orphan(bench: &Bench) -> Judgement {
    let mut flow = bench.flow(&single([0.0; 2]))?;
    flow.grant(DT, 4, false)?;
    flow.states()?;
    flow.session.stage.release();
    match flow.session.end(SOON) {
        Some(end) => Ok(end),
        None => Err(broken("an end", "still lives 2 s later")),
    }
}

fn interrupt_process(session: &Session) -> Result<(), Unmet> {
    let pid = session.pid().and_then(|pid| i32::try_from(pid).ok());
    let pid = pid.and_then(Pid::from_raw);
    let pid = pid.ok_or(Unmet::OutOfSight("it can be seen of a process only"))?;
    kill_process(pid, Signal::INT).map_err(|e| broken("a process to signal", e))
}

fn interrupt(bench: &Bench) -> Judgement {
    let mut flow = bench.flow(&single([0.0; 2]))?;
    flow.free_step(DT)?;
    interrupt_process(&flow.session)?;
    std::thread::sleep(Duration::from_millis(20));
    flow.coast(DT, 3)?;
    Ok("3 steps after SIGINT".into())
}
