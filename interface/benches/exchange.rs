//! What a coupled step costs besides physics: wall time of one step of two solvers that compute next to nothing, with
//! the coupler granting windows of one and of 64 steps; and the copies between processors that so many points need.
//!
//! `cargo bench -p interface --bench exchange`

#[path = "../tests/toys/mod.rs"]
mod toys;

use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use interface::forces::Forces;
use interface::hosted::Host;
use interface::message::control::Party;
use interface::message::wire::{ImpForce, ImpState};
use interface::session::together::Together;
use interface::session::{Session, drive, serve};
use interface::transport::domain::OwnedDomain;
use interface::transport::iceoryx::{self, SEND_TIMEOUT};
use toys::{Course, HalfPlane, Points};

const BOTH: [Party; 2] = [Party::Mpm, Party::Dem];
/// Steps before the clock starts.
const WARM: u64 = 256;
/// The same over processes: threads that have just been started may stand on one processor, and wait in turns there, until
/// the system moves one of them. With 64 steps a window that takes some 10 ms: a session is longer.
const SETTLED: u64 = 20_000;
/// Steps over processes for each iteration of criterion, which would measure a few hundred: it takes the start for a part of them.
const MANY: u64 = 100;

/// Wall time of `steps` steps with `imps` IMPs over shared memory. The parties are threads, which talk as processes do.
fn between_processes(imps: usize, window: u64, steps: u64) -> Duration {
    let domain = OwnedDomain::create().expect("a directory");
    let names = domain.domain();
    let _created = iceoryx::create(names, &BOTH, false).expect("channels");
    let ends =
        iceoryx::join(names, Party::Coupler, &BOTH, SEND_TIMEOUT).expect("the coupler's ends");
    let mut course = Course::still(SETTLED + MANY * steps, window);
    course.warm = SETTLED;
    std::thread::scope(|scope| {
        scope.spawn(move || serve(names, Host::Mpm(Box::new(Points::new(imps)))));
        scope.spawn(move || serve(names, Host::Dem(Box::<HalfPlane>::default())));
        let session = Session::coupler(&BOTH, &mut course, ends);
        let _open = session.ends();
        drive(session).expect("an orderly end");
    });
    course.spent.div_f64(MANY as f64)
}

/// The same in one thread, by direct calls.
fn direct(imps: usize, window: u64, steps: u64) -> Duration {
    let mut course = Course::still(WARM + steps, window);
    course.warm = WARM;
    let points = Host::Mpm(Box::new(Points::new(imps)));
    let wall = Host::Dem(Box::<HalfPlane>::default());
    let [coupler, ..] = Together::of(&mut course, [points, wall]).run();
    coupler.expect("an orderly end");
    course.spent
}

/// What the toys compute by themselves in a step.
fn computing(imps: usize, steps: u64) -> Duration {
    use interface::solver::{DemSolver, MpmSolver};
    let (mut points, mut wall) = (Points::new(imps), HalfPlane::default());
    points
        .configure(&toys::mpm_config())
        .expect("a toy takes all");
    wall.configure(&toys::dem_config())
        .expect("a toy takes all");
    wall.imp_set(points.select_imps(&[]));
    let mut forces = Forces::default();
    let step = interface::step::Step {
        index: 1,
        time: 0.0,
        dt_before: 1e-12,
        dt: 1e-12,
        measure: false,
    };
    let start = Instant::now();
    for _ in 0..steps {
        let states = points.imp_states();
        forces.clear(states, []);
        let given = interface::forces::Points { set: &[], states };
        black_box(wall.contact(&step, &given, &mut forces).expect("no fault"));
        black_box(points.step(&step, forces.on_points()).expect("no fault"));
    }
    start.elapsed()
}

/// The copies that an exchange between processes needs (C-5): states and forces into shared memory, and out of it on the
/// other processor, which must fetch what this one has written. Both wait without sleeping, as solvers do.
fn copies(imps: usize, steps: u64) -> Duration {
    let (to_dem, states_of) = std::sync::mpsc::channel::<Vec<ImpState>>();
    let (back_to_mpm, states_back) = std::sync::mpsc::channel::<Vec<ImpState>>();
    let (to_mpm, forces_of) = std::sync::mpsc::channel::<Vec<ImpForce>>();
    let (back_to_dem, forces_back) = std::sync::mpsc::channel::<Vec<ImpForce>>();
    std::thread::scope(|scope| {
        scope.spawn(move || {
            let forces = vec![ImpForce::default(); imps];
            let mut own = vec![ImpState::default(); imps];
            let mut shared_forces = forces.clone();
            for _ in 0..SETTLED + steps {
                let states = fetched(&states_of);
                own.copy_from_slice(black_box(&states));
                black_box(&own);
                back_to_mpm.send(states).expect("it is awaited");
                shared_forces.copy_from_slice(black_box(&forces));
                to_mpm.send(shared_forces).expect("it is awaited");
                shared_forces = fetched(&forces_back);
            }
        });
        let states = vec![ImpState::default(); imps];
        let mut own = vec![ImpForce::default(); imps];
        let mut shared = states.clone();
        let mut start = Instant::now();
        for step in 0..SETTLED + steps {
            if step == SETTLED {
                start = Instant::now();
            }
            shared.copy_from_slice(black_box(&states));
            to_dem.send(shared).expect("it is awaited");
            let forces = fetched(&forces_of);
            own.copy_from_slice(black_box(&forces));
            black_box(&own);
            back_to_dem.send(forces).expect("it is awaited");
            shared = fetched(&states_back);
        }
        start.elapsed()
    })
}

/// The next that comes, waited for without sleeping.
fn fetched<T>(from: &std::sync::mpsc::Receiver<T>) -> T {
    loop {
        if let Ok(here) = from.try_recv() {
            return here;
        }
        std::hint::spin_loop();
    }
}

fn exchange(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("exchange");
    group
        .sample_size(10)
        .measurement_time(Duration::from_secs(3))
        .warm_up_time(Duration::from_millis(200));
    for imps in [0, 100, 1_000, 10_000] {
        for window in [1, 64] {
            let id = BenchmarkId::new(format!("processes, window {window}"), imps);
            group.bench_with_input(id, &imps, |b, &imps| {
                b.iter_custom(|steps| between_processes(imps, window, steps));
            });
        }
        let id = BenchmarkId::new("direct, window 64", imps);
        group.bench_with_input(id, &imps, |b, &imps| {
            b.iter_custom(|steps| direct(imps, 64, steps));
        });
        let id = BenchmarkId::new("the toys alone", imps);
        group.bench_with_input(id, &imps, |b, &imps| {
            b.iter_custom(|steps| computing(imps, steps));
        });
        let id = BenchmarkId::new("the copies alone", imps);
        group.bench_with_input(id, &imps, |b, &imps| {
            b.iter_custom(|steps| copies(imps, MANY * steps).div_f64(MANY as f64));
        });
    }
    group.finish();
}

criterion_group!(benches, exchange);
criterion_main!(benches);
