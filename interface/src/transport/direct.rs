//! Parties that take turns in one thread. A message is a vector that is swapped. Nobody has to be woken or to open a channel; that
//! it was done is noted for who judges a solver.

use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;

use super::{Transport, TransportError};
use crate::message::control::Party;
use crate::message::wire::StepHeader;
use crate::message::{CHANNELS, Channel, Message, Records};

/// The messages of a channel, in a ring buffer whose memory is reused.
#[derive(Debug, Default)]
struct Queue {
    places: Vec<Message>,
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
            self.places.push(Message {
                header: *header,
                payload: records.to_payload(),
            });
        } else {
            let next = self.first + self.waiting;
            let next = if next < room { next } else { next - room };
            let place = &mut self.places[next];
            place.header = *header;
            place.payload.copy_from(records);
        }
        self.waiting += 1;
    }

    /// Swaps the oldest message with `into`, whose memory is reused.
    fn pop(&mut self, into: &mut Message) -> bool {
        if self.waiting == 0 {
            return false;
        }
        core::mem::swap(into, &mut self.places[self.first]);
        let next = self.first + 1;
        self.first = if next < self.places.len() { next } else { 0 };
        self.waiting -= 1;
        true
    }
}

/// The messages that have been sent and not received in one thread.
#[derive(Debug, Default)]
struct Queues {
    channels: [Queue; CHANNELS],
    coupler_gone: bool,
    /// Channels that a solver has opened.
    opened: [bool; CHANNELS],
    /// Wake-ups from one party of another that have not been looked for.
    wakes: [[u64; Party::ALL.len()]; Party::ALL.len()],
}

/// One party's ends of the channels in one thread.
#[derive(Debug, Clone)]
pub struct Direct {
    party: Party,
    shared: Rc<RefCell<Queues>>,
}

impl Default for Direct {
    fn default() -> Self {
        Self::new()
    }
}

impl Direct {
    /// The ends of all parties. Where nobody asks who was woken, a clone serves as those of any.
    pub fn new() -> Self {
        let (party, shared) = (Party::Coupler, Rc::default());
        Self { party, shared }
    }

    /// The ends of a party.
    #[must_use]
    pub fn of(&self, party: Party) -> Self {
        let shared = self.shared.clone();
        Self { party, shared }
    }

    /// The channels that `solver` has to open and has not.
    pub fn unopened(&self, solver: Party) -> Vec<&'static str> {
        let opened = self.shared.borrow().opened;
        let channels = Channel::before_ready(solver, true).into_iter();
        let unopened = channels.filter(|channel| !opened[channel.number()]);
        unopened.map(Channel::name).collect()
    }

    /// From now on the coupler counts as gone for the others.
    pub fn release(&self) {
        self.shared.borrow_mut().coupler_gone = true;
    }
}

impl Transport for Direct {
    fn open(&mut self, channels: &[Channel]) -> Result<(), TransportError> {
        let mut shared = self.shared.borrow_mut();
        for channel in channels {
            shared.opened[channel.number()] = true;
        }
        Ok(())
    }

    fn send(
        &mut self,
        channel: Channel,
        header: &StepHeader,
        records: Records<'_>,
    ) -> Result<(), TransportError> {
        let shared = &mut *self.shared.borrow_mut();
        shared.channels[channel.number()].push(header, records);
        Ok(())
    }

    fn receive(&mut self, channel: Channel, into: &mut Message) -> Result<bool, TransportError> {
        let shared = &mut *self.shared.borrow_mut();
        Ok(shared.channels[channel.number()].pop(into))
    }

    fn wake(&mut self, to: Party) {
        self.shared.borrow_mut().wakes[self.party as usize][to as usize] += 1;
    }

    fn sleep(&mut self, from: Party, _at_most: Duration) -> u64 {
        let shared = &mut *self.shared.borrow_mut();
        std::mem::take(&mut shared.wakes[from as usize][self.party as usize])
    }

    fn coupler_lives(&self) -> bool {
        !self.shared.borrow().coupler_gone
    }
}
