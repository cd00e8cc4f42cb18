//! Checkpoints: the whole state of a run, from which `tandem resume` goes on to the same bits.
//!
//! A grant asks the solvers for their states before its first step (PROTOCOL.md K-3); the coupler adds its own of the
//! same moment. [`file`] is what they look like on disk, [`keeper`] the thread that writes them.

pub mod file;
pub(crate) mod keeper;

use interface::message::control::Party;
use interface::message::wire::BodyState;
use serde::{Deserialize, Serialize};

use crate::record::frames::Listed;
use crate::run::account::Kept;
use crate::run::pace::Epoch;
use crate::run::stability::{Budgets, Sides};

/// Where a run is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Phase {
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
    /// Length of the history in bytes.
    pub history: u64,
    pub frames: Listed,
}

/// The whole state of a run.
#[derive(Debug, Clone)]
pub(crate) struct Checkpoint {
    pub about: file::About,
    pub state: CouplerState,
    /// What each solver has saved.
    pub solvers: Vec<(Party, Vec<u8>)>,
}
