//! A session: open, configure, step, drain, closed; abort from any of them (PROTOCOL.md section 2).
//!
//! The machines of [`crate::core`] say what to do next; here it is done. A party takes [turns]: each does one thing that
//! its machine asks for, or finds that there is nothing to do but wait. [`turns::drive`] lets one party take turns until
//! its session is over, waiting as a process does; [`together`] lets all three take turns in one thread; a simulation
//! decides by itself whose turn it is.

pub mod leader;
pub mod solver;
mod stopwatch;
pub mod together;
pub mod turns;

use std::time::Duration;

pub use leader::{Lead, Leader, Stop};
pub use solver::{DemSide, MpmSide, serve_dem, serve_mpm};
pub use stopwatch::cpu_time;
use thiserror::Error;

use crate::control::{Failure, Party};
use crate::recording::RecordingError;
use crate::solver::{Fault, Refusal};
use crate::transport::TransportError;

/// Clause S-11: who waits for a party that itself waits for another is this much more patient with it, so that the one
/// who waits for the silent party is the first to lose patience and names the right one.
pub(crate) const PATIENCE_WITH_WAITERS: Duration = Duration::from_secs(1);

/// Why a session ended before it was closed.
#[derive(Debug, Error)]
pub enum SessionError {
    /// A channel could not be made, opened or used.
    #[error(transparent)]
    Channel(#[from] TransportError),
    /// What crosses cannot be recorded.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The coupler ended the session.
    #[error("the coupler ended the session: {0}")]
    Aborted(String),
    /// The coupler's process is gone.
    #[error("the coupler is gone (step {step})")]
    CouplerGone {
        /// Step at which it was noticed.
        step: u64,
    },
    /// A party's process ended without a word.
    #[error("the {who} solver {how} at step {step}")]
    Vanished {
        /// Whose process.
        who: Party,
        /// How it ended, such as "was killed by signal 9".
        how: String,
        /// First step that it had not yet reported.
        step: u64,
    },
    /// A party did not answer in time.
    #[error("nothing from the {who} for {waited:.1?} at step {step}: {awaited}")]
    Late {
        /// Who should have answered.
        who: Party,
        /// What was waited for.
        awaited: &'static str,
        /// At which step.
        step: u64,
        /// How long.
        waited: Duration,
    },
    /// A party broke a clause of PROTOCOL.md.
    #[error("the {who} broke clause {clause} of the protocol at step {step}: {message}")]
    Contract {
        /// Who.
        who: Party,
        /// Number of the clause.
        clause: &'static str,
        /// At which step.
        step: u64,
        /// The numbers that show it.
        message: String,
    },
    /// The own solver cannot go on.
    #[error("step {step}: {fault}")]
    Fault {
        /// In which step.
        step: u64,
        /// Why.
        fault: Fault,
    },
    /// The solver did not take its configuration.
    #[error("the {who} refused its part of the scene: {refusal}")]
    Refused {
        /// Who.
        who: Party,
        /// What and why.
        refusal: Refusal,
    },
    /// A solver said why it cannot go on.
    #[error("the {who} stopped at step {}: {}", failure.step, failure.message)]
    Failed {
        /// Who.
        who: Party,
        /// Its own words.
        failure: Failure,
    },
}
