//! A transport that wraps another one and records its messages.

use std::time::Duration;

use super::{Transport, TransportError};
use crate::message::control::Party;
use crate::message::wire::StepHeader;
use crate::message::{Channel, Payload, Records};
use crate::recording::RecordingSink;
use crate::transport::liveness::Hold;

/// Records every message that is sent or received through it, on the channels that `notes` selects.
pub struct Recorded<T> {
    inner: T,
    sink: RecordingSink,
    notes: fn(Channel) -> bool,
}

impl<T: Transport> Recorded<T> {
    /// Wraps `inner` and adds to `sink` the messages of the channels that `notes` selects.
    pub fn new(inner: T, sink: RecordingSink, notes: fn(Channel) -> bool) -> Self {
        Self { inner, sink, notes }
    }
}

impl<T: Transport> Transport for Recorded<T> {
    fn open_measurement(&mut self) -> Result<(), TransportError> {
        self.inner.open_measurement()
    }

    fn open_exchange(&mut self) -> Result<(), TransportError> {
        self.inner.open_exchange()
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

impl<T: Transport + ?Sized> Transport for Box<T> {
    fn open_measurement(&mut self) -> Result<(), TransportError> {
        (**self).open_measurement()
    }

    fn open_exchange(&mut self) -> Result<(), TransportError> {
        (**self).open_exchange()
    }

    fn send(
        &mut self,
        channel: Channel,
        header: &StepHeader,
        records: Records<'_>,
    ) -> Result<(), TransportError> {
        (**self).send(channel, header, records)
    }

    fn receive(
        &mut self,
        channel: Channel,
        into: &mut Payload,
    ) -> Result<Option<StepHeader>, TransportError> {
        (**self).receive(channel, into)
    }

    fn wake(&mut self, to: Party) {
        (**self).wake(to);
    }

    fn sleep(&mut self, from: Party, at_most: Duration) -> u64 {
        (**self).sleep(from, at_most)
    }

    fn coupler_lives(&self) -> bool {
        (**self).coupler_lives()
    }

    fn held(&self) -> Option<(Party, Hold)> {
        (**self).held()
    }
}
