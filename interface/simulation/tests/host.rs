//! The machine that the parties of a simulated session share: virtual time, messages in transit, wake-ups, dead processes.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;

use interface::message::control::{Order, Party};
use interface::message::wire::{StepHeader, flags};
use interface::message::{CHANNELS, Channel, Kind, Message, Payload, Records};
use interface::transport::{Transport, TransportError};
use mechanics::generate::Random;

use crate::fault::{Corruption, Fault, FaultKind, SECOND, Time};

/// Messages that may wait in a channel (clause C-7).
const BUFFER: usize = 4;
/// How long a sender waits while a channel is full.
const SEND_TIMEOUT: Time = 10 * SECOND;

struct Sent {
    arrives: Time,
    header: StepHeader,
    payload: Payload,
}

/// A rule that was broken.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Violation(pub String);

/// The machine on which the simulated processes run.
pub struct SimulatedHost {
    /// Virtual time now.
    pub now: Time,
    pub(crate) random: Random,
    queues: [VecDeque<Sent>; CHANNELS],
    spare: [Vec<Payload>; CHANNELS],
    /// When the last message from one party to another arrives: shared memory keeps their order.
    last: [[Time; 3]; 3],
    /// Longest delay of a message in ns.
    delay: Time,
    /// Chance that a wake-up is lost.
    lost_wakes: f64,
    /// When a party would be woken.
    pub(crate) wake: [Time; 3],
    /// Sends and tasks of each party so far.
    pub(crate) events: [u64; 3],
    pub(crate) faults: Vec<Fault>,
    /// Faults that have occurred, and when.
    pub(crate) struck: Vec<(Fault, Time)>,
    /// Until when each party does nothing; for ever if dead.
    pub(crate) stopped: [Stopped; 3],
    /// The parties that have received the end of the session.
    released: [bool; 3],
    pub(crate) violations: Vec<Violation>,
    /// Whether the solvers see that the coupler is gone.
    pub(crate) coupler_gone: bool,
    /// The parties that have ended.
    pub(crate) ended: [bool; 3],
}

/// Whether a party gets turns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stopped {
    /// It does.
    No,
    /// Not before then.
    Until(Time),
    /// Never again, though nobody sees that it has ended.
    Frozen,
    /// It is dead, and its end can be seen.
    Dead,
}

impl SimulatedHost {
    /// A machine on which messages take up to `delay` ns and wake-ups are lost with this chance.
    pub fn new(seed: u64, delay: Time, lost_wakes: f64, faults: Vec<Fault>) -> Self {
        Self {
            now: 0,
            random: Random::new(seed),
            queues: [const { VecDeque::new() }; CHANNELS],
            spare: [const { Vec::new() }; CHANNELS],
            last: [[0; 3]; 3],
            delay,
            lost_wakes,
            wake: [Time::MAX; 3],
            events: [0; 3],
            faults,
            struck: Vec::new(),
            stopped: [Stopped::No; 3],
            released: [false; 3],
            violations: Vec::new(),
            coupler_gone: false,
            ended: [false; 3],
        }
    }

    /// A party does something; a fault that is due strikes. One that corrupts a message waits for the next that is sent.
    pub(crate) fn event(&mut self, party: Party, sends: bool) -> Option<FaultKind> {
        let n = party as usize;
        self.events[n] += 1;
        let event = self.events[n];
        let due = |f: &&mut Fault| f.party == party && f.at == event;
        let fault = self.faults.iter_mut().find(due)?;
        if !sends && matches!(fault.kind, FaultKind::Corrupt(_)) {
            fault.at += 1;
            return None;
        }
        let fault = *fault;
        self.struck.push((fault, self.now));
        match fault.kind {
            FaultKind::Die => {
                self.stopped[n] = Stopped::Dead;
                self.coupler_gone |= party == Party::Coupler;
            }
            FaultKind::Freeze(None) => self.stopped[n] = Stopped::Frozen,
            FaultKind::Freeze(Some(time)) => self.stopped[n] = Stopped::Until(self.now + time),
            FaultKind::Corrupt(_) => {}
        }
        Some(fault.kind)
    }

