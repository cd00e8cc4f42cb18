//! Section 5, halting.

use interface::message::Kind;
use interface::message::wire::{Budget, flags};

use super::scene::{DT, MASS, block, push, scene, single};
use crate::bench::{Bench, Run, configure};
use crate::clause::{Clause, below_the_sum, clauses};
use crate::verdict::{Judgement, Unmet, require};

pub const CLAUSES: &[Clause] = clauses! {
    Must "H-1a" "sends HALT_BEFORE when its limits exceed a budget" by |bench| window(bench, SLOW, 4, None, (true, 1));
    Must "H-1b" "compares the frequency with contact with the budget" by stiff,
        after: &["H-1a", "L-2b", "L-2c", "L-2h"];
    Must "H-2b" "stops after a step with HALT_AFTER" by |bench| window(bench, Budget::UNLIMITED, 4, Some(0), (true, 1));
    Must "H-2c" "HALT_AFTER on the last step has no effect"
        by |bench| window(bench, Budget::UNLIMITED, 2, Some(1), (false, 2));
    Must "H-3a" "HALT_AFTER holds where both sides halt" by |bench| window(bench, SLOW, 4, Some(0), (true, 1)),
        after: &["H-1a", "H-2b"];
    Must "H-4a" "halts without bodies, too" by alone, after: &["H-1a"];
};

const SLOW: Budget = Budget {
    speed: 0.5,
    ..Budget::UNLIMITED
};

/// The next message is HALT_BEFORE of this step, and the report fits it.
fn halted(flow: &mut Run, step: u64) -> Result<(), Unmet> {
    let (header, states) = flow.next_states()?;
    let halts = (header.flags, header.step, states.len()) == (flags::HALT_BEFORE, step, 0);
    let expected = format_args!("HALT_BEFORE of step {step}, without states");
    require(halts, expected, format_args!("{header:?}")).map_err(|e| e.at(step))?;
    flow.ends(true, step)
}

/// It continues when it is allowed to.
fn continues(mut flow: Run) -> Judgement {
    let step = flow.next();
    flow.budget = Budget::UNLIMITED;
    flow.begin_epoch(DT);
    flow.coast(DT, 3)?;
    Ok(format!("before step {step}"))
}

/// A window of `steps` steps of a moving point, in one of which the bodies may say HALT_AFTER; it ends by a halt or not,
/// before a step.
fn window(
    bench: &Bench,
    budget: Budget,
    steps: u64,
    bodies_halt: Option<u64>,
    (halts, end): (bool, u64),
) -> Judgement {
    let mut flow = bench.run_continuum(&single([0.8, 0.0]))?;
    flow.budget = budget;
    flow.grant(DT, steps, false)?;
    for step in 0..end {
        flow.flags = u64::from(bodies_halt == Some(step)) * flags::HALT_AFTER;
        flow.free()?;
    }
    flow.flags = 0;
    if halts && bodies_halt.is_none() {
        halted(&mut flow, end)?;
    } else {
        flow.ends(halts, end)?;
        let more = flow.session.take(Kind::States)?;
        require(
            more.is_none(),
            "no states after it",
            format_args!("{more:?}"),
        )?;
    }
    continues(flow)
}

fn stiff(bench: &Bench) -> Judgement {
    let mut flow = bench.run_continuum(&single([0.0; 2]))?;
    let (_, reported) = flow.free_step(DT)?;
    // About as stiff as the continuum itself.
    let stiffness = MASS * reported.report.limits.omega_sq.max(1.0);
    let pressed = [push([0.0; 2], stiffness)];
    flow.grant(DT, 1, false)?;
    flow.states()?;
    flow.press(&pressed)?;
    flow.budget.omega_sq = below_the_sum(&flow.report()?.report.limits);
    let first = flow.next();
    flow.grant(DT, 6, false)?;
    flow.free()?;
    flow.states()?;
    flow.press(&pressed)?;
    halted(&mut flow, first + 2)?;
    continues(flow)
}

fn alone(bench: &Bench) -> Judgement {
    let mut order = configure(&scene(vec![block([0.4; 2], [0.0; 2])]));
    order.coupled = false;
    let mut flow = bench.run(&order)?;
    flow.grant(DT, 1, true)?;
    flow.done(1);
    let omega_sq = flow.report()?.report.limits.omega_sq;
    flow.budget.omega_sq = 1e-9 * omega_sq;
    let first = flow.next();
    flow.grant(DT, 4, false)?;
    flow.ends(true, first + 1)?;
    flow.done(1);
    continues(flow)
}
