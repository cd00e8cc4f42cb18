//! What a continuum takes of the machine.

use std::time::Instant;

use interface::wire::{ImpForce, ImpState};

use super::scene::{DT, IN_BLOCK, block, scene};
use crate::bench::{Bench, Flow};
use crate::clause::{Clause, machine};
use crate::verdict::{Judgement, Unmet};

pub const CLAUSES: &[Clause] = &[
    Clause::should(
        "X-6a",
        "its memory does not grow with the number of steps",
        memory,
    )
    .of_processes()
    .covers(&["C34"]),
    Clause::should("G-10a", "answers at once, not after a nap", latency).covers(&["C35"]),
];

const WINDOW: u64 = 16;
const POINTS: u64 = 2 * IN_BLOCK;

/// Two blocks at rest.
fn begun(bench: &Bench) -> Result<Flow<'_>, Unmet> {
    let blocks = vec![block([0.2, 0.6], [0.0; 2]), block([0.6, 0.2], [0.0; 2])];
    let mut flow = bench.flow(&scene(blocks))?;
    flow.free_step(0.0)?;
    Ok(flow)
}

fn memory(bench: &Bench) -> Judgement {
    let mut flow = begun(bench)?;
    let record = (size_of::<ImpState>() + size_of::<ImpForce>()) as u64;
    machine::memory(flow.session.pid(), || {
        flow.coast(DT, WINDOW)?;
        Ok(WINDOW * POINTS * record)
    })
}

fn latency(bench: &Bench) -> Judgement {
    let mut flow = begun(bench)?;
    let (forces, mut times) = (flow.no_forces(), Vec::new());
    flow.grant(DT, machine::ANSWERS + 1, false)?;
    flow.states()?;
    for _ in 0..machine::ANSWERS {
        let sent = Instant::now();
        flow.forces(&forces)?;
        flow.states()?;
        times.push(sent.elapsed());
    }
    flow.forces(&forces)?;
    flow.report()?;
    machine::latency(bench, times, POINTS as usize)
}
