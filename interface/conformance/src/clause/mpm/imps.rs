//! Section 6: how often sets are chosen, and how large they may be.

use interface::config::{Fill, Spacing};

use super::scene::{DT, RADIUS, SKIN, block, scene};
use crate::bench::Bench;
use crate::clause::{Clause, clauses};
use crate::verdict::{Judgement, near, require};

pub const CLAUSES: &[Clause] = clauses! {
    Should "I-6c" "asks for envelopes at most twice as often as needed" by seldom;
    Must "I-9c" "a set can have ten thousand points" by many;
};

/// Largest travel with which the set stays, in m.
const ALLOWED: f64 = SKIN - 0.5 * RADIUS;

fn seldom(bench: &Bench) -> Judgement {
    let velocity = [0.6, 0.8];
    let mut flow = bench.run_continuum(&scene(vec![block([0.3; 2], velocity)]))?;
    let steps = 400;
    flow.coast(DT, steps)?;
    let needed = steps as f64 * DT / ALLOWED;
    let sets = flow.at.generation;
    let most = (1.0 + 2.0 * needed).floor();
    require(
        sets as f64 <= most,
        format_args!("at most {most} sets"),
        sets,
    )?;
    Ok(format!("{sets} sets, {:.0} needed", 1.0 + needed.floor()))
}

fn many(bench: &Bench) -> Judgement {
    let mut config = scene(vec![block([0.2; 2], [0.5, 0.0])]);
    config.groups[0].fill = Fill::Rectangle {
        lower: [0.25; 2],
        upper: [0.75; 2],
    };
    config.groups[0].spacing = Spacing::Counts([100, 100]);
    let mut flow = bench.run_continuum(&config)?;
    let start = flow.free_step(DT)?.0;
    flow.coast(DT, 2)?;
    let end = flow.free_step(DT)?.0;
    let count = end.states.len();
    require(count == 10_000, "10 000 states", count)?;
    for (a, b) in start.states.iter().zip(&end.states) {
        let x = a.position[0] + 3.0 * DT * 0.5;
        near("position in m", b.position[0], x, 1e-9).map_err(|e| e.at(3))?;
    }
    Ok("10 000 states, 4 steps".into())
}
