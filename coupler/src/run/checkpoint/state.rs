//! The coupler's own state at a checkpoint.

use interface::message::wire::{BodyState, flags};
use serde::{Deserialize, Serialize};

use crate::record::Sealed;
use crate::record::frames::Listed;
use crate::run::account::Kept;
use crate::run::pace::Epoch;
use crate::run::stability::{Budgets, Sides};
use crate::scene::Scene;

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
    pub budgets: Budgets,
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
    pub asked: u64,
    pub sides: Sides,
    pub bodies: Vec<BodyState>,
    /// The bodies at their initial positions.
    pub origin: Vec<BodyState>,
    /// The rows of `history.csv` and of `course.csv`.
    pub history: Sealed,
    pub course: Sealed,
    pub frames: Listed,
    /// Length of the recording in bytes, if the run is recorded.
    pub recording: Option<u64>,
}

impl CouplerState {
    /// A value that no run of `scene` can have. The hash of a checkpoint detects damage, but not who wrote it.
    pub fn impossible_value(&self, scene: &Scene) -> Option<&'static str> {
        let bodies = scene.dem.as_ref().map_or(0, |dem| dem.bodies.len());
        let Epoch { dt, steps, .. } = self.under_way.epoch;
        let measures = [0, flags::MEASURE, flags::MEASURE | flags::FRAME];
        let other_bodies = |list: &[BodyState]| !list.is_empty() && list.len() != bodies;
        if !measures.contains(&self.asked) {
            Some("it asks for what no grant can")
        } else if other_bodies(&self.bodies) || other_bodies(&self.origin) {
            Some("it has another number of bodies")
        } else if !(dt.is_finite() && dt >= 0.0) || self.under_way.done >= steps {
            Some("its epoch is none")
        } else if !self.account.is_countable() {
            Some("no run has so many steps or epochs")
        } else {
            None
        }
    }

    /// Whether only the closing step is left.
    pub fn is_at_end(&self) -> bool {
        self.phase == Phase::Done
    }
}
