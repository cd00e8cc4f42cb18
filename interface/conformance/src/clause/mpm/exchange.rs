//! Section 5, messages of a step, and what is wrong with those of the bodies.

use std::cell::Cell;
use std::rc::Rc;

use interface::config::MpmConfig;
use interface::message::wire::{ImpForce, StepHeader, flags};
use interface::transport::raw::{Kind, Message, Payload};

use super::scene::{DT, block, push, scene, single};
use crate::bench::{Bench, ContinuumRun, Reply, configure};
use crate::clause::Clause;
use crate::mutant::{Flaw, change};
use crate::verdict::{Judgement, Unmet, broken, require};

pub const CLAUSES: &[Clause] = &[
    Clause::must(
        "S-8b",
        "refuses an unknown material and names its key",
        no_material,
    )
    .mutant("uses the first material instead of an unknown one", || {
        Flaw::config(|config: &mut MpmConfig| {
            let materials = config.materials.len();
            for group in config.groups.iter_mut().filter(|g| g.material >= materials) {
                group.material = 0;
            }
        })
    }),
    Clause::must("G-9b", "sends one message of states in a step", once).mutant(
        "sends empty states twice",
        || {
            Flaw::outbound(|message| {
                let header = message.header;
                let empty =
                    matches!(&message.payload, Payload::States(states) if states.is_empty());
                if empty && header.flags == 0 && header.step > 2 && header.set == 1 {
                    return vec![message.clone(), message];
                }
                vec![message]
            })
        },
    ),
    Clause::must("E-2a", "refuses envelopes of another step", |bench| {
        outlines(bench, |message| message.header.step += 1)
    })
    .mutant("accepts envelopes of any step", || {
        let last = Rc::new(Cell::new(0));
        let seen = Rc::clone(&last);
        Flaw::envelopes(move |header, _| header.step = last.get())
            .with(Flaw::states(move |header, _| seen.set(header.step)))
    }),
    Clause::must("E-2b", "refuses envelopes of another number", |bench| {
        outlines(bench, |message| message.header.count += 1)
    })
    .mutant("does not count envelopes", || {
        Flaw::envelopes(|header, vertices| header.count = vertices.len() as u64)
    }),
    Clause::must("E-3a", "refuses envelopes that are not finite", |bench| {
        outlines(bench, |message| {
            if let Payload::Envelopes(vertices) = &mut message.payload {
                vertices[1].position[0] = f64::NAN;
            }
        })
    })
    .mutant("uses 0 instead of a NaN", || {
        Flaw::envelopes(|_, vertices| {
            for vertex in vertices {
                vertex.position = vertex.position.map(|x| if x.is_nan() { 0.0 } else { x });
            }
        })
    }),
    Clause::must("F-2b", "refuses forces of another step", |bench| {
        forces(bench, |message| message.header.step -= 1)
    })
    .mutant("accepts forces of any step", || {
        change::forces_of_states(|states, header, _| header.step = states.step)
    }),
    Clause::must("F-2c", "refuses forces of another epoch", |bench| {
        forces(bench, |message| message.header.epoch += 1)
    })
    .mutant("accepts forces of any epoch", || {
        change::forces_of_states(|states, header, _| header.epoch = states.epoch)
    }),
    Clause::must("F-3b", "refuses forces of another set", |bench| {
        forces(bench, |message| message.header.set += 1)
    })
    .mutant("accepts forces of any set", || {
        change::forces_of_states(|states, header, _| header.set = states.set)
    }),
    Clause::must("F-3c", "refuses fewer forces than points", |bench| {
        forces(bench, |message| {
            if let Payload::Forces(forces) = &mut message.payload {
                forces.pop();
                message.header.count -= 1;
            }
        })
    })
    .mutant("uses zero for missing forces", || {
        change::forces_of_states(|states, header, forces| {
            if header.count == forces.len() as u64 {
                forces.resize(states.count as usize, ImpForce::default());
                header.count = states.count;
            }
        })
    }),
    Clause::must("F-3d", "refuses forces whose number is wrong", |bench| {
        forces(bench, |message| message.header.count += 1)
    })
    .mutant("does not count forces", || {
        Flaw::forces(|header, forces| header.count = forces.len() as u64)
    }),
    Clause::must("F-4a", "refuses a force that is not finite", |bench| {
        forces(bench, |message| {
            if let Payload::Forces(forces) = &mut message.payload {
                forces[3].force[1] = f64::NAN;
            }
        })
    })
    .mutant("uses 0 instead of a NaN", || {
        Flaw::forces(|_, forces| {
            for force in forces {
                force.force = force.force.map(|x| if x.is_nan() { 0.0 } else { x });
            }
        })
    }),
    Clause::must("F-4b", "refuses a travel that is not finite", |bench| {
        forces(bench, |message| message.header.travel = f64::INFINITY)
    })
    .mutant("uses 0 for an infinite travel", || {
        Flaw::forces(|header, _| {
            if header.travel.is_infinite() {
                header.travel = 0.0;
            }
        })
    }),
    Clause::must("F-5b", "refuses a force without a stiffness", |bench| {
        forces(bench, |message| {
            if let Payload::Forces(forces) = &mut message.payload {
                forces[3] = push([1.0, 0.0], 0.0);
            }
        })
    })
    .mutant("uses a default stiffness", || {
        Flaw::forces(|_, forces| {
            for force in forces {
                if force.stiffness == 0.0 && force.force != [0.0; 2] {
                    force.stiffness = 1.0;
                }
            }
        })
    }),
    Clause::must("F-5c", "refuses a stiffness below zero", |bench| {
        forces(bench, |message| {
            if let Payload::Forces(forces) = &mut message.payload {
                forces[3] = push([1.0, 0.0], -1e3);
            }
        })
    })
    .mutant("uses the magnitude of a stiffness", || {
        Flaw::forces(|_, forces| {
            for force in forces {
                force.stiffness = force.stiffness.abs();
            }
        })
    }),
];

