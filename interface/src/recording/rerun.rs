//! A run that does again what it did, because one of its solvers cannot save its state: its messages are compared with
//! its recording. A run that starts again adds later messages to it.

use std::collections::VecDeque;
use std::path::Path;

use super::playback::Begin;
use super::{Message, Playback, RecordingError};
use crate::message::control::Party;
use crate::message::wire::{Grant, StepHeader, flags};
use crate::message::{CHANNELS, Channel, Kind};

/// Bytes of a report that depend on the machine and not on the run: its times.
const OF_THE_MACHINE: std::ops::Range<usize> = 56..88;
/// Bytes of the flags of a grant.
const FLAGS: std::ops::Range<usize> = 24..32;

/// The grant with which the recording at `path` began to end its run: the closing step.
///
/// # Errors
/// [`RecordingError`].
pub(super) fn closing(path: &Path) -> Result<Option<Grant>, RecordingError> {
    let mut playback = Playback::open(path)?;
    // The first step of a run has no length either, so it must not be mistaken for the closing step.
    let mut stepped = false;
    while let Some(message) = playback.message()? {
        if message.channel.kind == Kind::Grant
            && let Some([grant]) = message.records::<Grant>().as_deref()
        {
            if grant.dt == 0.0 && stepped {
                return Ok(Some(*grant));
            }
            stepped |= grant.dt > 0.0;
        }
    }
    Ok(None)
}

/// The recording that a run is compared with.
pub(super) struct Reference {
    playback: Playback,
    /// Where new messages are added.
    end: Begin,
    /// Only what this solver sends or receives, if it is one's.
    of: Option<Party>,
    /// Messages of each channel that have been read and not compared yet.
    ahead: [VecDeque<Message>; CHANNELS],
}

impl std::fmt::Debug for Reference {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Reference up to {:?}", self.end)
    }
}

impl Reference {
    /// Compares with a recording up to `end`.
    pub fn new(playback: Playback, end: Begin) -> Self {
        Self {
            playback,
            end,
            of: None,
            ahead: std::array::from_fn(|_| VecDeque::new()),
        }
    }

    /// All of a recording, for what one solver sends and receives. Its orders are left out: nobody asks for them.
    pub fn of(solver: Party, playback: Playback) -> Self {
        let end = Begin {
            byte: u64::MAX,
            ..Begin::default()
        };
        Self {
            of: Some(solver),
            ..Self::new(playback, end)
        }
    }

    /// Which file.
    pub fn path(&self) -> &Path {
        self.playback.path()
    }

    /// The next message of a channel, without taking it; `None` at the end of the recording.
    pub fn peek(&mut self, channel: Channel) -> Result<Option<&Message>, RecordingError> {
        let number = channel.number();
        while self.ahead[number].is_empty() && self.playback.next_byte() < self.end.byte {
            let Some(message) = self.playback.message()? else {
                break;
            };
            let channel = message.channel;
            let concerns = |solver| channel.is_of(solver) && channel.kind != Kind::Order;
            if self.of.is_none_or(concerns) {
                self.ahead[channel.number()].push_back(message);
            }
        }
        Ok(self.ahead[number].front())
    }

    /// The next message of a channel.
    pub fn take(&mut self, channel: Channel) -> Result<Option<Message>, RecordingError> {
        self.peek(channel)?;
        Ok(self.ahead[channel.number()].pop_front())
    }

    /// Whether a message is the one that was recorded; `None` at the end of the recording.
    pub fn compare(
        &mut self,
        channel: Channel,
        header: &StepHeader,
        payload: &[u8],
    ) -> Result<Option<bool>, RecordingError> {
        let recorded = self.take(channel)?;
        Ok(recorded.map(|recorded| agrees(&recorded, header, payload)))
    }
}

fn agrees(recorded: &Message, header: &StepHeader, payload: &[u8]) -> bool {
    let (then, now) = (&recorded.payload[..], payload);
    match recorded.channel.kind {
        // They contain process ids, versions and numbers of threads, which may differ.
        Kind::Order | Kind::Notice => true,
        Kind::Report => {
            let rest = OF_THE_MACHINE;
            then.len() == now.len()
                && then.get(..rest.start) == now.get(..rest.start)
                && then.get(rest.end..) == now.get(rest.end..)
        }
        Kind::Grant => {
            recorded.header == *header && without_checkpoint(then) == without_checkpoint(now)
        }
        _ => recorded.header == *header && then == now,
    }
}

/// A grant but for whether it asks for a saved state, which may depend on the time of day.
fn without_checkpoint(grant: &[u8]) -> Option<(&[u8], u64, &[u8])> {
    let asked = u64::from_le_bytes(grant.get(FLAGS)?.try_into().ok()?);
    Some((
        &grant[..FLAGS.start],
        asked & !flags::CHECKPOINT,
        &grant[FLAGS.end..],
    ))
}
