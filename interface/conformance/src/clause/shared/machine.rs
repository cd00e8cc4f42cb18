//! What a run takes of the machine: memory over many steps, wake-ups, time until an answer.

#![allow(clippy::disallowed_methods, reason = "/proc")]

use std::time::{Duration, Instant};

use interface::config::Motion;
use interface::message::Kind;
use interface::message::control::Party;
use interface::message::wire::{ImpForce, ImpInfo, ImpState};

use crate::bench::{Bench, Run};
use crate::clause::dem::scene::{RADIUS, SPHERO, disc, points};
use crate::clause::mpm::scene::{block, scene, single};
use crate::clause::{Clause, clauses};
use crate::verdict::{Judgement, Unmet, broken, require};

pub const CLAUSES: &[Clause] = clauses! {
    // More than a solver needs that stores each message in its own format, and what an allocator may take by itself.
    Must "X-6b" "its memory grows by at most four times the data that it receives"
        by |bench| memory(bench, [4; 2], [20; 2], |crossed| 4 * crossed + (4 << 20)), of_processes: true;
    // A tenth of the data is ten times less than the memory of a solver that keeps all messages.
    Should "X-6a" "its memory does not grow with the number of steps"
        by |bench| memory(bench, [10, 60], [20, 250], |crossed| (crossed / 10).max(256 << 10)), after: &["X-6b"], of_processes: true;
    Must "B-3a" "finds what its peer sends although nobody woke it" by unwoken;
    Should "B-2a" "wakes the receiver of what it sends" by wakes;
    Should "G-10a" "answers at once, without a sleep" by latency, alone: true;
    Should "G-10b" "does not sleep in any of a thousand steps" by rare_naps, after: &["S-7a", "B-2a", "G-10a"],
        alone: true;
};

/// Points of a bodies' exchange, and steps of a window.
const POINTS: usize = 100;
const WINDOW: u64 = 16;
const DT: f64 = 1e-5;
/// Of a state and the force that answers it.
const EXCHANGED: u64 = (size_of::<ImpState>() + size_of::<ImpForce>()) as u64;

/// A run after a step: a held disc pressed by a ring of points, many or two; or blocks at rest, or one point.
fn loaded(bench: &Bench, many: bool) -> Result<Run<'_>, Unmet> {
    let mut run = if bench.subject.party == Party::Mpm {
        let blocks = vec![block([0.2, 0.6], [0.0; 2]), block([0.6, 0.2], [0.0; 2])];
        bench.run_continuum(&if many {
            scene(blocks)
        } else {
            single([0.0; 2])
        })?
    } else {
        let count = if many { POINTS } else { 2 };
        let place = |k: usize| {
            let (sin, cos) = (core::f64::consts::TAU * k as f64 / count as f64).sin_cos();
            let r = SPHERO + 0.9 * RADIUS;
            [r * cos, r * sin]
        };
        let mut run = bench.run_bodies(&disc(Motion::Fixed))?;
        run.place(points((0..count).map(place)));
        run
    };
    run.step(0.0)?;
    Ok(run)
}

/// Resident memory of a process in bytes.
fn resident(pid: u32) -> Result<u64, Unmet> {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status"));
    let status = status.map_err(|e| broken("a process that lives", e))?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let kibibytes = line.and_then(|rest| rest.split_whitespace().next()?.parse::<u64>().ok());
    kibibytes.map(|k| k << 10).ok_or(Unmet::OutOfSight)
}

/// Time after which the least number of windows will do.
const LONG: Duration = Duration::from_millis(800);

/// The memory of a solver over windows of steps, least and most: those before it is looked at, so that lists and history
/// have been filled and emptied many times, and those after, over which it shall grow by so many bytes for those that
/// cross.
fn memory(
    bench: &Bench,
    warm: [u32; 2],
    counted: [u32; 2],
    allowed: fn(crossed: u64) -> u64,
) -> Judgement {
    let mut run = loaded(bench, true)?;
    let pid = run.session.solver.pid().ok_or(Unmet::OutOfSight)?;
    let mut window = || -> Result<u64, Unmet> {
        // Other points each time, so the solver can drop the state of the earlier ones.
        let mut points = run.points.clone();
        for info in &mut points.set {
            info.id += POINTS as u64;
        }
        run.place(points);
        run.grant(DT, WINDOW, false)?;
        for _ in 0..WINDOW {
            run.exchange()?;
        }
        run.report()?;
        let sets = run.points.set.len() * size_of::<ImpInfo>();
        Ok(run.at.set.len() as u64 * WINDOW * EXCHANGED + sets as u64)
    };
    let mut several = |[least, most]: [u32; 2]| -> Result<u64, Unmet> {
        let (start, mut crossed) = (Instant::now(), 0);
        for done in 0..most {
            if done >= least && start.elapsed() > LONG {
                break;
            }
            crossed += window()?;
        }
        Ok(crossed)
    };
    several(warm)?;
    let before = resident(pid)?;
    let crossed = several(counted)?;
    let grown = resident(pid)?.saturating_sub(before);
    let [more, most, all] = [grown, allowed(crossed), crossed].map(|bytes| bytes >> 10);
    let words = format!("{more} KiB more after {all} KiB crossed");
    require(
        grown <= allowed(crossed),
        format_args!("at most {most} KiB"),
        &words,
    )?;
    Ok(words)
}

