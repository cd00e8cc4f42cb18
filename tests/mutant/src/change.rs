//! What a mutant can change, in a word each.

use std::cell::Cell;
use std::rc::Rc;
use std::sync::atomic::AtomicU32;

use conformance::Flaw;
use interface::config::{BodyConfig, ContactLaw, DemConfig, Motion};
use interface::message::control::{Hello, Notice, Order, Ready};
use interface::message::wire::{Grant, ImpForce, ImpState, Ledger, Limits, Report, StepHeader};
use interface::message::{Kind, Message, Payload};

/// A value that two flaws see.
pub fn shared<T>(value: T) -> (Rc<Cell<T>>, Rc<Cell<T>>) {
    let one = Rc::new(Cell::new(value));
    (one.clone(), one)
}

/// Changes notices.
pub fn notices(mut change: impl FnMut(&mut Notice) + 'static) -> Flaw {
    Flaw::passing(move |message| match message.as_notice() {
        Ok(mut notice) => {
            change(&mut notice);
            vec![Message::notice(message.header.step, &notice)]
        }
        Err(_) => vec![message],
    })
}

/// Changes Hello.
pub fn hello(mut change: impl FnMut(&mut Hello) + 'static) -> Flaw {
    notices(move |notice| {
        if let Notice::Hello(hello) = notice {
            change(hello);
        }
    })
}

/// Changes the contents of Ready.
pub fn ready(change: fn(&mut Ready)) -> Flaw {
    notices(move |notice| {
        if let Notice::Ready(ready) = notice {
            change(ready);
        }
    })
}

/// Changes last words.
pub fn words(from: &'static str, to: &'static str) -> Flaw {
    notices(move |notice| {
        if let Notice::Failed(failure) = notice {
            failure.message = failure.message.replace(from, to);
        }
    })
}

/// Where a run is.
#[derive(Clone, Copy, Default)]
pub struct Now {
    /// The last grant.
    pub grant: Grant,
    /// The step that comes next.
    pub step: u64,
    /// Sets so far.
    pub set: u64,
    /// Points of the last one.
    pub points: usize,
    /// Flags of the last states.
    pub of_states: u64,
    /// Flags of the last forces.
    pub of_forces: u64,
    /// A report has announced a halt.
    pub halted: bool,
    /// Between a grant and the report on it.
    pub granted: bool,
    /// An order to configure has come; whether for a coupled run.
    pub configured: Option<bool>,
    /// An order to drain has come.
    pub drained: bool,
}

impl Now {
    fn learn(&mut self, message: &Message) {
        match &message.payload {
            Payload::Order(_) => match message.as_order() {
                Ok(Order::Configure(order)) => self.configured = Some(order.coupled),
                order => self.drained |= matches!(order, Ok(Order::Drain)),
            },
            Payload::Grant(grants) => {
                self.granted = true;
                for grant in grants {
                    (self.grant, self.step) = (*grant, grant.first);
                }
            }
            Payload::States(_) => self.of_states = message.header.flags,
            Payload::Forces(_) => {
                self.step += 1;
                self.of_forces = message.header.flags;
            }
            Payload::Report(reports) => {
                self.granted = false;
                for report in reports {
                    self.step = report.next;
                    self.halted |= report.halted == 1;
                }
            }
            _ => {}
        }
    }
}

/// Changes what passes, knowing where the run is.
pub fn passing(mut pass: impl FnMut(Message, &Now) -> Vec<Message> + 'static) -> Flaw {
    let mut now = Now::default();
    Flaw::passing(move |message| {
        if let Payload::Set(set) = &message.payload {
            (now.set, now.points) = (now.set + 1, set.len());
        }
        let passed = pass(message, &now);
        passed.iter().for_each(|message| now.learn(message));
        passed
    })
}

/// Changes each message that passes, knowing where the run is.
pub fn in_step(mut change: impl FnMut(&mut Message, &Now) + 'static) -> Flaw {
    passing(move |mut message, now| {
        change(&mut message, now);
        vec![message]
    })
}

/// Changes the headers of messages of a kind, knowing where the run is.
pub fn header(kind: Kind, change: fn(&mut StepHeader, &Now)) -> Flaw {
    in_step(move |message, now| {
        if message.kind() == kind {
            change(&mut message.header, now);
        }
    })
}

/// Changes grants, knowing where the run is.
pub fn grant(change: fn(&mut Grant, &Now)) -> Flaw {
    in_step(move |message, now| {
        if let Payload::Grant(grants) = &mut message.payload {
            grants.iter_mut().for_each(|grant| change(grant, now));
        }
    })
}

