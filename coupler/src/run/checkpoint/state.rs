//! The coupler's own state at a checkpoint.

use interface::message::wire::BodyState;
use serde::{Deserialize, Serialize};

use crate::record::frames::Listed;
use crate::run::account::Kept;
use crate::run::pace::Epoch;
use crate::run::stability::{Budgets, Sides};

/// Where a run is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Phase {
    /// The closing step of the run that this one begins with comes next.
    Arriving,
    /// The opening step comes next: nothing moves.
    Opening,
    /// Steps to the end.
    Stepping,
    /// The closing step comes next: the last half kick brings the velocities to the time of the positions.
    Closing,
    /// No more steps.
    Done,
}

/// An epoch under way.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(crate) struct UnderWay {
    pub epoch: Epoch,
    pub budgets: Budgets,
    /// Steps of it that are done.
    pub done: u64,
}

/// The coupler's own state before a grant.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct CouplerState {
    pub account: Kept,
    pub phase: Phase,
    pub under_way: UnderWay,
    /// Flags of the grant, but for CHECKPOINT.
    pub asked: u64,
    pub sides: Sides,
    pub bodies: Vec<BodyState>,
    /// The bodies where the scene puts them.
    pub origin: Vec<BodyState>,
    /// Length of the history in bytes.
    pub history: u64,
    pub frames: Listed,
}

impl CouplerState {
    /// Whether no step is left but the closing one.
    pub fn is_at_end(&self) -> bool {
        self.phase == Phase::Done
    }
}
