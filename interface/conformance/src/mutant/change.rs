//! What a mutant can change, in a word each.

use std::cell::Cell;
use std::rc::Rc;
use std::sync::atomic::AtomicU32;

use interface::config::{BodyConfig, ContactLaw, DemConfig, Motion};
use interface::message::control::{Hello, Notice, Order};
use interface::message::wire::{
    Grant, ImpForce, ImpState, Ledger, Limits, Report, StepHeader, flags,
};
use interface::solver::Readiness;
use interface::transport::raw::{Kind, Message, Payload};
use serde_json::Value;

use super::flaw::Flaw;

/// A value that two flaws see.
pub fn shared<T>(value: T) -> (Rc<Cell<T>>, Rc<Cell<T>>) {
    let one = Rc::new(Cell::new(value));
    (one.clone(), one)
}

/// Changes Hello.
pub fn hello(mut change: impl FnMut(&mut Hello) + 'static) -> Flaw {
    Flaw::notices(move |notice| {
        if let Notice::Hello(hello) = notice {
            change(hello);
        }
    })
}

/// Changes what is said with Ready.
pub fn ready(change: fn(&mut Readiness)) -> Flaw {
    Flaw::notices(move |notice| {
        if let Notice::Ready(ready) = notice {
            change(&mut ready.readiness);
        }
    })
}

/// Changes last words.
pub fn words(from: &'static str, to: &'static str) -> Flaw {
    Flaw::notices(move |notice| {
        if let Notice::Failed(failure) = notice {
            failure.message = failure.message.replace(from, to);
        }
    })
}

/// Changes the bytes of orders.
pub fn order_bytes(mut change: impl FnMut(&mut Vec<u8>) + 'static) -> Flaw {
    Flaw::each(move |message| {
        if let Payload::Order(bytes) = &mut message.payload {
            change(bytes);
        }
    })
}

/// Orders that the hosted solver does not get to see.
pub fn ignoring(mut hide: impl FnMut(Result<Order, String>) -> bool + 'static) -> Flaw {
    Flaw::passing(move |message| {
        let order = matches!(message.payload, Payload::Order(_));
        if order && hide(message.as_order()) {
            return Vec::new();
        }
        vec![message]
    })
}

/// Changes the configuration's JSON.
pub fn json_config(mut change: impl FnMut(&mut serde_json::Map<String, Value>) + 'static) -> Flaw {
    Flaw::config(move |config| {
        if let Value::Object(fields) = config {
            change(fields);
        }
    })
}

/// Where a run is.
#[derive(Clone, Copy, Default)]
pub struct Now {
    /// Of the last grant.
    pub epoch: u64,
    /// That comes next.
    pub step: u64,
    /// Sets so far.
    pub set: u64,
    /// Points of the last one.
    pub points: usize,
}

/// Changes what passes, knowing where the run is.
pub fn in_step(mut change: impl FnMut(&mut Message, Now) + 'static) -> Flaw {
    let mut now = Now::default();
    Flaw::each(move |message| {
        if let Payload::Set(set) = &message.payload {
            (now.set, now.points) = (now.set + 1, set.len());
        }
        change(message, now);
        match &message.payload {
            Payload::Grant(grants) => grants
                .iter()
                .for_each(|g| (now.epoch, now.step) = (g.epoch, g.first)),
            Payload::Forces(_) => now.step += 1,
            Payload::Report(reports) => reports.iter().for_each(|report| now.step = report.next),
            _ => {}
        }
    })
}

/// Changes the headers of messages of a kind, knowing where the run is.
pub fn header(kind: Kind, change: fn(&mut StepHeader, Now)) -> Flaw {
    in_step(move |message, now| {
        if message.kind() == kind {
            change(&mut message.header, now);
        }
    })
}

