//! What a mutant does wrong.

use interface::message::control::{Configure, Notice, Order};
use interface::message::wire::{
    BodyState, ContactState, EnvelopeVertex, Grant, GroupState, ImpForce, ImpInfo, ImpState,
    PointState, Report, StepHeader,
};
use interface::transport::raw::{Message, Payload};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// A solver that breaks one clause.
#[derive(Clone, Copy)]
pub struct Mutant {
    /// What it does wrong.
    pub what: &'static str,
    /// Makes its flaw, afresh for every run.
    pub flaw: fn() -> Flaw,
}

/// What to pass on instead of a message: nothing, the message, or several.
pub type Pass = Box<dyn FnMut(Message) -> Vec<Message>>;

/// What a mutant does wrong.
pub struct Flaw {
    /// To what passes, whichever way: a kind of message goes one way only.
    pub pass: Pass,
    /// Outside the messages.
    pub process: ProcessFlaws,
}

/// Flaws of the solver as a process, besides its messages.
#[expect(
    clippy::struct_excessive_bools,
    reason = "each is the flaw of one mutant"
)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ProcessFlaws {
    /// Exit status after Close, instead of 0.
    pub status_closed: Option<u8>,
    /// Exit status after anything else, instead of 3.
    pub status_failed: Option<u8>,
    /// Exit status when there is nothing to join, instead of 2.
    pub status_unjoined: Option<u8>,
    /// Opens where it measures to only after it has said Ready.
    pub opens_late: bool,
    /// Wakes nobody.
    pub wakes_nobody: bool,
    /// Looks for messages only when somebody has woken it.
    pub waits_to_be_woken: bool,
    /// Ends when it has said Bye.
    pub goes_at_bye: bool,
    /// Does not look whether the coupler lives.
    pub never_looks_up: bool,
    /// Does not look whether the coupler lives between a grant and the report.
    pub never_looks_up_in_a_step: bool,
    /// Does not keep the file by which it notes that it takes part.
    pub joins_without_note: bool,
    /// Removes the run's lock when it ends.
    pub removes_the_lock: bool,
    /// Ends without a word when no grant comes.
    pub gives_up_silently: bool,
    /// Ends on Ctrl-C.
    pub ends_on_interrupt: bool,
}

impl Flaw {
    /// None: what passes is not changed.
    pub fn none() -> Self {
        Self::passing(|message| vec![message])
    }

    /// Changes what passes.
    pub fn passing(pass: impl FnMut(Message) -> Vec<Message> + 'static) -> Self {
        Self {
            pass: Box::new(pass),
            process: ProcessFlaws::default(),
        }
    }

    /// Changes each message that passes.
    pub fn each(mut change: impl FnMut(&mut Message) + 'static) -> Self {
        Self::passing(move |mut message| {
            change(&mut message);
            vec![message]
        })
    }

    /// Behaves badly.
    pub fn process(change: impl FnOnce(&mut ProcessFlaws)) -> Self {
        let mut flaw = Self::none();
        change(&mut flaw.process);
        flaw
    }

    /// This one, and then another one.
    #[must_use]
    pub fn with(self, other: Self) -> Self {
        let (mut first, mut then) = (self.pass, other.pass);
        Self {
            pass: Box::new(move |message| first(message).into_iter().flat_map(&mut then).collect()),
            process: self.process,
        }
    }

    /// Changes notices.
    pub fn notices(mut change: impl FnMut(&mut Notice) + 'static) -> Self {
        Self::passing(move |message| match message.as_notice() {
            Ok(mut notice) => {
                change(&mut notice);
                vec![Message::notice(message.header.step, &notice)]
            }
            Err(_) => vec![message],
        })
    }

    /// Changes the Configure that the solver gets to see.
    pub fn configure(mut change: impl FnMut(&mut Configure) + 'static) -> Self {
        Self::passing(move |message| match message.as_order() {
            Ok(Order::Configure(mut configure)) => {
                change(&mut configure);
                vec![Message::order(&Order::Configure(configure))]
            }
            _ => vec![message],
        })
    }

    /// Changes a configuration, where it parses; one that is left as it was keeps its bytes.
    pub fn config<C: Clone + PartialEq + Serialize + DeserializeOwned>(
        mut change: impl FnMut(&mut C) + 'static,
    ) -> Self {
        Self::configure(move |configure| {
            if let Ok(config) = serde_json::from_str::<C>(&configure.config) {
                let mut changed = config.clone();
                change(&mut changed);
                if changed != config {
                    configure.config = serde_json::to_string(&changed).expect("it was JSON before");
                }
            }
        })
    }
}

/// For each kind of record a constructor that changes the header and all records of a message, and one that changes each
/// record.
macro_rules! change {
    ($($all:ident, $one:ident: $payload:ident of $record:ty;)*) => {
        impl Flaw {
            $(#[doc = concat!("Changes messages of [`Payload::", stringify!($payload), "`].")]
            pub fn $all(mut change: impl FnMut(&mut StepHeader, &mut Vec<$record>) + 'static) -> Self {
                Self::each(move |message| {
                    if let Payload::$payload(records) = &mut message.payload {
                        change(&mut message.header, records);
                    }
                })
            }

            #[doc = concat!("Changes each record of [`Payload::", stringify!($payload), "`].")]
            pub fn $one(mut change: impl FnMut(&mut $record) + 'static) -> Self {
                Self::$all(move |_, records| records.iter_mut().for_each(&mut change))
            })*
        }
    };
}

change! {
    grants, grant: Grant of Grant;
    set, info: Set of ImpInfo;
    states, state: States of ImpState;
    forces, force: Forces of ImpForce;
    envelopes, vertex: Envelopes of EnvelopeVertex;
    reports, report: Report of Report;
    bodies, body: Bodies of BodyState;
    contacts, contact: Contacts of ContactState;
    groups, group: Groups of GroupState;
    points, point: Points of PointState;
}
