//! Broken steps: messages out of order, or wrong headers.

use interface::stage::{Kind, Payload};
use interface::wire::flags;

use super::spoil::{in_step, manners, next_grant, scale, sets, shared};
use crate::mutant::{Flaw, Mutant};

/// In the order of the clauses.
pub const MUTANTS: &[Mutant] = &[
    Mutant::new("G-1a", "takes the first of two grants", || {
        Flaw::grants(|_, grants| grants.truncate(1))
    }),
    Mutant::new("G-2a", "takes a NaN for 0", || {
        Flaw::grants(|_, grants| {
            for grant in grants.iter_mut().filter(|g| g.epoch_start.is_nan()) {
                grant.epoch_start = 0.0;
            }
        })
    }),
    Mutant::new(
        "G-3a",
        "takes a grant that it has had for the next one",
        || next_grant(std::cmp::Ord::max),
    ),
    Mutant::new("G-3b", "takes a grant that skips for the next one", || {
        next_grant(std::cmp::Ord::min)
    }),
    Mutant::new("G-3c", "takes no steps for one", || {
        Flaw::grants(|_, grants| {
            for grant in grants {
                grant.steps = grant.steps.max(1);
            }
        })
    }),
    Mutant::new("I-1a", "does not look at the step of states", || {
        in_step(|message, now| {
            if message.kind() == Kind::States {
                message.header.step = now.step;
            }
        })
    }),
    Mutant::new("I-1b", "does not look at the epoch of states", || {
        in_step(|message, now| {
            if message.kind() == Kind::States {
                message.header.epoch = now.epoch;
            }
        })
    }),
    Mutant::new("I-2a", "takes ids in any order", || {
        sets(|set| {
            if set.windows(2).any(|pair| pair[0].id >= pair[1].id) {
                (0..).zip(set).for_each(|(k, info)| info.id = k);
            }
        })
    }),
    Mutant::new("I-2b", "takes a point without radius", || {
        sets(|set| {
            set.iter_mut()
                .for_each(|info| info.radius = info.radius.max(1e-6));
        })
    }),
    Mutant::new("I-2c", "takes a point without mass", || {
        sets(|set| {
            set.iter_mut()
                .for_each(|info| info.mass = info.mass.max(1e-6));
        })
    }),
    Mutant::new("I-2d", "does not look at the count of a set", || {
        Flaw::inbound(|mut message| {
            if message.kind() == Kind::Set {
                message.header.count = message.payload.len() as u64;
            }
            vec![message]
        })
    }),
    Mutant::new("I-2e", "takes any generation", || {
        let mut generation = 0;
        Flaw::inbound(move |mut message| {
            match message.kind() {
                Kind::Set => {
                    generation += 1;
                    message.header.set = generation;
                }
                // The set was there before its states.
                Kind::States if message.header.set > generation && generation > 0 => {
                    let announced = message.header.flags & flags::NEW_SET != 0;
                    message.header.set = if announced {
                        generation
                    } else {
                        message.header.set
                    };
                }
                _ => {}
            }
            vec![message]
        })
    }),
    Mutant::new(
        "I-2f",
        "goes on with the old set when a new one is missing",
        || {
            let mut sets = 0;
            Flaw::inbound(move |mut message| {
                match message.kind() {
                    Kind::Set => sets += 1,
                    Kind::States
                        if message.header.set == sets + 1
                            && message.header.flags == flags::NEW_SET =>
                    {
                        message.header.flags = 0;
                        message.header.set = sets;
                    }
                    _ => {}
                }
                vec![message]
            })
        },
    ),
    Mutant::new("I-3a", "does not look at the generation of states", || {
        let mut sets = 0;
        Flaw::inbound(move |mut message| {
            match message.kind() {
                Kind::Set => sets += 1,
                Kind::States if message.header.flags == 0 => message.header.set = sets,
                _ => {}
            }
            vec![message]
        })
    }),
    Mutant::new("I-3b", "fills states up that are missing", || {
        let mut points = 0;
        Flaw::inbound(move |mut message| {
            match &mut message.payload {
                Payload::Set(set) => points = set.len(),
                Payload::States(states) if !states.is_empty() && states.len() < points => {
                    let last = *states.last().expect("there is one");
                    states.resize(points, last);
                    message.header.count = points as u64;
                }
                _ => {}
            }
            vec![message]
        })
    }),
    Mutant::new("I-3c", "takes a position that is NaN for 0", || {
        Flaw::states(|_, states| {
            for x in states.iter_mut().flat_map(|s| &mut s.position) {
                *x = if x.is_nan() { 0.0 } else { *x };
            }
        })
    }),
    Mutant::new("I-3d", "takes a velocity that is infinite for 0", || {
        Flaw::states(|_, states| {
            for v in states.iter_mut().flat_map(|s| &mut s.velocity) {
                *v = if v.is_infinite() { 0.0 } else { *v };
            }
        })
    }),
    Mutant::new("W-2a", "takes a reserved field for something", || {
        let (seen, used) = shared(false);
        let mut flaw = sets(move |set| seen.set(set.iter().any(|info| info.next != 0)));
        flaw.outbound = Flaw::forces(move |_, forces| {
            if used.get() {
                scale(forces, 2.0);
            }
        })
        .outbound;
        flaw
    }),
    Mutant::new("C-4a", "does not count its records", || {
        Flaw::reports(|header, _| header.count = 0)
    }),
    Mutant::new("F-2a", "numbers forces by the step that comes next", || {
        Flaw::forces(|header, _| header.step += 1)
    }),
    Mutant::new("F-3a", "does not say which set forces belong to", || {
        Flaw::forces(|header, _| header.set = 0)
    }),
    Mutant::new("G-9a", "answers twice", || {
        Flaw::outbound(|message| match message.kind() {
            Kind::Forces => vec![message.clone(), message],
            _ => vec![message],
        })
    }),
    Mutant::new("B-3a", "trusts the bell", || {
        manners(|m| m.waits_for_the_bell = true)
    }),
    Mutant::new("B-2a", "rings no bell", || {
        manners(|m| m.rings_no_bell = true)
    }),
    Mutant::new("C-1a", "has room for 4096 points", || {
        Flaw::forces(|header, forces| {
            forces.truncate(4096);
            header.count = forces.len() as u64;
        })
    }),
];
