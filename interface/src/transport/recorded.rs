//! A transport that wraps another one and records its messages.

use std::time::Duration;

use super::{Transport, TransportError};
use crate::message::control::Party;
use crate::message::wire::StepHeader;
use crate::message::{Channel, Payload, Records};
use crate::recording::RecordingSink;
use crate::transport::liveness::Hold;

/// Records every message that is sent or received through it, on the channels that `notes` selects.
pub struct Recorded {
    inner: Box<dyn Transport>,
    sink: RecordingSink,
    notes: fn(Channel) -> bool,
}

impl Recorded {
    /// Wraps `inner` and adds to `sink` the messages of the channels that `notes` selects.
    pub fn new(inner: Box<dyn Transport>, sink: RecordingSink, notes: fn(Channel) -> bool) -> Self {
        Self { inner, sink, notes }
    }
}

impl Transport for Recorded {
    fn open(&mut self, channels: &[Channel]) -> Result<(), TransportError> {
        self.inner.open(channels)
    }

    fn send(
        &mut self,
        channel: Channel,
        header: &StepHeader,
        records: Records<'_>,
    ) -> Result<(), TransportError> {
        if (self.notes)(channel) {
            self.sink.note(channel, header, records);
        }
        self.inner.send(channel, header, records)
    }

    fn receive(
        &mut self,
        channel: Channel,
        into: &mut Payload,
    ) -> Result<Option<StepHeader>, TransportError> {
        let header = self.inner.receive(channel, into)?;
        if let Some(header) = &header
            && (self.notes)(channel)
        {
            self.sink.note(channel, header, into.records());
        }
        Ok(header)
    }

    fn wake(&mut self, to: Party) {
        self.inner.wake(to);
    }

    fn sleep(&mut self, from: Party, at_most: Duration) -> u64 {
        self.inner.sleep(from, at_most)
    }

    fn coupler_lives(&self) -> bool {
        self.inner.coupler_lives()
    }

    fn held(&self) -> Option<(Party, Hold)> {
        self.inner.held()
    }
}
