//! Section 5, grants: what is out of order or no number is refused.

use interface::control::Order;
use interface::wire::Grant;

use super::scene::{DT, single};
use crate::bench::{Bench, Flow};
use crate::clause::Clause;
use crate::verdict::{Judgement, Unmet};

pub const CLAUSES: &[Clause] = &[
    Clause::must("G-1a", "refuses two grants in one message", two),
    Clause::must("G-2a", "refuses a step that is not finite", |bench| {
        wrong(bench, |grant| grant.dt = f64::NAN)
    })
    .covers(&["C26"]),
    Clause::must("G-3a", "refuses a step that it has done", |bench| {
        wrong(bench, |grant| grant.first -= 1)
    })
    .covers(&["C09"]),
    Clause::must("G-3b", "refuses a grant that skips a step", |bench| {
        wrong(bench, |grant| grant.first += 1)
    })
    .covers(&["C09"]),
    Clause::must("G-3c", "refuses a grant of no steps", |bench| {
        wrong(bench, |grant| grant.steps = 0)
    })
    .covers(&["C09"]),
    Clause::must("S-3a", "refuses an order out of turn", out_of_turn).covers(&["C28"]),
];

/// A run that has done one step.
fn begun(bench: &Bench) -> Result<Flow<'_>, Unmet> {
    let mut flow = bench.flow(&single([0.0; 2]))?;
    flow.free_step(DT)?;
    Ok(flow)
}

fn wrong(bench: &Bench, spoil: fn(&mut Grant)) -> Judgement {
    let mut flow = begun(bench)?;
    let mut grant = flow.next_grant(DT, 1, true);
    spoil(&mut grant);
    flow.send_grant(&grant)?;
    Ok(flow.session.failure()?.message)
}

fn two(bench: &Bench) -> Judgement {
    let mut flow = begun(bench)?;
    let grant = flow.next_grant(DT, 1, true);
    let next = Grant {
        first: grant.first + 1,
        ..grant
    };
    flow.send_grants(&[grant, next])?;
    Ok(flow.session.failure()?.message)
}

fn out_of_turn(bench: &Bench) -> Judgement {
    let mut flow = begun(bench)?;
    flow.session.order(&Order::Close)?;
    Ok(flow.session.failure()?.message)
}
