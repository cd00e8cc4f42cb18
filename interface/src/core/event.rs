//! What a machine of a solver's side is told, and what it asks for.

use std::time::Duration;

use crate::message::control::Party;
use crate::message::wire::{
    ContactState, EnvelopeVertex, ImpForce, ImpInfo, ImpState, Ledger, Limits, PointState,
    StepHeader,
};
use crate::message::{Channel, Records};
use crate::solver::{Answer, Fault, Readiness, Refusal};
use crate::transport::TransportError;

/// What has happened to a solver's side. What is rare is boxed, so that what happens in every step is small.
#[derive(Debug)]
pub enum Event<'a> {
    /// A message has come.
    Received(&'a StepHeader, Records<'a>),
    /// The channels that were to be opened are open.
    Opened,
    /// A message that should have been there ([`Action::Take`]) is not.
    Absent,
    /// What was to be sent has been sent.
    Sent,
    /// The time of a [`Wait`] is over.
    Expired(Duration),
    /// The coupler is gone.
    CouplerGone,
    /// A channel failed.
    Broken(Box<TransportError>),
    /// The solver has done its task.
    Done(Done<'a>),
}

/// What a party does next; `T` is what its solver, or the run, is asked to do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Action<T = Task> {
    /// Open the channels that S-7 asks for before Ready.
    Open {
        /// Also those to the other solver.
        coupled: bool,
    },
    /// Send a message. The machine has its header; its records are what the last task gave, or what the machine itself has
    /// ready.
    Send(Channel),
    /// Wait for a message.
    Wait(Wait),
    /// Take a message that was sent before the one that has just come.
    Take(Channel),
    /// Something for the solver, or for the run.
    Do(T),
    /// The session is over; the machine has its verdict.
    End,
}

/// What is waited for, and how long.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wait {
    /// On these channels.
    pub on: [Option<Channel>; 3],
    /// From whom.
    pub from: Party,
    /// At most so long (clause S-11).
    pub at_most: Duration,
}

impl Wait {
    /// Waits on one channel.
    pub fn on(channel: Channel, at_most: Duration) -> Self {
        Self {
            on: [Some(channel), None, None],
            from: channel.from(),
            at_most,
        }
    }
}

/// Something for a solver to do. The step that it belongs to is `Line::present`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Task {
    /// Take the configuration that the machine has.
    Configure,
    /// Take over the saved state that the machine has.
    Restore,
    /// Give the state before the next step.
    Save,
    /// Give all points (continuum).
    Points,
    /// Give the measurement of the window's first step.
    Measure,
    /// Choose the IMPs anew from the envelopes that have come (continuum).
    Select,
    /// Give the states of the IMPs (continuum).
    States,
    /// The part of the step that needs no forces (continuum).
    Predict,
    /// The rest of it, with the forces that have come, or none in an uncoupled run (continuum).
    Correct,
    /// Give the envelopes of the bodies (bodies).
    Envelopes,
    /// Take the IMP set that has come (bodies).
    TakeSet,
    /// Evaluate contact with the states that have come, or none in an uncoupled run (bodies).
    Contact,
    /// Kick and move the bodies (bodies).
    Advance,
    /// Give the contacts that pressed in the window's first step (bodies).
    ListContacts,
}

/// What came of a [`Task`].
#[derive(Debug)]
pub enum Done<'a> {
    /// The configuration is taken; `fastest` is the speed of the fastest point in m/s (0 for bodies).
    Configured {
        /// What the solver says of itself.
        readiness: Box<Readiness>,
        /// Speed of the fastest point in m/s.
        fastest: f64,
    },
    /// The configuration, or the saved state, is not taken.
    Refused(Box<Refusal>),
    /// The state is taken over; the travel of the points since the last selection is this, in m.
    Restored(f64),
    /// The state.
    Saved(Vec<u8>),
    /// All points.
    Points(&'a [PointState]),
    /// The measurement: its ledger, and groups or bodies.
    Measured(&'a Ledger, Records<'a>),
    /// The IMPs.
    Selected(&'a [ImpInfo]),
    /// Their states.
    States(&'a [ImpState]),
    /// The internal forces are there.
    Predicted,
    /// The step is done; the travel of the points since the last selection is now this, in m.
    Corrected(&'a Limits, f64),
    /// The envelopes.
    Envelopes(&'a [EnvelopeVertex]),
    /// The IMP set is taken.
    SetTaken,
    /// Contact is evaluated.
    Contacts(&'a Answer, &'a [ImpForce]),
    /// The bodies have moved.
    Advanced,
    /// The contacts that pressed.
    Listed(&'a [ContactState]),
    /// The solver cannot go on.
    Failed(Box<Fault>),
}

impl Done<'_> {
    /// What came of [`Task::Configure`]; `fastest` is asked for if the configuration is taken.
    pub(crate) fn configure(
        came: Result<Readiness, Refusal>,
        fastest: impl FnOnce() -> f64,
    ) -> Self {
        match came {
            Ok(readiness) => Self::Configured {
                readiness: readiness.into(),
                fastest: fastest(),
            },
            Err(refusal) => Self::Refused(refusal.into()),
        }
    }

    /// What came of [`Task::Restore`]; `travel` is asked for if the state is taken over.
    pub(crate) fn restore(came: Result<(), Refusal>, travel: impl FnOnce() -> f64) -> Self {
        match came {
            Ok(()) => Self::Restored(travel()),
            Err(refusal) => Self::Refused(refusal.into()),
        }
    }

    /// What came of [`Task::Save`].
    pub(crate) fn save(came: Result<Vec<u8>, Fault>) -> Self {
        match came {
            Ok(state) => Self::Saved(state),
            Err(fault) => Self::Failed(fault.into()),
        }
    }

    /// What came of a part of the step that gives nothing: `done` unless there is a fault.
    pub(crate) fn part(came: Result<(), Fault>, done: Self) -> Self {
        match came {
            Ok(()) => done,
            Err(fault) => Self::Failed(fault.into()),
        }
    }
}
