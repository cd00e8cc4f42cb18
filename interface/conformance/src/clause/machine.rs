//! What a run takes of the machine, asked of both sides in the same way: memory over many steps, time until an answer.

use std::time::{Duration, Instant};

use crate::bench::{Bench, Session, echo};
use crate::verdict::{Judgement, Unmet, broken, require};

/// Windows of steps, at least and at most: before the memory is looked at, so that lists and history have been filled
/// and emptied many times, and after, over which it shall not grow.
const WARM: [u32; 2] = [10, 60];
const WINDOWS: [u32; 2] = [20, 250];
/// Time after which the least will do.
const LONG: Duration = Duration::from_millis(800);
/// What an allocator may take by itself, in bytes.
const ROOM: u64 = 256 << 10;

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

/// Does windows of steps; returns how many bytes have crossed in them.
fn several(
    [least, most]: [u32; 2],
    window: &mut impl FnMut() -> Result<u64, Unmet>,
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

/// a tenth of the bytes that cross is ten times less than a solver takes that keeps what it is told. `window` does
/// one window of steps and returns how many bytes crossed in it.
pub fn memory(pid: Option<u32>, mut window: impl FnMut() -> Result<u64, Unmet>) -> Judgement {
    let pid = pid.ok_or(Unmet::OutOfSight("it can be seen of a process only"))?;
    several(WARM, &mut window)?;
    let before = resident(pid)?;
    let crossed = several(WINDOWS, &mut window)?;
    let grown = resident(pid)?.saturating_sub(before);
    let words = format!(
        "{} KiB more after {} KiB crossed",
        grown >> 10,
        crossed >> 10
    );
    let kept = grown <= (crossed / 10).max(ROOM);
    require(kept, "at most a tenth of what crosses, or 256 KiB", &words)?;
    Ok(words)
}

/// Steps in which the time of an answer is measured.
pub const ANSWERS: u64 = 20;
/// Five naps of B-3: no solver computes for so long on so few points, and a machine that is busy delays some answers,
/// not all.
const SLOW: Duration = Duration::from_millis(50);

/// G-10, from the times of [`ANSWERS`] answers in exchanges of so many points.
pub fn latency(bench: &Bench, mut times: Vec<Duration>, points: usize) -> Judgement {
    times.sort();
    let (least, median) = (times[0], times[times.len() / 2]);
    let micros = |time: Duration| time.as_secs_f64() * 1e6;
    require(
        least < SLOW,
        format_args!("one of {} answers within {SLOW:?}", times.len()),
        format_args!("{:.0} us at best", micros(least)),
    )?;
    let echo = echo(bench.subject.medium(), points)?;
    Ok(format!(
        "{:.0} us at best, median {:.0} us; an echo takes {:.0} us at best",
        micros(least),
        micros(median),
        micros(echo)
    ))
}

/// S-11: what a solver says when the coupler, after a report, says nothing more, `deadline` (s) being configured.
pub fn silent_coupler(session: &mut Session, deadline: f64) -> Judgement {
    let (start, longest) = (Instant::now(), Duration::from_secs_f64(deadline + 2.0));
    let failure = session.failure_within(longest + Duration::from_secs(1))?;
    let waited = start.elapsed().as_secs_f64();
    require(
        waited > deadline && failure.message.contains("coupler"),
        format_args!("a failure after {deadline} s that names the coupler"),
        format_args!("after {waited:.2} s: {}", failure.message),
    )?;
    Ok(format!("after {waited:.2} s: {}", failure.message))
}
