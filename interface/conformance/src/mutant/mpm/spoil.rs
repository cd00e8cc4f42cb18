//! What a continuum's mutant can spoil, in a word each.

use std::cell::{Cell, RefCell};
use std::rc::Rc;
use std::sync::atomic::AtomicU32;

use interface::config::MpmConfig;
use interface::control::{Notice, Order};
use interface::stage::{Message, Payload};
use interface::wire::{
    EnvelopeVertex, Grant, GroupState, ImpForce, ImpInfo, ImpState, PointState, Report, StepHeader,
    flags,
};

use crate::mutant::Flaw;

/// One constructor for each kind of record that can be spoilt on its way in or out.
macro_rules! spoil {
    ($($name:ident: $way:ident $payload:ident of $record:ty;)*) => {
        $(pub fn $name(mut spoil: impl FnMut(&mut StepHeader, &mut Vec<$record>) + 'static) -> Flaw {
            Flaw::$way(move |mut message| {
                if let Payload::$payload(records) = &mut message.payload {
                    spoil(&mut message.header, records);
                }
                vec![message]
            })
        })*
    };
}

spoil! {
    grants: inbound Grant of Grant;
    envelopes: inbound Envelopes of EnvelopeVertex;
    forces: inbound Forces of ImpForce;
    set: outbound Set of ImpInfo;
    states: outbound States of ImpState;
    reports: outbound Report of Report;
    groups: outbound Groups of GroupState;
    points: outbound Points of PointState;
}

/// Both at once.
pub fn with(inbound: Flaw, outbound: Flaw) -> Flaw {
    Flaw {
        inbound: inbound.inbound,
        ..outbound
    }
}

/// Every number of the report on a measured step.
pub fn measured(mut spoil: impl FnMut(&mut Report) + 'static) -> Flaw {
    reports(move |_, reports| {
        for report in reports.iter_mut().filter(|r| r.measured == 1) {
            spoil(report);
        }
    })
}

/// Every report.
pub fn report(mut spoil: impl FnMut(&mut Report) + 'static) -> Flaw {
    reports(move |_, reports| reports.iter_mut().for_each(&mut spoil))
}

pub fn each_grant(mut spoil: impl FnMut(&mut Grant) + 'static) -> Flaw {
    grants(move |_, grants| grants.iter_mut().for_each(&mut spoil))
}

/// The configuration, where it parses.
pub fn config(spoil: impl FnMut(&mut MpmConfig) + 'static) -> Flaw {
    Flaw::config(spoil)
}

pub fn ready(spoil: fn(&mut interface::solver::Readiness)) -> Flaw {
    Flaw::notices(move |notice| {
        if let Notice::Ready(ready) = notice {
            spoil(&mut ready.readiness);
        }
    })
}

pub fn words(from: &'static str, to: &'static str) -> Flaw {
    Flaw::notices(move |notice| {
        if let Notice::Failed(failure) = notice {
            failure.message = failure.message.replace(from, to);
        }
    })
}

/// Forces, knowing the header of the states that they answer.
pub fn forces_of_states(
    mut spoil: impl FnMut(&StepHeader, &mut StepHeader, &mut Vec<ImpForce>) + 'static,
) -> Flaw {
    let last = Rc::new(Cell::new(StepHeader::default()));
    let seen = Rc::clone(&last);
    with(
        forces(move |header, forces| spoil(&last.get(), header, forces)),
        states(move |header, _| seen.set(*header)),
    )
}

/// Forces that a right continuum takes.
pub fn right(forces: &[ImpForce]) -> bool {
    forces.iter().all(|f| {
        let finite = f.force.iter().all(|x| x.is_finite());
        finite && (f.stiffness > 0.0 || (f.stiffness == 0.0 && f.force == [0.0; 2]))
    })
}

/// Forces, knowing those before them.
pub fn after_others(mut spoil: impl FnMut(&[ImpForce], &mut [ImpForce]) + 'static) -> Flaw {
    let mut before: Vec<ImpForce> = Vec::new();
    forces(move |_, forces| {
        if right(forces) {
            let now = forces.clone();
            before.resize(forces.len(), ImpForce::default());
            spoil(&before, forces);
            before = now;
        }
    })
}

/// States, knowing the grant that they belong to.
pub fn states_of_grant(mut spoil: impl FnMut(&Grant, &mut ImpState) + 'static) -> Flaw {
    let last = Rc::new(Cell::new(Grant::default()));
    let seen = Rc::clone(&last);
    with(
        each_grant(move |grant| seen.set(*grant)),
        states(move |_, states| {
            for state in states {
                spoil(&last.get(), state);
            }
        }),
    )
}

/// What a mutant knows of the window that it is in.
#[derive(Clone, Copy, Default)]
pub struct Window {
    pub grant: Grant,
    pub bodies_halt: bool,
}

/// Whatever goes out with a report, knowing its window.
pub fn at_report(mut spoil: impl FnMut(&Window, Message) -> Vec<Message> + 'static) -> Flaw {
    let window = Rc::new(RefCell::new(Window::default()));
    let seen = Rc::clone(&window);
    with(
        Flaw::inbound(move |message| {
            match &message.payload {
                Payload::Grant(grants) => {
                    *seen.borrow_mut() = Window {
                        grant: grants.first().copied().unwrap_or_default(),
                        bodies_halt: false,
                    };
                }
                Payload::Forces(_) => {
                    seen.borrow_mut().bodies_halt = message.header.flags & flags::HALT_AFTER != 0;
                }
                _ => {}
            }
            vec![message]
        }),
        Flaw::outbound(move |message| match &message.payload {
            Payload::Report(_) => spoil(&window.borrow(), message),
            _ => vec![message],
        }),
    )
}

pub fn halts(message: Message, halts: bool) -> Vec<Message> {
    let mut message = message;
    if let Payload::Report(reports) = &mut message.payload
        && halts
    {
        for report in reports {
            report.halted = 1;
        }
    }
    vec![message]
}

pub fn reported(message: &Message) -> Report {
    match &message.payload {
        Payload::Report(reports) => reports.first().copied().unwrap_or_default(),
        _ => Report::default(),
    }
}

/// Grants whose first step is made the next one by `choose`.
pub fn first(choose: fn(u64, u64) -> u64) -> Flaw {
    let next = Rc::new(Cell::new(0));
    let seen = Rc::clone(&next);
    with(
        each_grant(move |grant| grant.first = choose(grant.first, next.get())),
        report(move |report| seen.set(report.next)),
    )
}

/// Orders that the hosted solver does not get to see.
pub fn deaf_to(mut hide: impl FnMut(Result<Order, String>) -> bool + 'static) -> Flaw {
    Flaw::inbound(move |message| {
        let order = matches!(message.payload, Payload::Order(_));
        if order && hide(message.as_order()) {
            return Vec::new();
        }
        vec![message]
    })
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
