//! The coupler's own state at a checkpoint.

use interface::message::wire::{BodyState, Budget};
use serde::{Deserialize, Serialize};

use crate::record::Sealed;
use crate::record::frames::Listed;
use crate::run::account::Kept;
use crate::run::pace::Epoch;
use crate::run::stability::Sides;

/// The phase of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Phase {
    /// Next is the closing step of the run with which this one begins.
    Arriving,
    /// Next is the opening step, in which nothing moves.
    Opening,
    /// Steps to the end.
    Stepping,
    /// Next is the closing step: the last half kick brings the velocities to the time of the positions.
    Closing,
    /// No more steps.
    Done,
}

/// The present epoch.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(crate) struct UnderWay {
    pub epoch: Epoch,
    pub budgets: Sides<Budget>,
    /// Number of its steps that are done.
    pub done: u64,
}

/// The coupler's own state before a grant.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct CouplerState {
    pub account: Kept,
    pub phase: Phase,
    pub under_way: UnderWay,
    /// Flags of the grant, except CHECKPOINT.
    pub flags: u64,
    pub sides: Sides,
    pub bodies: Vec<BodyState>,
    /// The bodies at their initial positions.
    pub origin: Vec<BodyState>,
    /// The rows of `history.csv` and of `course.csv`.
    pub history: Sealed,
    pub course: Sealed,
    pub frames: Listed,
}
