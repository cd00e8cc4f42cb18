//! What a bodies' side takes of the machine.

use std::time::Instant;

use interface::config::{BodyShape, Motion};
use interface::wire::{ImpForce, ImpInfo, ImpState};

use super::scene::{RADIUS, SPHERO, STIFFNESS, body, frictional, scene};
use crate::bench::{Bench, Play, Points};
use crate::clause::{Clause, machine};
use crate::verdict::{Judgement, Unmet};

pub const CLAUSES: &[Clause] = &[
    Clause::should(
        "X-6a",
        "its memory does not grow with the number of steps",
        memory,
    )
    .of_processes()
    .covers(&["C34"]),
    Clause::should("G-10a", "answers at once, not after a nap", latency).covers(&["C35"]),
];

/// Points of an exchange, and steps of a window.
const POINTS: usize = 100;
const WINDOW: u64 = 16;
const DT: f64 = 1e-5;

/// A fixed disc, pressed by a ring of points whose ids begin at `first`.
fn ring(first: u64) -> Points {
    let mut points = Points::new();
    for k in 0..POINTS {
        let (sin, cos) = (core::f64::consts::TAU * k as f64 / POINTS as f64).sin_cos();
        let r = SPHERO + 0.9 * RADIUS;
        points = points.with([r * cos, r * sin], [0.0; 2], RADIUS, 0.5);
    }
    points.set.iter_mut().for_each(|info| info.id += first);
    points
}

fn begun(bench: &Bench) -> Result<Play<'_>, Unmet> {
    let disc = body(BodyShape::Disc, [0.0; 2], Motion::Fixed);
    let mut play = bench.play(&scene(vec![disc], frictional(0.5 * STIFFNESS, 0.3)))?;
    let points = ring(0);
    play.set(&points.set);
    play.step(0.0, &points.states)?;
    Ok(play)
}

fn memory(bench: &Bench) -> Judgement {
    let mut play = begun(bench)?;
    let crossing = WINDOW as usize * (size_of::<ImpState>() + size_of::<ImpForce>());
    let crossing = (POINTS * (crossing + size_of::<ImpInfo>())) as u64;
    let mut first = 0;
    machine::memory(play.session.pid(), || {
        // Others each time: what is remembered of those before can go.
        first += POINTS as u64;
        let points = ring(first);
        play.set(&points.set);
        play.grant(DT, WINDOW, false)?;
        for _ in 0..WINDOW {
            play.exchange(&points.states)?;
        }
        play.report()?;
        Ok(crossing)
    })
}

fn latency(bench: &Bench) -> Judgement {
    let mut play = begun(bench)?;
    let points = ring(0);
    let mut times = Vec::new();
    play.grant(DT, machine::ANSWERS, false)?;
    for _ in 0..machine::ANSWERS {
        let sent = Instant::now();
        play.exchange(&points.states)?;
        times.push(sent.elapsed());
    }
    play.report()?;
    machine::latency(bench, times, POINTS)
}