/// Changes reports, knowing where the run is.
pub fn report(change: fn(&mut Report, &Now)) -> Flaw {
    in_step(move |message, now| {
        if let Payload::Report(reports) = &mut message.payload {
            reports.iter_mut().for_each(|report| change(report, now));
        }
    })
}

/// Orders that the hosted solver does not get to see, knowing where the run is.
pub fn ignoring(hides: fn(Result<Order, String>, &Now) -> bool) -> Flaw {
    passing(move |message, now| {
        let order = matches!(message.payload, Payload::Order(_));
        if order && hides(message.as_order(), now) {
            return Vec::new();
        }
        vec![message]
    })
}

/// Says twice what this is so of.
pub fn twice(so: fn(&Message) -> bool) -> Flaw {
    Flaw::passing(move |message| {
        let times = 1 + usize::from(so(&message));
        vec![message; times]
    })
}

/// Changes the configuration of each body.
pub fn body(mut change: impl FnMut(&mut BodyConfig) + 'static) -> Flaw {
    Flaw::config(move |config: &mut DemConfig| config.bodies.iter_mut().for_each(&mut change))
}

/// Frees bodies that move so.
pub fn frees(which: fn(&Motion) -> bool) -> Flaw {
    body(move |body| {
        if which(&body.motion) {
            body.motion = Motion::Free;
        }
    })
}

/// Changes k_n, k_t, mu and zeta of the law between points and bodies.
pub fn law(mut change: impl FnMut(&mut f64, &mut f64, &mut f64, &mut f64) + 'static) -> Flaw {
    Flaw::config(move |config: &mut DemConfig| {
        if let ContactLaw::Linear {
            normal_stiffness,
            tangential_stiffness,
            friction,
            damping_ratio,
            ..
        } = &mut config.point_contact
        {
            change(
                normal_stiffness,
                tangential_stiffness,
                friction,
                damping_ratio,
            );
        }
    })
}

/// Multiplies forces.
pub fn scale(forces: &mut [ImpForce], factor: f64) {
    for force in forces {
        force.force = force.force.map(|f| factor * f);
    }
}

/// Changes forces, knowing the states that they answer.
pub fn answers(mut change: impl FnMut(&[ImpState], &mut [ImpForce]) + 'static) -> Flaw {
    let mut states = Vec::new();
    Flaw::each(move |message| match &mut message.payload {
        Payload::States(now) if !now.is_empty() => states.clone_from(now),
        Payload::Forces(forces) => change(&states, forces),
        _ => {}
    })
}

/// Changes limits.
pub fn limits(change: fn(&mut Limits)) -> Flaw {
    Flaw::report(move |report| change(&mut report.limits))
}

/// Changes books.
pub fn ledger(change: fn(&mut Ledger)) -> Flaw {
    Flaw::report(move |report| change(&mut report.ledger))
}

/// Forces on a continuum, knowing those before them; not those that it refuses.
pub fn after_others(mut change: impl FnMut(&[ImpForce], &mut [ImpForce]) + 'static) -> Flaw {
    let mut before: Vec<ImpForce> = Vec::new();
    Flaw::forces(move |_, forces| {
        let right = forces.iter().all(|f| {
            let finite = f.force.iter().all(|x| x.is_finite());
            finite && (f.stiffness > 0.0 || (f.stiffness == 0.0 && f.force == [0.0; 2]))
        });
        if right {
            let now = forces.clone();
            before.resize(forces.len(), ImpForce::default());
            change(&before, forces);
            before = now;
        }
    })
}

/// Moves numbers of states and forces that are not 0 by so many places.
pub fn nudges(ulps: impl Fn(&Now) -> u32 + 'static) -> Flaw {
    in_step(move |message, now| {
        let nudge = |x: &mut f64| {
            for _ in 0..ulps(now) {
                *x = if *x == 0.0 { 0.0 } else { x.next_up() };
            }
        };
        match &mut message.payload {
            Payload::States(states) => states.iter_mut().for_each(|s| nudge(&mut s.position[0])),
            Payload::Forces(forces) => {
                let numbers = forces.iter_mut().flat_map(|f| &mut f.force);
                numbers.for_each(nudge);
            }
            _ => {}
        }
    })
}

/// Runs of mutants in this process.
pub static RUNS: AtomicU32 = AtomicU32::new(0);

/// A contact radius that is so much smaller than the configuration has it: a power of two, so that nothing is rounded.
pub const SHRUNK: f64 = 128.0;
