//! Parties that take turns in one thread. A message is a vector that is swapped, and nobody has to be woken.

use std::cell::RefCell;
use std::rc::Rc;

use super::{Transport, TransportError};
use crate::message::wire::StepHeader;
use crate::message::{CHANNELS, Channel, Payload, Records};

/// The messages of a channel, in a ring buffer whose memory is reused.
#[derive(Debug, Default)]
struct Queue {
    places: Vec<(StepHeader, Payload)>,
    /// Index of the oldest message, and number of messages.
    first: usize,
    waiting: usize,
}

impl Queue {
    fn push(&mut self, header: &StepHeader, records: Records<'_>) {
        let room = self.places.len();
        if self.waiting == room {
            self.places.rotate_left(self.first);
            self.first = 0;
            self.places.push((*header, records.to_payload()));
        } else {
            let next = self.first + self.waiting;
            let next = if next < room { next } else { next - room };
            let place = &mut self.places[next];
            place.0 = *header;
            place.1.copy_from(records);
        }
        self.waiting += 1;
    }

    /// Swaps the oldest message with `into`, whose memory is reused.
    fn pop(&mut self, into: &mut Payload) -> Option<StepHeader> {
        if self.waiting == 0 {
            return None;
        }
        let room = self.places.len();
        let (header, payload) = &mut self.places[self.first];
        core::mem::swap(into, payload);
        let next = self.first + 1;
        self.first = if next < room { next } else { 0 };
        self.waiting -= 1;
        Some(*header)
    }
}

/// The messages that have been sent and not received in one thread.
#[derive(Debug, Default)]
struct Queues {
    queues: [Queue; CHANNELS],
    coupler_gone: bool,
}

/// One party's ends of the channels in one thread.
#[derive(Debug, Clone, Default)]
pub struct Direct(Rc<RefCell<Queues>>);

impl Direct {
    /// The ends of all parties are clones of one another.
    pub fn new() -> Self {
        Self::default()
    }

    /// From now on the coupler counts as gone for the others.
    pub fn release(&self) {
        self.0.borrow_mut().coupler_gone = true;
    }
}

impl Transport for Direct {
    fn send(
        &mut self,
        channel: Channel,
        header: &StepHeader,
        records: Records<'_>,
    ) -> Result<(), TransportError> {
        let shared = &mut *self.0.borrow_mut();
        shared.queues[channel.number()].push(header, records);
        Ok(())
    }

    fn receive(
        &mut self,
        channel: Channel,
        into: &mut Payload,
    ) -> Result<Option<StepHeader>, TransportError> {
        let shared = &mut *self.0.borrow_mut();
        Ok(shared.queues[channel.number()].pop(into))
    }

    fn coupler_lives(&self) -> bool {
        !self.0.borrow().coupler_gone
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::Kind;
    use crate::message::control::Party;
    use crate::message::wire::ImpState;

    #[test]
    fn messages_arrive_in_order_and_memory_is_used_again() {
        let mut mpm = Direct::new();
        let mut dem = mpm.clone();
        let channel = Channel::of(Party::Mpm, Kind::States);
        let state = |x| ImpState {
            position: [x, 0.0],
            velocity: [0.0; 2],
            ..ImpState::default()
        };
        let mut into = Payload::empty(Kind::States);
        for step in 0..5 {
            let header = StepHeader {
                step,
                ..StepHeader::default()
            };
            mpm.send(channel, &header, Records::States(&[state(step as f64)]))
                .unwrap();
            mpm.send(channel, &header, Records::States(&[])).unwrap();
            let got = dem.receive(channel, &mut into).unwrap().unwrap();
            assert_eq!(got.step, step);
            assert_eq!(into.records(), Records::States(&[state(step as f64)]));
            assert!(dem.receive(channel, &mut into).unwrap().is_some());
            assert!(into.is_empty());
            assert_eq!(dem.receive(channel, &mut into).unwrap(), None);
        }
        assert!(dem.coupler_lives());
        mpm.release();
        assert!(!dem.coupler_lives());
    }
}
