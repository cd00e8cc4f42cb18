//! Section 5, messages of a step, and what is wrong with those of the bodies.

use interface::stage::{Kind, Message, Payload};
use interface::wire::{StepHeader, flags};

use super::scene::{DT, IN_BLOCK, block, push, scene, single};
use crate::bench::{Bench, Flow};
use crate::clause::Clause;
use crate::verdict::{Judgement, Unmet, broken, require};

pub const CLAUSES: &[Clause] = &[
    Clause::must(
        "I-1a",
        "states carry the step, the epoch, the set and their number",
        headers,
    )
    .covers(&["C09"]),
    Clause::must("G-9a", "sends one message of states in a step", once),
    Clause::must("E-2a", "refuses envelopes of another step", |bench| {
        outlines(bench, |message| message.header.step += 1)
    }),
    Clause::must("E-2b", "refuses envelopes of another number", |bench| {
        outlines(bench, |message| message.header.count += 1)
    })
    .covers(&["C05"]),
    Clause::must("E-3a", "refuses envelopes that are not finite", |bench| {
        outlines(bench, |message| {
            if let Payload::Envelopes(vertices) = &mut message.payload {
                vertices[1].position[0] = f64::NAN;
            }
        })
    })
    .covers(&["C26"]),
    Clause::must("F-2a", "refuses forces of another step", |bench| {
        forces(bench, |message| message.header.step -= 1)
    })
    .covers(&["C09", "C11"]),
    Clause::must("F-2b", "refuses forces of another epoch", |bench| {
        forces(bench, |message| message.header.epoch += 1)
    }),
    Clause::must("F-3a", "refuses forces of another set", |bench| {
        forces(bench, |message| message.header.set += 1)
    }),
    Clause::must("F-3b", "refuses fewer forces than points", |bench| {
        forces(bench, |message| {
            if let Payload::Forces(forces) = &mut message.payload {
                forces.pop();
                message.header.count -= 1;
            }
        })
    })
    .covers(&["C05"]),
    Clause::must(
        "F-3c",
        "refuses a number of forces that is not theirs",
        |bench| forces(bench, |message| message.header.count += 1),
    )
    .covers(&["C05"]),
    Clause::must("F-4a", "refuses a force that is not finite", |bench| {
        forces(bench, |message| {
            if let Payload::Forces(forces) = &mut message.payload {
                forces[3].force[1] = f64::NAN;
            }
        })
    })
    .covers(&["C26"]),
    Clause::must("F-4b", "refuses a travel that is not finite", |bench| {
        forces(bench, |message| message.header.travel = f64::INFINITY)
    })
    .covers(&["C26"]),
    Clause::must(
        "F-5a",
        "refuses a force without the stiffness behind it",
        |bench| {
            forces(bench, |message| {
                if let Payload::Forces(forces) = &mut message.payload {
                    forces[3] = push([1.0, 0.0], 0.0);
                }
            })
        },
    ),
    Clause::must("F-5b", "refuses a stiffness below zero", |bench| {
        forces(bench, |message| {
            if let Payload::Forces(forces) = &mut message.payload {
                forces[3] = push([1.0, 0.0], -1e3);
            }
        })
    }),
    Clause::must("X-1a", "its last words name the clause and the step", words)
        .after(&["F-4a"])
        .covers(&["C36"]),
];