fn unwoken(bench: &Bench) -> Judgement {
    let mut run = Run::begun(bench)?;
    run.await_peer(DT, 4)?;
    run.session.silent = true;
    let mut longest = Duration::ZERO;
    for _ in 0..4 {
        // Long enough for a solver that spins first to be asleep.
        run.session.solver.leave_alone(Duration::from_millis(2));
        let start = run.session.solver.elapsed();
        run.answered()?;
        longest = longest.max(run.session.solver.since(start));
    }
    // Two sleeps of 10 ms, and a large margin for a busy machine.
    let limit = Duration::from_millis(500);
    let expected = format_args!("an answer within {limit:?}");
    require(longest < limit, expected, format_args!("{longest:?}"))?;
    Ok(format!("after {longest:.1?} at most"))
}

fn wakes(bench: &Bench) -> Judgement {
    let mut run = Run::begun(bench)?;
    let of_bodies = run.session.is_of_bodies();
    let of_a_step = if of_bodies {
        Kind::Forces
    } else {
        Kind::States
    };
    // Earlier wake-ups are consumed.
    for kind in [of_a_step, Kind::Report] {
        run.session.solver.sleep(kind, Duration::ZERO);
    }
    run.grant(DT, 1, false)?;
    if of_bodies {
        run.send_states(&run.points.states.clone())?;
        woken(&mut run, of_a_step)?;
        run.forces()?;
    } else {
        woken(&mut run, of_a_step)?;
        run.free()?;
    }
    woken(&mut run, Kind::Report)?;
    run.report()?;
    Ok("after the message of a step and after the report".into())
}

/// The solver wakes the receiver of this kind.
fn woken(run: &mut Run, kind: Kind) -> Result<(), Unmet> {
    let woken = run.session.solver.sleep(kind, Duration::from_millis(500));
    let expected = format_args!("a wake-up with {kind:?}");
    require(woken > 0, expected, "none within 0.5 s")
}

/// Times of `count` answers, one after another; fewer, one at least, when they take longer than `long` together.
fn answers(bench: &Bench, many: bool, count: u64, long: Duration) -> Result<Vec<Duration>, Unmet> {
    let mut run = loaded(bench, many)?;
    run.await_peer(DT, count)?;
    let start = Instant::now();
    let mut times = Vec::new();
    while (times.len() as u64) < count && (times.is_empty() || start.elapsed() < long) {
        let sent = Instant::now();
        run.answered()?;
        times.push(sent.elapsed());
    }
    Ok(times)
}

/// Five naps of B-3: no solver computes for so long on so few points, and a machine that is busy delays some answers,
/// not all.
const SLOW: Duration = Duration::from_millis(50);

fn latency(bench: &Bench) -> Judgement {
    let mut times = answers(bench, true, 20, LONG)?;
    times.sort();
    let (least, median) = (times[0], times[times.len() / 2]);
    let expected = format_args!("one of {} answers within {SLOW:?}", times.len());
    require(least < SLOW, expected, format_args!("{least:.0?} at best"))?;
    Ok(format!("{least:.0?} at best, median {median:.0?}"))
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
    let mut least = Vec::<Duration>::new();
    let mut naps = broken("answers", "none");
    for _ in 0..RUNS {
        let times = answers(bench, false, STEPS, RUN)?;
        least
            .iter_mut()
            .zip(&times)
            .for_each(|(least, time)| *least = (*least).min(*time));
        least.extend(times.iter().skip(least.len()));
        let mut sorted: Vec<_> = least.iter().zip(0..).collect();
        sorted.sort();
        let (&slowest, step) = sorted[sorted.len() - 1];
        let allowed = NAP.max(10 * *sorted[sorted.len() / 2].0);
        if slowest < allowed {
            return Ok(format!("{} steps, the slowest {slowest:.0?}", least.len()));
        }
        let expected = format_args!("every answer within {allowed:?} in one of {RUNS} runs");
        naps = broken(expected, format_args!("{slowest:.0?} at best")).at(step);
    }
    Err(naps)
}
