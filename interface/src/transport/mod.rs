//! The transport of messages: one object-safe trait and its implementations.
//!
//! [`iceoryx`] is shared memory between processes, by iceoryx2, [`direct`] a queue between
//! parties that take turns in one thread. The crate `simulation` has a simulated transport.

pub mod direct;
pub mod domain;
pub mod iceoryx;
pub mod liveness;
mod names;
pub mod remains;
pub mod vanished;
pub mod wait;
pub mod wake;

use std::time::Duration;

use thiserror::Error;

use crate::message::control::Party;
use crate::message::wire::StepHeader;
use crate::message::{Channel, Message, Records};
use crate::transport::domain::DomainError;
use crate::transport::liveness::Hold;

/// A channel could not be made, opened or used.
#[derive(Debug, Error)]
pub enum TransportError {
    /// The run's names cannot be used.
    #[error(transparent)]
    Domain(#[from] DomainError),
    /// The transport returned an error.
    #[error("channel {channel}: cannot {action}: {reason}")]
    Refused {
        /// Name of the channel.
        channel: String,
        /// What was tried.
        action: &'static str,
        /// The transport's error.
        reason: String,
    },
    /// This party does not send or receive on this channel, or has not opened it.
    #[error("channel {0}: its end is not open here")]
    NotHere(&'static str),
    /// The bytes of a message are not whole records (clause C-4).
    #[error("channel {channel}: a message of {bytes} bytes, which are not whole records (C-4)")]
    Torn {
        /// Name of the channel.
        channel: &'static str,
        /// Its length.
        bytes: usize,
    },
    /// The receiver has not taken what was sent before.
    #[error("channel {channel}: full; the receiver has stopped taking messages")]
    Full {
        /// Name of the channel.
        channel: String,
    },
}

/// One party's ends of the channels of a run. What has a default here needs nothing where all parties share a thread.
pub trait Transport {
    /// Opens a solver's ends of these channels, as it does before its Ready ([`Channel::before_ready`]).
    ///
    /// # Errors
    /// [`TransportError`].
    fn open(&mut self, _channels: &[Channel]) -> Result<(), TransportError> {
        Ok(())
    }

    /// Sends `records` under `header`, which is not changed. The receiver can take the message at once, and in order
    /// with everything that this party has sent to it before.
    ///
    /// # Errors
    /// [`TransportError::Full`] if the receiver takes nothing.
    fn send(
        &mut self,
        channel: Channel,
        header: &StepHeader,
        records: Records<'_>,
    ) -> Result<(), TransportError>;

    /// Copies the next message of the channel to `into`, whose memory is reused; returns whether there is one. It must be a
    /// copy, because a peer can write to shared memory at any time, and what has been checked must not change (clause C-5).
    ///
    /// # Errors
    /// [`TransportError`].
    fn receive(&mut self, channel: Channel, into: &mut Message) -> Result<bool, TransportError>;

    /// Wakes `to` for a message (clause B-2). A failure is not an error: the other side looks again by itself (clause B-3).
    fn wake(&mut self, _to: Party) {}

    /// Blocks until `from` has woken this party since the last call, for `at_most` at most; returns how often it has. Messages
    /// are looked for between two calls (clause B-3).
    fn sleep(&mut self, _from: Party, _at_most: Duration) -> u64 {
        0
    }

    /// Whether the coupler lives (for a solver; clause O-4).
    fn coupler_lives(&self) -> bool;

    /// Another party of the run that is alive and does not run, with the reason. While there is one, silence does not
    /// count (clause S-11). In one thread there is none.
    fn held(&self) -> Option<(Party, Hold)> {
        None
    }
}

/// A party's ends of its channels.
pub type Ends = Box<dyn Transport>;

impl dyn Transport + '_ {
    /// Sends a message as it is, and wakes its receiver as B-2 says.
    ///
    /// # Errors
    /// As [`Transport::send`].
    pub fn send_and_wake(
        &mut self,
        channel: Channel,
        message: &Message,
    ) -> Result<(), TransportError> {
        self.send(channel, &message.header, message.payload.records())?;
        if channel.wakes() {
            self.wake(channel.to());
        }
        Ok(())
    }

    /// The next message of the channel, if there is one.
    ///
    /// # Errors
    /// As [`Transport::receive`].
    pub fn take(&mut self, channel: Channel) -> Result<Option<Message>, TransportError> {
        let mut message = Message::empty(channel.kind);
        let received = self.receive(channel, &mut message)?;
        Ok(received.then_some(message))
    }
}
