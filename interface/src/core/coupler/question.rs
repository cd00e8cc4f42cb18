//! The events of the coupler's machine, its questions to the run, and the results of a grant.

use std::time::Duration;

use crate::message::control::{Configure, Party};
use crate::message::wire::{BodyState, ContactState, Grant, GroupState, PointState, StepHeader};
use crate::message::{Channel, Records};
use crate::transport::TransportError;

/// An event on the coupler's side.
#[derive(Debug)]
pub enum Event<'a> {
    /// A message has arrived.
    Received(Channel, StepHeader, Records<'a>),
    /// A message that should have been sent before ([`Action::Take`](crate::core::Action::Take)) is missing.
    Absent(Channel),
    /// The message has been sent.
    Sent,
    /// The deadline of a [`Wait`](crate::core::Wait) is over.
    Expired(Duration),
    /// A solver's process has ended, with how it ended.
    Gone(Party, String),
    /// A channel failed.
    Broken(TransportError),
    /// The run cannot continue, for this reason.
    Stopped(String),
    /// The run has answered the question.
    Done(Decision),
}

/// A question to the run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Question {
    /// All solvers have sent Hello: what is the configuration of each?
    Configure,
    /// All solvers are ready.
    Ready,
    /// What comes next?
    Next,
    /// The reports on the last grant have come.
    Collected,
    /// All points have arrived, at the end.
    Drained,
}

/// An answer of the run.
#[derive(Debug)]
pub enum Decision {
    /// The configuration of each solver, in the order of the solvers.
    Configure(Vec<Part>),
    /// Steps, and the budgets of each solver in the order of the solvers.
    Grant(Grant, Vec<[f64; 3]>),
    /// No more steps.
    Drain,
    /// The run has taken note.
    Noted,
}

/// The configuration of one solver.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// Its part of the scene.
    pub configure: Configure,
    /// Groups or bodies in it: records of a measurement.
    pub measured: usize,
    /// The saved state from which it continues.
    pub restore: Option<Vec<u8>>,
}

/// The reports of the solvers on the last grant.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Round {
    /// The grant, without budgets.
    pub grant: Grant,
    /// Steps that both have done.
    pub steps: u64,
    /// Whether both may continue with the same step (clause L-5).
    pub within: bool,
    /// Point groups, if measured.
    pub groups: Vec<GroupState>,
    /// Bodies, if measured.
    pub bodies: Vec<BodyState>,
    /// All points, if a frame was asked for, and at the end.
    pub points: Vec<PointState>,
    /// Contacts, if a frame was requested and the bodies' side reports them.
    pub contacts: Vec<ContactState>,
}
