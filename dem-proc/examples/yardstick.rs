//! The plain disc code of `bench/guard` on the same settled box, so that figures taken on a busy machine have something to
//! be compared with.
//!
//! `cargo run --release -p dem-proc --example yardstick -- 1000`

use interface::session::cpu_time;
use mechanics::generate::Grain;

use grain_box::{grain_box, run};
use yardsticks::PlainDiscs;

#[path = "../benches/grain_box.rs"]
mod grain_box;
#[allow(dead_code)]
#[path = "../../bench/guard/src/yardsticks.rs"]
mod yardsticks;

fn main() {
    let count: usize = std::env::args()
        .nth(1)
        .map_or(1000, |a| a.parse().expect("a number"));
    let mut discs = PlainDiscs::settled(&run(&grain_box(Grain::Disc, count, 1), 60_000));
    let mut best = f64::INFINITY;
    let mut contacts = 0;
    for _ in 0..10 {
        let start = cpu_time();
        contacts = discs.run(400);
        best = best.min(cpu_time().saturating_sub(start).as_secs_f64() / 400.0);
    }
    println!(
        "plain discs x {count}: {contacts} contacts, {:.1} us of CPU a step, {:.1} ns a contact",
        best * 1e6,
        best * 1e9 / contacts as f64
    );
}
