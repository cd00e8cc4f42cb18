//! The events and actions of the state machines of a solver's side.

use std::time::Duration;

use crate::message::control::Party;
use crate::message::wire::{
    ContactState, EnvelopeVertex, ImpForce, ImpInfo, ImpState, Ledger, Limits, PointState,
    StepHeader,
};
use crate::message::{Channel, Records};
use crate::solver::{Answer, Fault, Readiness, Refusal};
use crate::transport::TransportError;

/// An event on a solver's side. Rare events are boxed, so that those of every step are small.
#[derive(Debug)]
pub enum Event<'a> {
    /// A message has arrived.
    Received(&'a StepHeader, Records<'a>),
    /// The requested channels are open.
    Opened,
    /// A message that should have arrived before ([`Action::Take`]) is missing.
    Absent,
    /// The message has been sent.
    Sent,
    /// The deadline of a [`Wait`] is over.
    Expired(Duration),
    /// The coupler is gone.
    CouplerGone,
    /// A channel failed.
    Broken(Box<TransportError>),
    /// The solver has done its task.
    Done(Done<'a>),
}

/// The next action of a party; `T` is a task for its solver, or a question to the run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Action<T = Task> {
    /// Open the channels that S-7 requires before Ready.
    Open {
        /// Also those to the other solver.
        coupled: bool,
    },
    /// Send a message. The machine has its header. Its records are the result of the last task, or the machine has them
    /// too.
    Send(Channel),
    /// Wait for a message.
    Wait(Wait),
    /// Take a message that was sent before the one that has just arrived.
    Take(Channel),
    /// A task for the solver, or a question to the run.
    Do(T),
    /// The session is over; the machine has its verdict.
    End,
}

/// The channels and the deadline of a wait.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wait {
    /// On these channels.
    pub on: [Option<Channel>; 3],
    /// From whom.
    pub from: Party,
    /// Deadline (clause S-11).
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

/// A task for a solver. Its step is `Line::present`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Task {
    /// Take the configuration that the machine has.
    Configure,
    /// Restore the saved state that the machine has.
    Restore,
    /// Give the state before the next step.
    Save,
    /// Give all points (continuum).
    Points,
    /// Give the measurement of the window's first step.
    Measure,
    /// Choose a new set of IMPs from the envelopes that have arrived (continuum).
    Select,
    /// Give the states of the IMPs (continuum).
    States,
    /// The part of the step that needs no forces (continuum).
    Predict,
    /// The rest of the step, with the forces that have arrived, or none in an uncoupled run (continuum).
    Correct,
    /// Give the envelopes of the bodies (bodies).
    Envelopes,
    /// Take the IMP set that has arrived (bodies).
    TakeSet,
    /// Evaluate contact with the states that have arrived, or none in an uncoupled run (bodies).
    Contact,
    /// Kick and move the bodies (bodies).
    Advance,
    /// Give the contacts that pressed in the window's first step (bodies).
    ListContacts,
}

/// The result of a [`Task`].
#[derive(Debug)]
pub enum Done<'a> {
    /// The configuration is taken; `fastest` is the speed of the fastest point in m/s (0 for bodies).
    Configured {
        /// The properties that the solver reports.
        readiness: Box<Readiness>,
        /// Speed of the fastest point in m/s.
        fastest: f64,
    },
    /// The configuration, or the saved state, is refused.
    Refused(Box<Refusal>),
    /// The state is restored; this is the travel of the points since the last selection, in m.
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
    /// The internal forces are computed.
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
    /// The solver cannot continue.
    Failed(Box<Fault>),
}

impl Done<'_> {
    /// The result of [`Task::Configure`]; `fastest` is called if the configuration is taken.
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

    /// The result of [`Task::Restore`]; `travel` is called if the state is restored.
    pub(crate) fn restore(came: Result<(), Refusal>, travel: impl FnOnce() -> f64) -> Self {
        match came {
            Ok(()) => Self::Restored(travel()),
            Err(refusal) => Self::Refused(refusal.into()),
        }
    }

    /// The result of [`Task::Save`].
    pub(crate) fn save(came: Result<Vec<u8>, Fault>) -> Self {
        match came {
            Ok(state) => Self::Saved(state),
            Err(fault) => Self::Failed(fault.into()),
        }
    }

    /// The result of a part of the step without a value: `done` unless there is a fault.
    pub(crate) fn part(came: Result<(), Fault>, done: Self) -> Self {
        match came {
            Ok(()) => done,
            Err(fault) => Self::Failed(fault.into()),
        }
    }
}
