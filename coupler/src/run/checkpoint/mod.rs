//! Checkpoints: the complete state of a run, from which `tandem resume` continues to the same bits.
//!
//! A grant asks the solvers for their states before its first step (PROTOCOL.md K-3); the coupler adds its own state at
//! the same step. [`mod@file`] is the format on disk, [`writer`] the thread that writes checkpoints, [`branch`] a scene
//! that begins with a checkpoint of another run.

pub mod branch;
pub mod file;
mod state;
pub(crate) mod writer;

pub(crate) use file::Checkpoint;
pub(crate) use state::{CouplerState, Phase, UnderWay};

use branch::Branch;

/// What a run begins with.
#[derive(Debug)]
pub(crate) enum Origin {
    /// What its scene describes.
    Scene,
    /// The same, and its recording has what it did before.
    Recording,
    /// The state of the same run; of a solver that could not save its own, what the recording has of it.
    Itself(Box<Checkpoint>),
    /// The state of another run.
    Another(Box<Branch>),
}
