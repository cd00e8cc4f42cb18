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

/// The state with which a run begins.
#[derive(Debug)]
pub(crate) enum Origin {
    /// That of its scene.
    Scene,
    /// A state of the same run.
    Itself(Box<Checkpoint>),
    /// A state of another run.
    Another(Box<Branch>),
}
