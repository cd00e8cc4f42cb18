//! A settled box of grains, one step of the bodies' side: the job of MEASURED.md section 2.
//!
//! `cargo bench -p dem-proc --bench settling`; figures and reading in docs/performance-dem.md.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use dem_proc::Sdem;
use dem_proc::generate::{Grain, Packing, Sizes, open_box};
use interface::config::{ContactLaw, DemConfig};
use interface::solver::DemSolver;
use interface::step::Step;

const DT: f64 = 2e-5;

fn config(grain: Grain, count: usize, threads: usize) -> DemConfig {
    let packing = Packing {
        grain,
        sizes: Sizes::Uniform(0.008, 0.01),
        density: 2000.0,
        looseness: 0.0,
        seed: 1,
    };
    let width = 0.02 * (count as f64).sqrt().round();
    let mut bodies = open_box(width, 4.0 * width, 0.01);
    bodies.extend(packing.rows(count, width));
    let law = ContactLaw::Linear {
        normal_stiffness: 1e6,
        tangential_stiffness: 5e5,
        friction: 0.5,
        damping_ratio: 0.3,
    };
    DemConfig {
        gravity: [0.0, -9.81],
        bodies,
        point_contact: law,
        body_contact: Some(law),
        skin: 0.001,
        threads,
        ..DemConfig::default()
    }
}

fn step(dem: &mut Sdem, before: f64) {
    let step = Step {
        index: 0,
        time: 0.0,
        dt_before: before,
        dt: DT,
        measure: false,
    };
    black_box(dem.contact(&step, &[], &mut []).unwrap());
    dem.advance(&step).unwrap();
}

/// A solver whose grains have come to rest.
fn settled(grain: Grain, count: usize, threads: usize) -> Sdem {
    let mut dem = Sdem::default();
    dem.configure(&config(grain, count, threads)).unwrap();
    step(&mut dem, 0.0);
    for _ in 0..12_000 {
        step(&mut dem, DT);
    }
    dem
}

fn settling(c: &mut Criterion) {
    for (name, grain) in [("discs", Grain::Disc), ("pentagons", Grain::PENTAGON)] {
        let mut group = c.benchmark_group(name);
        group.sample_size(20);
        for count in [1_000, 10_000] {
            for threads in [1, 2] {
                let mut dem = settled(grain, count, threads);
                let contacts = dem.contacts();
                group.throughput(Throughput::Elements(contacts as u64));
                group.bench_function(
                    format!("{count} bodies, {contacts} contacts, {threads} threads"),
                    |b| {
                        b.iter(|| step(&mut dem, DT));
                    },
                );
            }
        }
    }
}

criterion_group!(benches, settling);
criterion_main!(benches);
