//! What a run takes of the machine: memory over many steps, time until an answer.

#![allow(clippy::disallowed_methods, reason = "/proc")]

use std::time::{Duration, Instant};

use interface::message::control::Party;
use interface::message::wire::{ImpForce, ImpInfo, ImpState};
use interface::transport::raw::Kind;
use interface::transport::wait::nap;

use crate::bench::{Bench, BodiesRun, ContinuumRun, Points};
use crate::clause::dem::scene::{RADIUS, SPHERO, held_disc};
use crate::clause::mpm::scene::{IN_BLOCK, block, scene, single};
use crate::clause::{Clause, clauses};
use crate::mutant::Flaw;
use crate::verdict::{Judgement, Unmet, broken, require};

pub const CLAUSES: &[Clause] = clauses! {
    Must "X-6b" "its memory grows by at most four times the data that it receives" by bounded, of_processes: true;
        - "leaks 200 kB a step": {
            let mut kept = Vec::new();
            // Written to, because untouched memory is not allocated.
            Flaw::states(move |_, _| kept.push(vec![1u8; 200_000]))
        };
    Should "X-6a" "its memory does not grow with the number of steps" by flat, after: &["X-6b"], of_processes: true;
        - "keeps all messages": { let mut kept = Vec::new(); Flaw::each(move |message| kept.push(message.clone())) };
    Should "G-10a" "answers at once, without a sleep" by latency, alone: true;
        - "sleeps before it answers many points": Flaw::each(|message| {
            let exchanged = matches!(message.kind(), Kind::States | Kind::Forces);
            if exchanged && message.payload.len() >= POINTS {
                nap(Duration::from_millis(60));
            }
        });
};

/// That a solver takes no rare naps, which rests on clauses that each side has by itself.
pub const fn naps(after: &'static [&'static str]) -> Clause {
    Clause { after, ..NAPS[0] }
}

const NAPS: &[Clause] = clauses! {
    Should "G-10b" "does not sleep in any of a thousand steps" by rare_naps, alone: true;
        - "sleeps for 5 ms in every thousandth step": {
            let mut steps = 0;
            Flaw::states(move |header, _| {
                steps += u64::from(header.flags == 0);
                if steps.is_multiple_of(1000) && steps > 0 {
                    nap(Duration::from_millis(5));
                }
            })
        };
};

/// Points of a bodies' exchange, and steps of a window.
const POINTS: usize = 100;
const WINDOW: u64 = 16;
const DT: f64 = 1e-5;

/// A ring of points whose ids begin at `first` and that press on a disc.
fn ring(count: usize, first: u64) -> Points {
    let mut points = Points::new();
    for k in 0..count {
        let (sin, cos) = (core::f64::consts::TAU * k as f64 / count as f64).sin_cos();
        let r = SPHERO + 0.9 * RADIUS;
        points = points.with([r * cos, r * sin], [0.0; 2], RADIUS, 0.5);
    }
    points.set.iter_mut().for_each(|info| info.id += first);
    points
}

/// A held disc pressed by a ring of points, after a step.
fn pressed(bench: &Bench, count: usize) -> Result<(BodiesRun<'_>, Points), Unmet> {
    let mut play = bench.run_bodies(&held_disc())?;
    let points = ring(count, 0);
    play.set(&points.set);
    play.step(0.0, &points.states)?;
    Ok((play, points))
}

/// A continuum at rest, after a step: two blocks, or one point.
fn resting(bench: &Bench, many: bool) -> Result<ContinuumRun<'_>, Unmet> {
    let blocks = vec![block([0.2, 0.6], [0.0; 2]), block([0.6, 0.2], [0.0; 2])];
    let config = if many {
        scene(blocks)
    } else {
        single([0.0; 2])
    };
    let mut flow = bench.run_continuum(&config)?;
    flow.free_step(0.0)?;
    Ok(flow)
}

/// Resident memory of a process in bytes.
fn resident(pid: u32) -> Result<u64, Unmet> {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status"));
    let status = status.map_err(|e| broken("a process that lives", e))?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let kibibytes = line.and_then(|rest| rest.split_whitespace().next()?.parse::<u64>().ok());
    kibibytes.map(|k| k << 10).ok_or(Unmet::OutOfSight(
        "this system does not tell a process's memory",
    ))
}

/// Windows of steps, at least and at most: before the memory is looked at, so that lists and history have been filled
/// and emptied many times, and after, over which it shall not grow.
struct Windows {
    warm: [u32; 2],
    counted: [u32; 2],
}

/// Time after which the least will do.
const LONG: Duration = Duration::from_millis(800);
/// What an allocator may take by itself, in bytes: of a solver that leaks little, and of any.
const ROOM: u64 = 256 << 10;
const MUCH_ROOM: u64 = 4 << 20;

/// Does windows of steps; returns how many bytes have crossed in them.
fn several(
    [least, most]: [u32; 2],
    window: &mut dyn FnMut() -> Result<u64, Unmet>,
) -> Result<u64, Unmet> {
    let (start, mut crossed) = (Instant::now(), 0);
    for done in 0..most {
        if done >= least && start.elapsed() > LONG {
            break;
        }
        crossed += window()?;
    }
    Ok(crossed)
}