    fn send(
        &mut self,
        channel: Channel,
        header: &StepHeader,
        records: Records<'_>,
    ) -> Result<(), TransportError> {
        let (from, to) = (channel.from(), channel.to());
        let corruption = match self.event(from, true) {
            Some(FaultKind::Corrupt(corruption)) => Some(corruption),
            // What a party does at the moment of its death is not seen any more.
            Some(FaultKind::Die) => return Ok(()),
            _ => None,
        };
        if self.released[from as usize] {
            self.violations.push(Violation(format!(
                "the {from} sends on {} after the end of its session",
                channel.name()
            )));
        }
        let queue = &self.queues[channel.number()];
        if queue.len() >= BUFFER {
            self.now += SEND_TIMEOUT;
            return Err(TransportError::Full {
                channel: channel.name().into(),
            });
        }
        let mut payload = match self.spare[channel.number()].pop() {
            Some(mut payload) => {
                payload.copy_from(records);
                payload
            }
            None => records.to_payload(),
        };
        let mut header = *header;
        let mut copies = 1;
        if let Some(corruption) = corruption {
            copies = corruption.apply(&mut header, &mut payload);
        }
        let [i, j] = [from, to].map(|party| party as usize);
        let delay = (self.random.unit() * self.delay as f64) as Time;
        let arrives = self.last[i][j].max(self.now + delay);
        self.last[i][j] = arrives;
        for _ in 0..copies {
            self.queues[channel.number()].push_back(Sent {
                arrives,
                header,
                payload: payload.clone(),
            });
        }
        let woken = channel.wakes() && self.random.unit() >= self.lost_wakes;
        if woken {
            self.wake[j] = self.wake[j].min(arrives);
        }
        Ok(())
    }

    fn receive(&mut self, channel: Channel, into: &mut Message) -> bool {
        let now = self.now;
        let queue = &mut self.queues[channel.number()];
        let Some(sent) = queue.pop_front_if(|sent| sent.arrives <= now) else {
            return false;
        };
        let Message { header, payload } = into;
        *header = sent.header;
        let old = core::mem::replace(payload, sent.payload);
        self.spare[channel.number()].push(old);
        if channel.kind == Kind::Order && is_end(payload) {
            self.released[channel.to() as usize] = true;
        }
        true
    }
}

/// Whether an order ends the session of who gets it: a whole Close or Abort.
fn is_end(payload: &Payload) -> bool {
    let Payload::Order(bytes) = payload else {
        return false;
    };
    let last = matches!(bytes.first(), Some(2 | 3));
    last && matches!(decode(bytes), Ok(Order::Close | Order::Abort(_)))
}

fn decode(bytes: &[u8]) -> Result<Order, String> {
    let payload = Payload::Order(bytes.to_vec());
    Message::new(StepHeader::default(), payload).as_order()
}

impl Corruption {
    /// Does it to a message; how often the message is sent then.
    fn apply(self, header: &mut StepHeader, payload: &mut Payload) -> u64 {
        match self {
            Self::Step => header.step = header.step.wrapping_add(1),
            Self::Epoch => header.epoch = header.epoch.wrapping_add(1),
            Self::Set => header.set = header.set.wrapping_add(1),
            Self::Count => header.count = header.count.wrapping_add(1),
            Self::Drop => return 0,
            Self::Twice => return 2,
            Self::Flags => header.flags ^= flags::HALT_AFTER,
            Self::Records => corrupt_records(payload),
        }
        1
    }
}

/// A number that is not finite, or bytes that mean nothing.
fn corrupt_records(payload: &mut Payload) {
    match payload {
        Payload::Order(bytes)
        | Payload::Notice(bytes)
        | Payload::Saved(bytes)
        | Payload::Restore(bytes) => {
            if let Some(byte) = bytes.last_mut() {
                *byte ^= 0xff;
            }
            bytes.push(7);
        }
        Payload::Grant(grants) => grants.iter_mut().for_each(|g| g.dt = f64::NAN),
        Payload::Report(reports) => reports.iter_mut().for_each(|r| r.limits.speed = f64::NAN),
        Payload::Groups(groups) => groups.iter_mut().for_each(|g| g.mass = f64::NAN),
        Payload::Points(points) => points.iter_mut().for_each(|p| p.position[0] = f64::NAN),
        Payload::Bodies(bodies) => bodies.iter_mut().for_each(|b| b.angle = f64::NAN),
        Payload::Contacts(contacts) => contacts.iter_mut().for_each(|c| c.force[0] = f64::NAN),
        Payload::Set(set) => set.iter_mut().for_each(|imp| imp.radius = -1.0),
        Payload::States(states) => states
            .iter_mut()
            .for_each(|s| s.position[0] = f64::INFINITY),
        Payload::Forces(forces) => forces.iter_mut().for_each(|f| f.force[1] = f64::NAN),
        Payload::Envelopes(outlines) => outlines.iter_mut().for_each(|e| e.reach = f64::NAN),
    }
}

/// One party's ends on the shared machine.
pub struct Ends {
    /// Whose they are.
    pub party: Party,
    /// The machine.
    pub host: Rc<RefCell<SimulatedHost>>,
}

impl Transport for Ends {
    fn send(
        &mut self,
        channel: Channel,
        header: &StepHeader,
        records: Records<'_>,
    ) -> Result<(), TransportError> {
        let mut host = self.host.borrow_mut();
        if host.stopped[self.party as usize] == Stopped::Dead {
            return Ok(());
        }
        host.send(channel, header, records)
    }

    fn receive(&mut self, channel: Channel, into: &mut Message) -> Result<bool, TransportError> {
        Ok(self.host.borrow_mut().receive(channel, into))
    }

    fn coupler_lives(&self) -> bool {
        !self.host.borrow().coupler_gone
    }
}
