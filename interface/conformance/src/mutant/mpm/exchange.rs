//! Broken exchanges: states, sets, and what is taken from the bodies.

use std::cell::Cell;
use std::rc::Rc;

use interface::stage::Payload;
use interface::wire::ImpForce;

use super::spoil::{SHRUNK, config, envelopes, forces, forces_of_states, set, states, with, words};
use crate::mutant::{Flaw, Mutant};

/// In the order of the clauses.
pub const MUTANTS: &[Mutant] = &[
    Mutant::new("I-1a", "leaves out the epoch", || {
        states(|header, _| header.epoch = 0)
    }),
    Mutant::new("G-9a", "sends empty states twice", || {
        Flaw::outbound(|message| {
            let header = message.header;
            let empty = matches!(&message.payload, Payload::States(states) if states.is_empty());
            if empty && header.flags == 0 && header.step > 2 && header.set == 1 {
                return vec![message.clone(), message];
            }
            vec![message]
        })
    }),
    Mutant::new("E-2a", "takes envelopes of any step", || {
        let last = Rc::new(Cell::new(0));
        let seen = Rc::clone(&last);
        with(
            envelopes(move |header, _| header.step = last.get()),
            states(move |header, _| seen.set(header.step)),
        )
    }),
    Mutant::new("E-2b", "does not count envelopes", || {
        envelopes(|header, vertices| header.count = vertices.len() as u64)
    }),
    Mutant::new("E-3a", "takes a NaN for 0", || {
        envelopes(|_, vertices| {
            for vertex in vertices {
                vertex.position = vertex.position.map(|x| if x.is_nan() { 0.0 } else { x });
            }
        })
    }),
    Mutant::new("F-2a", "takes forces of any step", || {
        forces_of_states(|states, header, _| header.step = states.step)
    }),
    Mutant::new("F-2b", "takes forces of any epoch", || {
        forces_of_states(|states, header, _| header.epoch = states.epoch)
    }),
    Mutant::new("F-3a", "takes forces of any set", || {
        forces_of_states(|states, header, _| header.set = states.set)
    }),
    Mutant::new("F-3b", "takes forces that are not there for none", || {
        forces_of_states(|states, header, forces| {
            if header.count == forces.len() as u64 {
                forces.resize(states.count as usize, ImpForce::default());
                header.count = states.count;
            }
        })
    }),
    Mutant::new("F-3c", "does not count forces", || {
        forces(|header, forces| header.count = forces.len() as u64)
    }),
    Mutant::new("F-4a", "takes a NaN for 0", || {
        forces(|_, forces| {
            for force in forces {
                force.force = force.force.map(|x| if x.is_nan() { 0.0 } else { x });
            }
        })
    }),
    Mutant::new("F-4b", "takes an infinite travel for none", || {
        forces(|header, _| {
            if header.travel.is_infinite() {
                header.travel = 0.0;
            }
        })
    }),
    Mutant::new("F-5a", "makes up a stiffness", || {
        forces(|_, forces| {
            for force in forces {
                if force.stiffness == 0.0 && force.force != [0.0; 2] {
                    force.stiffness = 1.0;
                }
            }
        })
    }),
    Mutant::new("F-5b", "takes a stiffness for its size", || {
        forces(|_, forces| {
            for force in forces {
                force.stiffness = force.stiffness.abs();
            }
        })
    }),
    Mutant::new("X-1a", "does not name the clause", || {
        words("F-4", "a clause")
    }),
    Mutant::new("I-8a", "counts sets by two", || {
        set(|header, _| {
            if header.set > 1 {
                header.set += 1;
            }
        })
    }),
    Mutant::new("I-2a", "exchanges the ids of two points", || {
        set(|_, set| {
            if let [a, b, ..] = &mut set[..] {
                std::mem::swap(&mut a.id, &mut b.id);
            }
        })
    }),
    Mutant::new("I-2b", "says that points are heavier than they are", || {
        set(|_, set| {
            for info in set {
                info.mass *= 1.5;
            }
        })
    }),
    Mutant::new("I-9a", "exchanges the states of two points", || {
        states(|_, states| {
            if states.len() > 1 {
                states.swap(0, 1);
            }
        })
    }),
    Mutant::new("I-7a", "takes half of a segment's reach", || {
        envelopes(|_, vertices| {
            let bodies: Vec<u64> = vertices.iter().map(|v| v.body).collect();
            for vertex in vertices {
                if bodies.iter().filter(|body| **body == vertex.body).count() == 2 {
                    vertex.reach *= 0.5;
                }
            }
        })
    }),
    Mutant::new("I-6a", "lets points use up more than the skin", || {
        let inbound = config(|config| {
            for group in &mut config.groups {
                if let Some(radius) = &mut group.contact_radius {
                    let shrunk = *radius / SHRUNK;
                    config.skin = config.skin.max(0.02 + *radius - shrunk);
                    *radius = shrunk;
                }
            }
        });
        let outbound = Flaw::outbound(|mut message| {
            match &mut message.payload {
                Payload::Set(set) => set.iter_mut().for_each(|info| info.radius *= SHRUNK),
                Payload::Report(reports) => reports
                    .iter_mut()
                    .for_each(|report| report.limits.radius_min *= SHRUNK),
                _ => {}
            }
            vec![message]
        });
        with(inbound, outbound)
    }),
    Mutant::new("I-6b", "does not look how far bodies have moved", || {
        forces(|header, _| {
            if header.travel < 0.5 {
                header.travel = 0.0;
            }
        })
    }),
    Mutant::new("I-6c", "asks for envelopes in every step", || {
        forces(|header, _| {
            if header.travel.is_finite() {
                header.travel = 10.0;
            }
        })
    }),
    Mutant::new("I-9b", "sends five thousand states at most", || {
        states(|header, states| {
            states.truncate(5000);
            header.count = states.len() as u64;
        })
    }),
];
