//! Settles a box of grains and prints what a step costs, by contact and by body. A thousand discs settle in 60,000 steps;
//! after 12,000 they still fall and collide, and a contact costs twice as much. CPU time is that of the calling thread.
//! Both times are those of the lowest of ten batches; the wall time of two threads needs a quiet machine. `plain` is the
//! plain disc code of `bench/guard` on the settled discs, so that figures taken on a busy machine have something to be
//! compared with.
//!
//! `cargo run --release -p dem-proc --example settling_profile -- discs|pentagons|plain COUNT THREADS [SETTLING_STEPS
//! [MEASURED_STEPS [SKIN]]]`

use std::time::Instant;

use interface::config::DemConfig;
use interface::session::cpu_time;
use mechanics::generate::Grain;

use grain_box::{DT, PENTAGON, grain_box, run, step};
use yardsticks::PlainDiscs;

#[path = "../benches/grain_box.rs"]
mod grain_box;
#[allow(dead_code)]
#[path = "../../bench/guard/src/yardsticks.rs"]
mod yardsticks;

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let number = |i: usize, default: usize| {
        args.get(i)
            .map_or(default, |a| a.parse().expect("a number"))
    };
    let grain = match args.get(1).map(String::as_str) {
        Some("pentagons") => PENTAGON,
        _ => Grain::Disc,
    };
    let (count, threads) = (number(2, 1000), number(3, 1));
    let (settling, measured) = (number(4, 60_000), number(5, 4_000));
    let config = DemConfig {
        skin: args.get(6).map_or(0.001, |a| a.parse().expect("a number")),
        ..grain_box(grain, count, threads)
    };
    let mut dem = run(&config, settling);
    let ledger = dem.measurement().ledger;
    let batch = measured.div_ceil(10);
    let mut contacts = dem.contacts();
    let [cpu, wall] = if args.get(1).is_some_and(|kind| kind == "plain") {
        let mut discs = PlainDiscs::settled(&dem);
        lowest(batch, || contacts = discs.run(batch))
    } else {
        let costs = lowest(batch, || (0..batch).for_each(|_| step(&mut dem, DT, false)));
        contacts = dem.contacts();
        costs
    };
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

/// CPU and wall time of a step in s: the lowest of ten batches of so many steps.
fn lowest(steps: usize, mut batch: impl FnMut()) -> [f64; 2] {
    let mut lowest = [f64::INFINITY; 2];
    for _ in 0..10 {
        let (start, began) = (cpu_time(), Instant::now());
        batch();
        let cpu = cpu_time().saturating_sub(start);
        for (least, time) in lowest.iter_mut().zip([cpu, began.elapsed()]) {
            *least = least.min(time.as_secs_f64() / steps as f64);
        }
    }
    lowest
}
