//! Why a replay is over before the recorded session is closed.

use interface::message::control::Party;
use interface::recording::RecordingError;
use interface::transport::raw::ChannelError;
use thiserror::Error;

/// A recording could not be replayed.
#[derive(Debug, Error)]
pub enum ReplayError {
    /// The recording cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// It is not of such a run.
    #[error("the recording has no {0}: nothing to replay it against")]
    Absent(Party),
    /// A message of the recording is not what its channel carries, or comes in an impossible order.
    #[error("the recording is inconsistent: {0}")]
    Senseless(String),
    /// A value for the configuration has no place in it.
    #[error("--set {0}")]
    Override(String),
    /// The solver could not be started.
    #[error("cannot start the {0} solver: {1}")]
    Start(Party, std::io::Error),
    /// The channels do not work.
    #[error(transparent)]
    Channel(#[from] ChannelError),
    /// The solver ended, failed or fell silent, and had not when it was recorded.
    #[error("the {party} solver at step {step}: {how}")]
    Solver {
        /// Its side.
        party: Party,
        /// First step that was not replayed.
        step: u64,
        /// What it did.
        how: String,
    },
}

/// Why the play is over before the recorded session is closed.
pub(super) enum Stop {
    /// The recording has no more of what comes next.
    Over,
    /// The answers are so different that the rest of the recording does not fit them.
    Diverged,
    /// The solver failed, with the same words as then.
    FailedAsRecorded(String),
    Error(ReplayError),
}

impl<E: Into<ReplayError>> From<E> for Stop {
    fn from(error: E) -> Self {
        Self::Error(error.into())
    }
}
