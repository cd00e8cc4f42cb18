//! The messages to and from a solver, each channel in its order.

use std::collections::{BTreeMap, VecDeque};
use std::path::Path;

use crate::message::control::Party;
use thiserror::Error;

use crate::message::{Kind, Message};
use crate::recording::{Playback, RecordingError};
use crate::transport::TransportError;

/// A recording could not be replayed.
#[derive(Debug, Error)]
pub enum ReplayError {
    /// The recording cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The solver is not in it.
    #[error("the recording has no {0}: nothing to replay it against")]
    Absent(Party),
    /// A message is not what its channel carries, or comes in an impossible order.
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
    Channel(#[from] TransportError),
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

/// The part of a recording that one solver has in it, read as far as it is asked for.
pub(super) struct Script {
    playback: Playback,
    party: Party,
    /// Orders and grants: both are the coupler's, so their order is that in the file.
    lead: VecDeque<Message>,
    /// The rest, channel by channel: between channels the file's order is only nearly that of the run.
    others: BTreeMap<Kind, VecDeque<Message>>,
}

impl Script {
    /// Of `party`'s part in the recording.
    pub(super) fn open(path: &Path, party: Party) -> Result<Self, ReplayError> {
        let mut script = Self {
            playback: Playback::open(path)?,
            party,
            lead: VecDeque::new(),
            others: BTreeMap::new(),
        };
        while script.lead.is_empty() {
            if !script.read()? {
                return Err(ReplayError::Absent(party));
            }
        }
        Ok(script)
    }

    /// The next order or grant.
    pub(super) fn lead(&mut self) -> Result<Option<Message>, ReplayError> {
        while self.lead.is_empty() && self.read()? {}
        Ok(self.lead.pop_front())
    }

    /// The next message of another kind.
    pub(super) fn next(&mut self, kind: Kind) -> Result<Option<Message>, ReplayError> {
        self.peek(kind)?;
        Ok(self.others.get_mut(&kind).and_then(VecDeque::pop_front))
    }

    /// The same, which stays the next.
    pub(super) fn peek(&mut self, kind: Kind) -> Result<Option<&Message>, ReplayError> {
        while self.others.get(&kind).is_none_or(VecDeque::is_empty) && self.read()? {}
        Ok(self.others.get(&kind).and_then(VecDeque::front))
    }

    /// Reads one message of the solver's channels; false at the end.
    fn read(&mut self) -> Result<bool, ReplayError> {
        while let Some((channel, message)) = self.playback.message()? {
            if !channel.is_of(self.party) {
                continue;
            }
            let kind = channel.kind;
            if matches!(kind, Kind::Order | Kind::Grant) {
                self.lead.push_back(message);
            } else {
                self.others.entry(kind).or_default().push_back(message);
            }
            return Ok(true);
        }
        Ok(false)
    }
}
