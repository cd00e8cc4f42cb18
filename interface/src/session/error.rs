//! Why a session ended before it was closed.

use std::time::Duration;

use thiserror::Error;

use crate::message::control::{Failure, Party};
use crate::recording::RecordingError;
use crate::solver::{Fault, Refusal};
use crate::transport::TransportError;

/// Why a session ended before it was closed.
#[derive(Debug, Error)]
pub enum SessionError {
    /// A channel could not be made, opened or used.
    #[error(transparent)]
    Channel(#[from] TransportError),
    /// The messages cannot be recorded.
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
    /// A party's process ended without a last notice.
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
    /// The party's own solver cannot continue.
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
    /// A solver reported why it cannot continue.
    #[error(
        "the {who} {} at step {}: {}",
        if failure.fault.is_some() { "stopped" } else { "ended the session" },
        failure.step,
        failure.message
    )]
    Failed {
        /// Who.
        who: Party,
        /// What it reported.
        failure: Failure,
    },
}

/// Clause S-11: a party that waits for one which itself waits for another has a deadline that is longer by this. So the
/// deadline of the party that waits for the silent one is over first, and the right party is named.
pub(crate) const INDIRECT_WAIT_MARGIN: Duration = Duration::from_secs(1);

/// A clause that somebody broke.
pub(crate) fn broken(who: Party, clause: &'static str, step: u64, message: String) -> SessionError {
    SessionError::Contract {
        who,
        clause,
        step,
        message,
    }
}
