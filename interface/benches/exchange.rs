//! What a coupled step costs besides physics: wall time of one step of two solvers that compute next to nothing, with
//! the coupler granting windows of one and of 64 steps.
//!
//! `cargo bench -p interface --bench exchange`

#[path = "../tests/toys/mod.rs"]
mod toys;

use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use interface::control::{Configure, Party};
use interface::session::{coupler, dem, mpm};
use interface::step::Clock;
use interface::wire::Grant;
use interface::{OneProcess, SharedMemory, Transport};
use toys::{HalfPlane, Points};

/// Wall time of `steps` steps with `imps` IMPs. The parties are threads in either case; over `SharedMemory` they talk
/// as processes do.
fn lockstep<S: Transport + 'static>(imps: usize, window: u64, steps: u64) -> Duration {
    let mut session = coupler::Session::<S>::open(&[Party::Mpm, Party::Dem]).expect("a session");
    let (for_points, for_wall) = (session.domain().clone(), session.domain().clone());
    std::thread::scope(|scope| {
        scope.spawn(move || mpm::run::<S, _>(&for_points, &mut Points::new(imps), false));
        scope.spawn(move || dem::run::<S, _>(&for_wall, &mut HalfPlane::default(), false));
        let alarm = &mut || Ok(());
        let configs = [
            (Party::Mpm, serde_json::to_string(&toys::mpm_config())),
            (Party::Dem, serde_json::to_string(&toys::dem_config())),
        ];
        for (party, config) in configs {
            let config = config.expect("a configuration");
            session.hello(party, alarm).expect("a hello");
            let configure = Configure {
                scene_hash: String::new(),
                config,
                coupled: true,
                deadline: 10.0,
            };
            session.configure(party, &configure).expect("an order");
            session.ready(party, "", alarm).expect("readiness");
        }
        let mut clock = Clock::new(0.0);
        // Steps so short that nothing moves far: no rebuild after the first.
        clock.begin_epoch(1e-12);
        let mut advance = |steps: u64| {
            let end = clock.index() + steps;
            while clock.index() < end {
                let (epoch_start, steps_in_epoch, dt_before_epoch) = clock.epoch();
                let grant = Grant {
                    first: clock.index(),
                    steps: window.min(end - clock.index()),
                    epoch_start,
                    steps_in_epoch,
                    dt_before_epoch,
                    dt: clock.dt(),
                    budget_omega_sq: f64::MAX,
                    budget_speed: f64::MAX,
                    budget_damping: f64::MAX,
                    ..Grant::default()
                };
                for party in [Party::Mpm, Party::Dem] {
                    session.grant(party, &grant).expect("a grant");
                }
                for party in [Party::Mpm, Party::Dem] {
                    black_box(
                        session
                            .report(party, &grant, &mut || Ok(()))
                            .expect("a report"),
                    );
                }
                clock.advance_by(grant.steps);
            }
        };
        advance(200);
        let start = Instant::now();
        advance(steps);
        let spent = start.elapsed();
        session.drain(&mut || Ok(())).expect("an orderly end");
        spent
    })
}

fn exchange(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("exchange");
    group
        .sample_size(10)
        .measurement_time(Duration::from_secs(3))
        .warm_up_time(Duration::from_millis(200));
    for imps in [0, 100, 1_000, 10_000] {
        for window in [1, 64] {
            group.bench_with_input(
                BenchmarkId::new(format!("ipc window {window}"), imps),
                &imps,
                |b, &imps| {
                    b.iter_custom(|steps| lockstep::<SharedMemory>(imps, window, steps));
                },
            );
        }
        group.bench_with_input(
            BenchmarkId::new("local window 64", imps),
            &imps,
            |b, &imps| {
                b.iter_custom(|steps| lockstep::<OneProcess>(imps, 64, steps));
            },
        );
    }
    group.finish();
}

criterion_group!(benches, exchange);
criterion_main!(benches);