/// Changes the first step of a grant, given it and the step that is next.
pub fn next_grant(first: fn(u64, u64) -> u64) -> Flaw {
    in_step(move |message, now| {
        if let Payload::Grant(grants) = &mut message.payload {
            grants
                .iter_mut()
                .for_each(|grant| grant.first = first(grant.first, now.step));
        }
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

/// Changes forces, knowing the states that they answer.
pub fn answers(mut change: impl FnMut(&[ImpState], &mut [ImpForce]) + 'static) -> Flaw {
    let mut states = Vec::new();
    Flaw::each(move |message| match &mut message.payload {
        Payload::States(now) if !now.is_empty() => states.clone_from(now),
        Payload::Forces(forces) => change(&states, forces),
        _ => {}
    })
}

/// Changes the reports on measured steps.
pub fn measured(mut change: impl FnMut(&mut Report) + 'static) -> Flaw {
    Flaw::report(move |report| {
        if report.measured == 1 {
            change(report);
        }
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

/// Forces that a right continuum takes.
pub fn right(forces: &[ImpForce]) -> bool {
    forces.iter().all(|f| {
        let finite = f.force.iter().all(|x| x.is_finite());
        finite && (f.stiffness > 0.0 || (f.stiffness == 0.0 && f.force == [0.0; 2]))
    })
}

/// Forces on a continuum, knowing those before them.
pub fn after_others(mut change: impl FnMut(&[ImpForce], &mut [ImpForce]) + 'static) -> Flaw {
    let mut before: Vec<ImpForce> = Vec::new();
    Flaw::forces(move |_, forces| {
        if right(forces) {
            let now = forces.clone();
            before.resize(forces.len(), ImpForce::default());
            change(&before, forces);
            before = now;
        }
    })
}

/// Moves numbers of states and forces that go out by so many places, given the grant that they belong to.
pub fn nudges(ulps: impl Fn(&Grant) -> u32 + 'static) -> Flaw {
    let (grant, of) = shared(Grant::default());
    let nudge = Flaw::passing(move |mut message| {
        let ulps = ulps(&of.get());
        match &mut message.payload {
            Payload::States(states) => states.iter_mut().for_each(|state| nudged(state, ulps)),
            Payload::Forces(forces) => (0..ulps).for_each(|_| next_up(forces)),
            _ => {}
        }
        vec![message]
    });
    Flaw::grant(move |now| grant.set(*now)).with(nudge)
}

/// What a mutant knows of the window that it is in.
#[derive(Clone, Copy, Default)]
pub struct Window {
    /// By which it is granted.
    pub grant: Grant,
    /// The bodies have said HALT_AFTER in it.
    pub bodies_halt: bool,
}

/// Whatever goes out with a report, knowing its window.
pub fn at_report(mut change: impl FnMut(&Window, Message) -> Vec<Message> + 'static) -> Flaw {
    let mut window = Window::default();
    Flaw::passing(move |message| {
        match &message.payload {
            Payload::Grant(grants) => {
                window = Window {
                    grant: grants.first().copied().unwrap_or_default(),
                    bodies_halt: false,
                };
            }
            Payload::Forces(_) => {
                window.bodies_halt = message.header.flags & flags::HALT_AFTER != 0;
            }
            Payload::Report(_) => return change(&window, message),
            _ => {}
        }
        vec![message]
    })
}

/// A report with a halt.
pub fn halts(mut message: Message, halts: bool) -> Vec<Message> {
    if let Payload::Report(reports) = &mut message.payload
        && halts
    {
        reports.iter_mut().for_each(|report| report.halted = 1);
    }
    vec![message]
}

/// The report of a message.
pub fn reported(message: &Message) -> Report {
    match &message.payload {
        Payload::Report(reports) => reports.first().copied().unwrap_or_default(),
        _ => Report::default(),
    }
}

/// A position some numbers further.
pub fn nudged(state: &mut ImpState, ulps: u32) {
    for _ in 0..ulps {
        state.position[0] = state.position[0].next_up();
    }
}

/// Runs of mutants in this process.
pub static RUNS: AtomicU32 = AtomicU32::new(0);

/// A contact radius that is so much smaller than it is said to be: a power of two, so that nothing is rounded.
pub const SHRUNK: f64 = 128.0;
