//! What a bodies' mutant can spoil, in a word each.

use std::cell::{Cell, RefCell};
use std::rc::Rc;

use interface::config::{ContactLaw, DemConfig, Motion};
use interface::control::{Hello, Notice};
use interface::stage::{Message, Payload};
use interface::wire::{ImpForce, ImpInfo, ImpState, Ledger, Limits};
use serde_json::Value;

use crate::mutant::{Flaw, Manners};

/// A value that both directions of a flaw see.
pub fn shared<T>(value: T) -> (Rc<Cell<T>>, Rc<Cell<T>>) {
    let one = Rc::new(Cell::new(value));
    (one.clone(), one)
}

pub fn manners(spoil: impl FnOnce(&mut Manners)) -> Flaw {
    let mut flaw = Flaw::none();
    spoil(&mut flaw.manners);
    flaw
}

pub fn hello(mut spoil: impl FnMut(&mut Hello) + 'static) -> Flaw {
    Flaw::notices(move |notice| {
        if let Notice::Hello(hello) = notice {
            spoil(hello);
        }
    })
}

/// Mends the bytes of an order that does not decode.
pub fn orders(mut mend: impl FnMut(&mut Vec<u8>) + 'static) -> Flaw {
    Flaw::inbound(move |mut message| {
        if message
            .as_order()
            .is_err_and(|why| why.contains("left over"))
            && let Payload::Order(bytes) = &mut message.payload
        {
            mend(bytes);
        }
        vec![message]
    })
}

/// Changes the configuration's JSON.
pub fn json_config(mut spoil: impl FnMut(&mut serde_json::Map<String, Value>) + 'static) -> Flaw {
    Flaw::config(move |config| {
        if let Value::Object(fields) = config {
            spoil(fields);
        }
    })
}

/// Changes the first step of a grant, given it and the step that is next.
pub fn next_grant(first: fn(u64, u64) -> u64) -> Flaw {
    let (next, reported) = shared(0);
    let mut flaw = Flaw::grants(move |_, grants| {
        for grant in grants {
            grant.first = first(grant.first, next.get());
        }
    });
    flaw.outbound = Flaw::reports(move |_, reports| {
        reports.iter().for_each(|report| reported.set(report.next));
    })
    .outbound;
    flaw
}

/// Where the run is.
#[derive(Clone, Copy, Default)]
pub struct Now {
    /// Of the last grant.
    pub epoch: u64,
    /// That comes next.
    pub step: u64,
}

/// Changes what comes in, knowing where the run is.
pub fn in_step(mut spoil: impl FnMut(&mut Message, Now) + 'static) -> Flaw {
    let (now, then) = shared(Now::default());
    let mut flaw = Flaw::inbound(move |mut message| {
        if let Payload::Grant(grants) = &message.payload {
            let first = grants.first();
            now.set(first.map_or(now.get(), |g| Now {
                epoch: g.epoch,
                step: g.first,
            }));
        }
        spoil(&mut message, now.get());
        vec![message]
    });
    flaw.outbound = Flaw::forces(move |header, _| {
        then.set(Now {
            epoch: header.epoch,
            step: header.step + 1,
        });
    })
    .outbound;
    flaw
}

pub fn sets(mut spoil: impl FnMut(&mut Vec<ImpInfo>) + 'static) -> Flaw {
    Flaw::inbound(move |mut message| {
        if let Payload::Set(set) = &mut message.payload {
            spoil(set);
        }
        vec![message]
    })
}

/// Changes how bodies move.
pub fn motion(mut spoil: impl FnMut(Motion) -> Option<Motion> + 'static) -> Flaw {
    Flaw::bodies_config(move |config| {
        for body in &mut config.bodies {
            body.motion = spoil(body.motion).unwrap_or(body.motion);
        }
    })
}

/// Changes k_n, k_t, mu and zeta of the law between points and bodies.
pub fn law(mut spoil: impl FnMut(&mut f64, &mut f64, &mut f64, &mut f64) + 'static) -> Flaw {
    Flaw::bodies_config(move |config: &mut DemConfig| {
        if let ContactLaw::Linear {
            normal_stiffness,
            tangential_stiffness,
            friction,
            damping_ratio,
        } = &mut config.point_contact
        {
            spoil(
                normal_stiffness,
                tangential_stiffness,
                friction,
                damping_ratio,
            );
        }
    })
}

pub fn scale(forces: &mut [ImpForce], factor: f64) {
    for force in forces {
        force.force = force.force.map(|f| factor * f);
    }
}

/// Every force that is not 0 becomes the next number.
pub fn next_up(forces: &mut [ImpForce]) {
    for f in forces.iter_mut().flat_map(|force| &mut force.force) {
        *f = if *f == 0.0 { 0.0 } else { f.next_up() };
    }
}

/// Takes the stiffness from forces that `which` picks.
pub fn stiffness(which: fn(&ImpForce) -> bool) -> Flaw {
    Flaw::forces(move |_, forces| {
        for force in forces.iter_mut().filter(|force| which(force)) {
            force.stiffness = 0.0;
        }
    })
}

/// Changes the forces that press on points whose speed (m/s) `which` picks.
pub fn moving(which: fn(f64) -> bool, spoil: fn(&mut ImpForce)) -> Flaw {
    let speeds = Rc::new(RefCell::new(Vec::new()));
    let seen = speeds.clone();
    let mut flaw = Flaw::states(move |_, states| {
        let speed = |s: &ImpState| s.velocity[0].hypot(s.velocity[1]);
        *speeds.borrow_mut() = states.iter().map(speed).collect();
    });
    flaw.outbound = Flaw::forces(move |_, forces| {
        let seen = seen.borrow();
        for (force, speed) in forces.iter_mut().zip(seen.iter()) {
            if force.force != [0.0; 2] && which(*speed) {
                spoil(force);
            }
        }
    })
    .outbound;
    flaw
}

pub fn limits(spoil: fn(&mut Limits)) -> Flaw {
    Flaw::reports(move |_, reports| reports.iter_mut().for_each(|r| spoil(&mut r.limits)))
}

pub fn ledger(spoil: fn(&mut Ledger)) -> Flaw {
    Flaw::reports(move |_, reports| reports.iter_mut().for_each(|r| spoil(&mut r.ledger)))
}
