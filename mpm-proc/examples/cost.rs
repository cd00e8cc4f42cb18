//! CPU time per point and step, as the smallest of many short runs: the figures of `docs/performance.md`.
//!
//! `cargo run --release -p mpm-proc --example cost -- [points] [threads] [model] [stress_update] [shape]`, each of the
//! last two as in a scene: shapes without an affine part are stepped with FLIP.

use std::time::{Duration, Instant};

use interface::config::{MpmConfig, ShapeFunction, Transfer};
use interface::solver::MpmSolver;
use interface::step::Step;
use mpm_proc::Mpm;
use rustix::time::{ClockId, clock_gettime};

#[path = "../tests/column.rs"]
mod column;
use column::{ELASTIC, HYPOELASTIC, SAND, column};

fn main() {
    let mut arguments = std::env::args().skip(1);
    let mut number = |default| {
        let given = arguments.next();
        given.map_or(default, |a| a.parse().expect("a number"))
    };
    let (points, threads) = (number(40_000), number(1));
    let only = arguments.next();
    let update = arguments.next().map(|name| named(&name));
    let shape = arguments.next().map(|name| named(&name));
    for (name, model) in [
        ("elastic", ELASTIC),
        ("hypoelastic", HYPOELASTIC),
        ("drucker-prager", SAND),
    ] {
        if only.as_ref().is_some_and(|only| only != name) {
            continue;
        }
        let (cpu, wall, bytes) = cost(&{
            let mut config = column(points, threads, model);
            config.stress_update = update.unwrap_or(config.stress_update);
            config.shape = shape.unwrap_or(config.shape);
            if matches!(config.shape, ShapeFunction::Linear | ShapeFunction::Ugimp) {
                config.transfer = Transfer::Flip;
            }
            config
        });
        println!(
            "{name}: {points} points, {threads} threads: {cpu:.1} ns CPU, {wall:.1} ns wall per point and step; {bytes:.0} bytes a point"
        );
    }
}

/// CPU and wall ns per point and step, and bytes per point.
fn cost(config: &MpmConfig) -> (f64, f64, f64) {
    let mut mpm = Mpm::new();
    let ready = mpm.configure(config).expect("a good configuration");
    // 0.3 of the Courant time keeps all sizes alike and stable.
    let dt = 0.3 * ready.courant_time;
    let per_sample = (400_000 / ready.items as usize).max(1);
    let mut step = Step {
        index: 0,
        time: 0.0,
        dt_before: dt,
        dt,
        measure: false,
    };
    let mut best = [f64::INFINITY; 2];
    let begin = Instant::now();
    let mut samples = 0;
    while samples < 10 || begin.elapsed() < Duration::from_secs(4) {
        let (cpu, wall) = (cpu_seconds(), Instant::now());
        for _ in 0..per_sample {
            mpm.step(&step, &[]).expect("a sound step");
            step.index += 1;
            step.time += dt;
        }
        let scale = 1e9 / (per_sample as f64 * ready.items as f64);
        best[0] = best[0].min((cpu_seconds() - cpu) * scale);
        best[1] = best[1].min(wall.elapsed().as_secs_f64() * scale);
        samples += 1;
    }
    (best[0], best[1], mpm.bytes() as f64 / ready.items as f64)
}

/// What a scene calls by this name.
fn named<T: serde::de::DeserializeOwned>(name: &str) -> T {
    serde_json::from_value(name.into()).expect("a name as in a scene")
}

fn cpu_seconds() -> f64 {
    let t = clock_gettime(ClockId::ProcessCPUTime);
    t.tv_sec as f64 + 1e-9 * t.tv_nsec as f64
}
