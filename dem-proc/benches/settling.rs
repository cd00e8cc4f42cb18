//! A settled box of grains, one step of the bodies' side.
//!
//! `cargo bench -p dem-proc --bench settling`; figures and reading in docs/performance.md.

use std::time::Duration;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use interface::config::DemConfig;
use mechanics::generate::Grain;

use grain_box::{DT, PENTAGON, grain_box, pile, run, step};

mod grain_box;

fn settling(c: &mut Criterion) {
    for (name, grain) in [("discs", Grain::Disc), ("pentagons", PENTAGON)] {
        let mut group = c.benchmark_group(name);
        group.sample_size(20);
        group.warm_up_time(Duration::from_millis(500));
        group.measurement_time(Duration::from_secs(2));
        for count in [1_000, 10_000] {
            let pile = pile(grain, count);
            for threads in [1, 2] {
                let config = DemConfig {
                    threads,
                    ..pile.clone()
                };
                let mut dem = run(&config, 1_000); // friction takes hold again
                let contacts = dem.contacts();
                group.throughput(Throughput::Elements(contacts as u64));
                group.bench_function(
                    format!("{count} bodies, {contacts} contacts, {threads} threads"),
                    |b| b.iter(|| step(&mut dem, DT, false)),
                );
            }
        }
    }
}

/// Discs that float side by side, none in touch: what a body costs by itself, and whether that grows.
fn floating(c: &mut Criterion) {
    let mut group = c.benchmark_group("floating discs");
    group.sample_size(20);
    group.warm_up_time(Duration::from_millis(500));
    group.measurement_time(Duration::from_secs(2));
    for count in [1_000, 10_000, 100_000] {
        for threads in [1, 2] {
            let config = DemConfig {
                gravity: [0.0; 2],
                ..grain_box(Grain::Disc, count, threads)
            };
            let mut dem = run(&config, 10);
            assert_eq!(dem.contacts(), 0);
            group.throughput(Throughput::Elements(count as u64));
            group.bench_function(format!("{count} bodies, {threads} threads"), |b| {
                b.iter(|| step(&mut dem, DT, false));
            });
        }
    }
}

criterion_group!(benches, settling, floating);
criterion_main!(benches);
