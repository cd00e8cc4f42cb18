//! One step of a collapsing column, 4 points a cell, quadratic B-spline, APIC.
//!
//! `cargo bench -p mpm-proc`. One thread is measured in CPU time of the process, which a busy machine disturbs less;
//! two threads in wall time. The smallest of many runs is what `examples/cost.rs` prints.

use std::time::{Duration, Instant};

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use interface::solver::MpmSolver;
use interface::step::Step;
use mpm_proc::Mpm;
use rustix::time::{ClockId, clock_gettime};

mod column;
use column::{ELASTIC, HYPOELASTIC, SAND, column};

fn cpu() -> Duration {
    let t = clock_gettime(ClockId::ProcessCPUTime);
    Duration::new(
        t.tv_sec.unsigned_abs(),
        u32::try_from(t.tv_nsec).expect("below 1e9"),
    )
}

fn steps(c: &mut Criterion) {
    for (name, model) in [
        ("elastic", ELASTIC),
        ("hypoelastic", HYPOELASTIC),
        ("drucker_prager", SAND),
    ] {
        let mut group = c.benchmark_group(name);
        group.sample_size(10);
        for (points, threads) in [
            (10_000, 1),
            (40_000, 1),
            (160_000, 1),
            (160_000, 2),
            (1_000_000, 1),
        ] {
            let mut mpm = Mpm::new();
            let ready = mpm
                .configure(&column(points, threads, model))
                .expect("a good configuration");
            let dt = 0.3 * ready.courant_time;
            let mut step = Step {
                index: 0,
                time: 0.0,
                dt_before: dt,
                dt,
                measure: false,
            };
            group.throughput(Throughput::Elements(ready.items));
            let id = BenchmarkId::new(format!("{threads} threads"), points);
            group.bench_function(id, |b| {
                b.iter_custom(|count| {
                    let (begin, begin_cpu) = (Instant::now(), cpu());
                    for _ in 0..count {
                        mpm.step(&step, &[]).expect("a sound step");
                        step.index += 1;
                    }
                    if threads == 1 {
                        cpu().saturating_sub(begin_cpu)
                    } else {
                        begin.elapsed()
                    }
                });
            });
        }
        group.finish();
    }
}

criterion_group!(benches, steps);
criterion_main!(benches);
