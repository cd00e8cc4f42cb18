//! Section 5, halting.

use interface::message::control::Order;
use interface::message::wire::{StepHeader, flags};
use interface::transport::raw::{Message, Payload};

use super::scene::{DT, block, push, scene, single};
use crate::bench::{Bench, Budget, ContinuumRun, configure};
use crate::clause::Clause;
use crate::mutant::{Flaw, change};
use crate::verdict::{Judgement, Unmet, require};

pub const CLAUSES: &[Clause] = &[
    Clause::must(
        "H-1a",
        "sends HALT_BEFORE when its limits exceed a budget",
        before,
    )
    .mutant("ignores the budget of speed", || {
        change::each_grant(|grant| grant.budget_speed = f64::MAX)
    }),
    Clause::must(
        "L-5a",
        "does not halt on the last step of a window",
        single_step,
    )
    .after(&["H-1a"])
    .mutant("halts in windows of one step", || {
        change::at_report(|window, message| {
            let report = change::reported(&message);
            let beyond = report.limits.speed > window.grant.budget_speed;
            change::halts(message, beyond && window.grant.steps == 1)
        })
    }),
    Clause::must(
        "H-1b",
        "compares the frequency with contact with the budget",
        stiff,
    )
    .after(&["H-1a", "L-2c"])
    .mutant("ignores stiff contacts", || {
        Flaw::forces(|_, forces| {
            for force in forces.iter_mut().filter(|f| f.stiffness > 1e8) {
                force.stiffness = 1.0;
            }
        })
    }),
    Clause::must("H-2b", "stops after a step with HALT_AFTER", after)
        .mutant("continues after HALT_AFTER", || {
            Flaw::forces(|header, _| header.flags = 0)
        }),
    Clause::must("H-2c", "HALT_AFTER on the last step has no effect", last).mutant(
        "halts at the end of the window",
        || {
            change::at_report(|window, message| {
                let ends =
                    change::reported(&message).next == window.grant.first + window.grant.steps;
                change::halts(message, window.bodies_halt && ends)
            })
        },
    ),
    Clause::must("H-3a", "HALT_AFTER holds where both sides halt", both)
        .after(&["H-1a", "H-2b"])
        .mutant("sends HALT_BEFORE after HALT_AFTER", || {
            change::at_report(|window, message| {
                let report = change::reported(&message);
                if !window.bodies_halt || report.limits.speed <= window.grant.budget_speed {
                    return vec![message];
                }
                let header = StepHeader {
                    epoch: report.epoch,
                    step: report.next,
                    flags: flags::HALT_BEFORE,
                    ..StepHeader::default()
                };
                let halt = Message::new(header, Payload::States(Vec::new()));
                vec![halt, message]
            })
        }),
    Clause::must("H-4a", "halts without bodies, too", alone)
        .after(&["H-1a"])
        .mutant("ignores budgets without bodies", || {
            let mut alone = false;
            Flaw::inbound(move |mut message| {
                if let Ok(Order::Configure(configure)) = message.as_order() {
                    alone = !configure.coupled;
                }
                if let Payload::Grant(grants) = &mut message.payload
                    && alone
                {
                    for grant in grants {
                        grant.budget_omega_sq = f64::MAX;
                    }
                }
                vec![message]
            })
        }),
    Clause::must("H-5a", "a halt changes no bit of the later steps", no_cost)
        .after(&["H-1a"])
        .mutant("has other bits after a halt", || {
            let mut halted = false;
            Flaw::outbound(move |mut message| {
                halted |= change::reported(&message).halted == 1;
                if let Payload::States(states) = &mut message.payload {
                    for state in states.iter_mut().filter(|_| halted) {
                        change::nudged(state, 1);
                    }
                }
                vec![message]
            })
        }),
];

const SLOW: Budget = Budget {
    speed: 0.5,
    ..Budget::ALL
};

/// The next message is HALT_BEFORE of this step, and the report fits it.
fn halted(flow: &mut ContinuumRun, first: u64, step: u64) -> Result<(), Unmet> {
    let (header, states) = flow.next_states()?;
    let told = (header.flags, header.step, states.len());
    require(
        told == (flags::HALT_BEFORE, step, 0),
        format_args!("HALT_BEFORE of step {step}, without states"),
        format_args!("flags {}, step {}, {} states", told.0, told.1, told.2),
    )
    .map_err(|e| e.at(step))?;
    stopped(flow, first, step)
}

/// The report has a halt before this step.
fn stopped(flow: &mut ContinuumRun, first: u64, step: u64) -> Result<(), Unmet> {
    let report = flow.report()?.report;
    require(
        (report.halted, report.next) == (1, step) && step > first,
        format_args!("halted before step {step}"),
        format_args!("halted {}, next {}", report.halted, report.next),
    )
    .map_err(|e| e.at(step))
}

fn before(bench: &Bench) -> Judgement {
    let mut flow = bench.run_continuum(&single([0.8, 0.0]))?;
    flow.budget = SLOW;
    flow.grant(DT, 4, false)?;
    flow.exchange()?;
    halted(&mut flow, 0, 1)?;
    // It continues when it is allowed to.
    flow.budget = Budget::ALL;
    flow.begin_epoch(DT);
    flow.coast(DT, 3)?;
    Ok("before step 1 of a window of 4".into())
}