fn headers(bench: &Bench) -> Judgement {
    let mut flow = bench.flow(&scene(vec![block([0.4; 2], [0.0; 2])]))?;
    let mut epoch = 0;
    for (dt, steps) in [(DT, 3), (0.5 * DT, 3)] {
        flow.grant(dt, steps, false)?;
        epoch += 1;
        for _ in 0..steps {
            let index = flow.next();
            let shown = flow.exchange()?;
            let announced = if shown.new_set.is_some() {
                flags::NEW_SET
            } else {
                0
            };
            let expected = StepHeader {
                epoch,
                step: index,
                count: IN_BLOCK,
                flags: announced,
                travel: 0.0,
                set: flow.generation(),
            };
            let same = shown.header == expected && shown.states.len() as u64 == IN_BLOCK;
            require(
                same,
                format_args!("{expected:?}"),
                format_args!("{:?} with {} states", shown.header, shown.states.len()),
            )
            .map_err(|e| e.at(index))?;
            for asked in &shown.asked {
                let asks = (asked.epoch, asked.step, asked.count, asked.flags)
                    == (epoch, index, 0, flags::WANT_ENVELOPES);
                require(
                    asks,
                    "WANT_ENVELOPES of this step",
                    format_args!("{asked:?}"),
                )
                .map_err(|e| e.at(index))?;
            }
        }
        flow.report()?;
    }
    Ok("6 steps, 2 epochs".into())
}

/// Without any point too: an empty message is a message.
fn once(bench: &Bench) -> Judgement {
    let mut flow = bench.flow(&single([0.0; 2]))?;
    flow.outlines.clear();
    flow.grant(DT, 8, false)?;
    for _ in 0..8 {
        let shown = flow.exchange()?;
        let step = shown.step.index;
        require(
            shown.header.step == step,
            format_args!("states of step {step}"),
            format_args!("states of step {}", shown.header.step),
        )
        .map_err(|e| e.at(step))?;
    }
    flow.report()?;
    let more = flow.session.take(Kind::States)?;
    require(more.is_none(), "no more states", format_args!("{more:?}"))?;
    Ok("8 messages in 8 steps".into())
}

fn outlines(bench: &Bench, spoil: fn(&mut Message)) -> Judgement {
    let mut flow = bench.flow(&single([0.0; 2]))?;
    flow.grant(DT, 1, false)?;
    let (header, _) = flow.next_states()?;
    if header.flags & flags::WANT_ENVELOPES == 0 {
        return Err(broken(
            "WANT_ENVELOPES before the first set",
            format_args!("{header:?}"),
        ));
    }
    let header = StepHeader {
        set: 0,
        ..flow.header()
    };
    let mut message = Message::new(header, Payload::Envelopes(flow.outlines.clone()));
    spoil(&mut message);
    flow.session.send(&message)?;
    refusal(&mut flow)
}

/// The solver fails at once, and does not go on until it finds nobody there.
fn refusal(flow: &mut Flow) -> Judgement {
    let failure = flow.session.failure()?;
    let states = flow.session.take(Kind::States)?;
    require(states.is_none(), "Failed at once", "states before it")?;
    Ok(failure.message)
}

/// Step 1 is answered with spoilt forces; the run and the step of it are returned.
fn answered(bench: &Bench, spoil: fn(&mut Message)) -> Result<(Flow<'_>, u64), Unmet> {
    let mut flow = bench.flow(&scene(vec![block([0.4; 2], [0.0; 2])]))?;
    flow.grant(DT, 4, false)?;
    flow.exchange()?;
    let step = flow.states()?.step.index;
    let forces = vec![push([0.0, 1e-3], 10.0); flow.set.len()];
    let mut message = Message::new(flow.header(), Payload::Forces(forces));
    spoil(&mut message);
    flow.send_forces(&message)?;
    Ok((flow, step))
}

fn forces(bench: &Bench, spoil: fn(&mut Message)) -> Judgement {
    refusal(&mut answered(bench, spoil)?.0)
}

fn words(bench: &Bench) -> Judgement {
    let (mut flow, step) = answered(bench, |message| {
        if let Payload::Forces(forces) = &mut message.payload {
            forces[3].force[1] = f64::NAN;
        }
    })?;
    let failure = flow.session.failure()?;
    let named = failure.step == step
        && failure.message.contains("F-4")
        && failure.message.contains(&step.to_string());
    require(
        named,
        format_args!("F-4 and step {step}"),
        format_args!("step {}: {}", failure.step, failure.message),
    )?;
    Ok(failure.message)
}
