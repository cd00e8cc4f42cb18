//! Settles a box of grains and prints what a step costs, by contact and by body. CPU time is that of the calling thread,
//! the lowest of ten batches; with two threads read the wall time, the lowest of a hundred, since on a busy machine only
//! a short batch ever has two cores to itself (so short that most have no list rebuilt in them).
//!
//! `cargo run --release -p dem-proc --example settling_profile -- discs|pentagons COUNT THREADS [SETTLING_STEPS
//! [MEASURED_STEPS [SKIN]]]`

use std::time::Instant;

use interface::session::cpu_time;

use dem_proc::Sdem;
use dem_proc::generate::{Grain, Packing, Sizes, open_box};
use interface::config::{ContactLaw, DemConfig};
use interface::solver::DemSolver;
use interface::step::Step;

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let number = |i: usize, default: usize| {
        args.get(i)
            .map_or(default, |a| a.parse().expect("a number"))
    };
    let grain = match args.get(1).map(String::as_str) {
        Some("pentagons") => Grain::PENTAGON,
        _ => Grain::Disc,
    };
    let (count, threads) = (number(2, 1000), number(3, 1));
    let (settling, measured) = (number(4, 12_000), number(5, 4_000));
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
    let config = DemConfig {
        gravity: [0.0, -9.81],
        bodies,
        point_contact: law,
        body_contact: Some(law),
        skin: args.get(6).map_or(0.001, |a| a.parse().expect("a number")),
        threads,
        ..DemConfig::default()
    };
    let mut dem = Sdem::default();
    dem.configure(&config).expect("a valid configuration");
    let dt = 2e-5;
    let run = |dem: &mut Sdem, steps: usize, first: bool| {
        let (start, began) = (cpu_time(), Instant::now());
        for i in 0..steps {
            let step = Step {
                index: 0,
                time: 0.0,
                dt_before: if first && i == 0 { 0.0 } else { dt },
                dt,
                measure: first && i + 1 == steps,
            };
            dem.contact(&step, &[], &mut []).expect("finite");
            dem.advance(&step).expect("finite");
        }
        let cpu = cpu_time().saturating_sub(start);
        [cpu, began.elapsed()].map(|t| t.as_secs_f64() / steps as f64)
    };
    run(&mut dem, settling, true);
    let ledger = dem.measurement().ledger;
    let (mut cpu, mut wall) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..10 {
        let batches: [_; 10] =
            std::array::from_fn(|_| run(&mut dem, measured.div_ceil(100), false));
        cpu = cpu.min(batches.iter().map(|[cpu, _]| cpu / 10.0).sum());
        wall = batches
            .iter()
            .fold(wall, |lowest, &[_, now]| lowest.min(now));
    }
    let contacts = dem.contacts();
    println!(
        "{grain:?} x {count}, {threads} threads: {contacts} contacts, kinetic {:.1e} J/m; a step takes {:.1} us of CPU \
         ({:.1} ns a contact, {:.1} ns a body), {:.1} us of wall time",
        ledger.kinetic,
        cpu * 1e6,
        cpu * 1e9 / contacts as f64,
        cpu * 1e9 / count as f64,
        wall * 1e6,
    );
}
