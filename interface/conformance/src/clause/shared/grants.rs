//! Section 5, grants: what is out of order or no number is refused.

use interface::message::wire::Grant;

use super::run::Run;
use crate::bench::Bench;
use crate::clause::Clause;
use crate::mutant::{Flaw, change};
use crate::verdict::Judgement;

pub const CLAUSES: &[Clause] = &[
    Clause::must("G-1a", "refuses two grants in a message", two).mutant(
        "uses the first of two grants",
        || {
            Flaw::grants(|header, grants| {
                grants.truncate(1);
                header.count = 1;
            })
        },
    ),
    Clause::must("G-2a", "refuses a grant with a NaN", |bench| {
        wrong(bench, |grant| grant.epoch_start = f64::NAN)
    })
    .mutant("uses 0 instead of a NaN", || {
        change::each_grant(|grant| {
            if grant.epoch_start.is_nan() {
                grant.epoch_start = 0.0;
            }
        })
    }),
    Clause::must("G-3a", "refuses a step that it has done", |bench| {
        wrong(bench, |grant| grant.first -= 1)
    })
    .mutant("accepts an old grant as the next one", || {
        change::next_grant(u64::max)
    }),
    Clause::must("G-3b", "refuses a grant that skips a step", |bench| {
        wrong(bench, |grant| grant.first += 1)
    })
    .mutant("accepts a grant that skips a step", || {
        change::next_grant(u64::min)
    }),
    Clause::must("G-3c", "refuses a grant of no steps", |bench| {
        wrong(bench, |grant| grant.steps = 0)
    })
    .mutant("takes a grant of no steps as one step", || {
        change::each_grant(|grant| grant.steps = grant.steps.max(1))
    }),
];

/// A grant after step 0 that is wrong; the solver shall say Failed.
fn wrong(bench: &Bench, change: fn(&mut Grant)) -> Judgement {
    let mut run = Run::begun(bench)?;
    let mut grant = run.next_step();
    change(&mut grant);
    run.send_grants(&[grant])?;
    Ok(run.session.failure()?.message)
}

fn two(bench: &Bench) -> Judgement {
    let mut run = Run::begun(bench)?;
    let grant = run.next_step();
    run.send_grants(&[grant, grant])?;
    Ok(run.session.failure()?.message)
}