fn single_step(bench: &Bench) -> Judgement {
    let mut flow = bench.run_continuum(&single([0.8, 0.0]))?;
    flow.budget = SLOW;
    for _ in 0..3 {
        flow.grant(DT, 1, false)?;
        flow.exchange()?;
        let report = flow.report()?.report;
        require(
            report.halted == 0 && report.next == flow.next(),
            "a whole window",
            format_args!("halted {}, next {}", report.halted, report.next),
        )?;
    }
    Ok("3 windows of 1".into())
}

fn stiff(bench: &Bench) -> Judgement {
    let mut flow = bench.run_continuum(&single([0.0; 2]))?;
    let (_, told) = flow.free_step(DT)?;
    flow.budget = Budget {
        omega_sq: 2.0 * told.report.limits.omega_sq + 1.0,
        ..Budget::ALL
    };
    let first = flow.next();
    flow.grant(DT, 6, false)?;
    flow.exchange()?;
    flow.states()?;
    // Its own stiffness exceeds the budget.
    flow.forces(&[push([0.0; 2], 1e12)])?;
    halted(&mut flow, first, first + 2)?;
    Ok("before the step after a stiff contact".into())
}

/// A window of 4 steps, in the second of which the bodies say HALT_AFTER.
fn bodies_halt(bench: &Bench, budget: Budget) -> Judgement {
    let mut flow = bench.run_continuum(&single([0.8, 0.0]))?;
    flow.free_step(DT)?;
    flow.budget = budget;
    let first = flow.next();
    flow.grant(DT, 4, false)?;
    flow.states()?;
    flow.flags = flags::HALT_AFTER;
    flow.forces(&flow.no_forces())?;
    flow.flags = 0;
    stopped(&mut flow, first, first + 1)?;
    let more = flow.session.take(interface::transport::raw::Kind::States)?;
    require(
        more.is_none(),
        "no states after it",
        format_args!("{more:?}"),
    )?;
    flow.budget = Budget::ALL;
    flow.begin_epoch(DT);
    flow.coast(DT, 3)?;
    Ok("after the first step of a window of 4".into())
}

fn after(bench: &Bench) -> Judgement {
    bodies_halt(bench, Budget::ALL)
}

fn both(bench: &Bench) -> Judgement {
    bodies_halt(bench, SLOW)
}

fn last(bench: &Bench) -> Judgement {
    let mut flow = bench.run_continuum(&single([0.0; 2]))?;
    flow.grant(DT, 2, false)?;
    flow.exchange()?;
    flow.states()?;
    flow.flags = flags::HALT_AFTER;
    flow.forces(&flow.no_forces())?;
    flow.flags = 0;
    let report = flow.report()?.report;
    require(
        (report.halted, report.next) == (0, 2),
        "a whole window",
        format_args!("halted {}, next {}", report.halted, report.next),
    )?;
    flow.coast(DT, 2)?;
    Ok("2 steps of 2".into())
}

fn alone(bench: &Bench) -> Judgement {
    let config = scene(vec![block([0.4; 2], [0.0; 2])]);
    let mut order = configure(&config);
    order.coupled = false;
    let mut flow = bench.flow_by(&order)?;
    let omega_sq = flow.step(DT, |_, _| Vec::new())?.1.report.limits.omega_sq;
    flow.budget = Budget {
        omega_sq: 1e-9 * omega_sq,
        ..Budget::ALL
    };
    let first = flow.next();
    flow.grant(DT, 4, false)?;
    stopped(&mut flow, first, first + 1)?;
    flow.done(1);
    flow.budget = Budget::ALL;
    flow.begin_epoch(DT);
    flow.coast(DT, 3)?;
    Ok("before the second step of a window of 4".into())
}

fn no_cost(bench: &Bench) -> Judgement {
    let mut ends = Vec::new();
    for budget in [Budget::ALL, SLOW] {
        let mut config = single([0.8, 0.3]);
        config.gravity = [1.0, -9.0];
        let mut flow = bench.run_continuum(&config)?;
        flow.budget = budget;
        while flow.next() < 6 {
            // Within an epoch the same time is start + n dt; every step begins one here, as after a halt.
            flow.begin_epoch(DT);
            let steps = if budget == Budget::ALL {
                1
            } else {
                6 - flow.next()
            };
            let first = flow.next();
            flow.grant(DT, steps, false)?;
            flow.exchange()?;
            if steps == 1 {
                flow.report()?;
            } else {
                halted(&mut flow, first, first + 1)?;
            }
        }
        flow.budget = Budget::ALL;
        flow.grant(DT, 1, false)?;
        ends.push(flow.exchange()?.states);
        flow.report()?;
    }
    require(
        ends[0] == ends[1],
        format_args!("{:?}", ends[0]),
        format_args!("{:?}", ends[1]),
    )?;
    Ok("5 halts in 6 steps".into())
}
