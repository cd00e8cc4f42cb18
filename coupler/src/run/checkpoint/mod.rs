//! Checkpoints: the whole state of a run, from which `tandem resume` goes on to the same bits.
//!
//! A grant asks the solvers for their states before its first step (PROTOCOL.md K-3); the coupler adds its own of the
//! same moment. [`mod@file`] is what they look like on disk, [`keeper`] the thread that writes them.

pub mod file;
pub(crate) mod keeper;
mod state;

pub(crate) use file::Checkpoint;
pub(crate) use state::{CouplerState, Phase, UnderWay};
