//! A settled box of grains, one step of the bodies' side: the job of MEASURED.md section 2.
//!
//! `cargo bench -p dem-proc --bench settling`; figures and reading in docs/performance-dem.md.

use std::hint::black_box;
use std::time::Duration;

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
        sizes: Sizes::Uniform {
            from: 0.008,
            to: 0.01,
        },
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

/// A solver that starts from `config`, after `steps` steps.
fn run(config: &DemConfig, steps: usize) -> Sdem {
    let mut dem = Sdem::default();
    dem.configure(config).unwrap();
    step(&mut dem, 0.0);
    for _ in 1..steps {
        step(&mut dem, DT);
    }
    dem
}

/// The same grains where they are in `dem`, standing still.
fn at_rest(mut config: DemConfig, dem: &Sdem) -> DemConfig {
    for (body, state) in config.bodies.iter_mut().zip(&dem.bodies().state) {
        // The grains' shapes have their centroids in their origins, so the centre of mass is the position.
        body.position = state.center.into();
        body.angle = state.angle;
        body.velocity = [0.0; 2];
        body.spin = 0.0;
    }
    config
}

/// A settled pile. To wait until the dashpots have taken all motion would take minutes: the grains fall together, and are
/// stopped again and again until they lie on one another.
fn pile(grain: Grain, count: usize) -> DemConfig {
    let mut config = config(grain, count, 1);
    let fall = 8_000;
    for steps in [fall].into_iter().chain([400; 10]) {
        let dem = run(&config, steps);
        config = at_rest(config, &dem);
    }
    config
}

fn settling(c: &mut Criterion) {
    for (name, grain) in [("discs", Grain::Disc), ("pentagons", Grain::PENTAGON)] {
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
                    |b| b.iter(|| step(&mut dem, DT)),
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
                ..config(Grain::Disc, count, threads)
            };
            let mut dem = run(&config, 10);
            assert_eq!(dem.contacts(), 0);
            group.throughput(Throughput::Elements(count as u64));
            group.bench_function(format!("{count} bodies, {threads} threads"), |b| {
                b.iter(|| step(&mut dem, DT));
            });
        }
    }
}

criterion_group!(benches, settling, floating);
criterion_main!(benches);