/// Without any point too: an empty message is a message.
fn once(bench: &Bench) -> Judgement {
    let mut flow = bench.run_continuum(&single([0.0; 2]))?;
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

fn outlines(bench: &Bench, change: fn(&mut Message)) -> Judgement {
    let mut flow = bench.run_continuum(&single([0.0; 2]))?;
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
    change(&mut message);
    flow.session.send(&message)?;
    refusal(&mut flow)
}

/// The solver fails at once, and does not go on until it finds nobody there.
fn refusal(flow: &mut ContinuumRun) -> Judgement {
    let failure = flow.session.failure()?;
    let states = flow.session.take(Kind::States)?;
    require(states.is_none(), "Failed at once", "states before it")?;
    Ok(failure.message)
}

/// Step 1 is answered with changed forces; the run and the step of it are returned.
fn answered(bench: &Bench, change: fn(&mut Message)) -> Result<(ContinuumRun<'_>, u64), Unmet> {
    let mut flow = bench.run_continuum(&scene(vec![block([0.4; 2], [0.0; 2])]))?;
    flow.grant(DT, 4, false)?;
    flow.exchange()?;
    let step = flow.states()?.step.index;
    let forces = vec![push([0.0, 1e-3], 10.0); flow.imps().len()];
    let mut message = Message::new(flow.header(), Payload::Forces(forces));
    change(&mut message);
    flow.send_forces(&message)?;
    Ok((flow, step))
}

fn forces(bench: &Bench, change: fn(&mut Message)) -> Judgement {
    refusal(&mut answered(bench, change)?.0)
}

fn no_material(bench: &Bench) -> Judgement {
    let mut config = single([0.0; 2]);
    config.groups[0].material = 7;
    let mut session = bench.greeted()?;
    match session.configure(&configure(&config))? {
        Reply::Refused(refusal) if !refusal.key.is_empty() => Ok(refusal.to_string()),
        Reply::Refused(refusal) => Err(broken("a key", format_args!("`{refusal}`"))),
        Reply::Ready(_) => Err(broken("Refused", "Ready")),
    }
}