/// Bytes by which the solver has grown in `windows`, and bytes that have crossed.
fn grown(bench: &Bench, windows: &Windows) -> Result<(u64, u64), Unmet> {
    let watch = |pid: Option<u32>, window: &mut dyn FnMut() -> Result<u64, Unmet>| {
        let pid = pid.ok_or(Unmet::OutOfSight("it can be seen of a process only"))?;
        several(windows.warm, window)?;
        let before = resident(pid)?;
        let crossed = several(windows.counted, window)?;
        Ok((resident(pid)?.saturating_sub(before), crossed))
    };
    let exchanged = (size_of::<ImpState>() + size_of::<ImpForce>()) as u64;
    if bench.subject.party == Party::Mpm {
        let mut flow = resting(bench, true)?;
        return watch(flow.session.pid(), &mut || {
            flow.coast(DT, WINDOW)?;
            Ok(WINDOW * 2 * IN_BLOCK * exchanged)
        });
    }
    let (mut play, _) = pressed(bench, POINTS)?;
    let crossing = POINTS as u64 * (WINDOW * exchanged + size_of::<ImpInfo>() as u64);
    let mut first = 0;
    watch(play.session.pid(), &mut || {
        // Other points each time, so the solver can drop the state of the earlier ones.
        first += POINTS as u64;
        let points = ring(POINTS, first);
        play.set(&points.set);
        play.grant(DT, WINDOW, false)?;
        for _ in 0..WINDOW {
            play.exchange(&points.states)?;
        }
        play.report()?;
        Ok(crossing)
    })
}

/// The growth in words.
fn in_words((grown, crossed): (u64, u64)) -> String {
    format!(
        "{} KiB more after {} KiB crossed",
        grown >> 10,
        crossed >> 10
    )
}

fn flat(bench: &Bench) -> Judgement {
    let windows = Windows {
        warm: [10, 60],
        counted: [20, 250],
    };
    let seen = grown(bench, &windows)?;
    // A tenth of the data is ten times less than the memory of a solver that keeps all messages.
    let kept = seen.0 <= (seen.1 / 10).max(ROOM);
    require(
        kept,
        "at most a tenth of what crosses, or 256 KiB",
        in_words(seen),
    )?;
    Ok(in_words(seen))
}

fn bounded(bench: &Bench) -> Judgement {
    let windows = Windows {
        warm: [4; 2],
        counted: [20; 2],
    };
    let seen = grown(bench, &windows)?;
    // More than a solver needs that stores each message in its own format.
    let kept = seen.0 <= 4 * seen.1 + MUCH_ROOM;
    require(
        kept,
        "at most four times what crosses, and 4 MiB",
        in_words(seen),
    )?;
    Ok(in_words(seen))
}

/// Times of `count` answers, one after another: of bodies pressed by many points or two, of a continuum of many or one.
/// Fewer when it takes long; how long the solver takes to start does not count.
fn answers(bench: &Bench, many: bool, count: u64, long: Duration) -> Result<Vec<Duration>, Unmet> {
    if bench.subject.party == Party::Mpm {
        let mut flow = resting(bench, many)?;
        let forces = flow.no_forces();
        flow.grant(DT, count + 1, false)?;
        flow.states()?;
        return timed(count, long, || {
            flow.forces(&forces)?;
            flow.states().map(|_| ())
        });
    }
    let (mut play, points) = pressed(bench, if many { POINTS } else { 2 })?;
    play.grant(DT, count, false)?;
    timed(count, long, || play.exchange(&points.states).map(|_| ()))
}

/// Times that `count` calls of `answer` take, one at least; fewer when they take longer than `long` together.
fn timed(
    count: u64,
    long: Duration,
    mut answer: impl FnMut() -> Result<(), Unmet>,
) -> Result<Vec<Duration>, Unmet> {
    let start = Instant::now();
    let mut times = Vec::new();
    while (times.len() as u64) < count && (times.is_empty() || start.elapsed() < long) {
        let sent = Instant::now();
        answer()?;
        times.push(sent.elapsed());
    }
    Ok(times)
}

/// Five naps of B-3: no solver computes for so long on so few points, and a machine that is busy delays some answers,
/// not all.
const SLOW: Duration = Duration::from_millis(50);

fn micros(time: Duration) -> f64 {
    time.as_secs_f64() * 1e6
}

fn latency(bench: &Bench) -> Judgement {
    let mut times = answers(bench, true, 20, LONG)?;
    times.sort();
    let (least, median) = (times[0], times[times.len() / 2]);
    require(
        least < SLOW,
        format_args!("one of {} answers within {SLOW:?}", times.len()),
        format_args!("{:.0} us at best", micros(least)),
    )?;
    let (least, median) = (micros(least), micros(median));
    Ok(format!("{least:.0} us at best, median {median:.0} us"))
}

/// Most runs of the same steps: a machine that is busy delays other steps in each of them, a nap the same.
const RUNS: usize = 12;
/// Steps of such a run.
const STEPS: u64 = 1200;
/// Longest time for them. A busy machine must not cut them off before the thousandth, in which a solver may take its nap.
const RUN: Duration = Duration::from_secs(4);
/// Less than a nap, much more than an answer on a handful of points.
const NAP: Duration = Duration::from_millis(3);

fn rare_naps(bench: &Bench) -> Judgement {
    let mut least = vec![Duration::MAX; STEPS as usize];
    let mut reached = 0;
    let mut naps = broken("answers", "none");
    for _ in 0..RUNS {
        let times = answers(bench, false, STEPS, RUN)?;
        reached = reached.max(times.len());
        for (least, time) in least.iter_mut().zip(times) {
            *least = time.min(*least);
        }
        let mut sorted: Vec<_> = least[..reached].iter().zip(0..).collect();
        sorted.sort();
        let (&slowest, step) = sorted[sorted.len() - 1];
        let allowed = NAP.max(10 * *sorted[sorted.len() / 2].0);
        let worst = micros(slowest);
        if slowest < allowed {
            return Ok(format!("{reached} steps, the slowest {worst:.0} us"));
        }
        let expected = format_args!("every answer within {allowed:?} in one of {RUNS} runs");
        naps = broken(expected, format_args!("{worst:.0} us at best")).at(step);
    }
    Err(naps)
}
