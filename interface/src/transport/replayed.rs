//! The coupler's ends of a run in which it stands in for one of the solvers: the other one gets from a recording what
//! that solver sent to it, and its answers are compared with those in the recording.

use std::collections::VecDeque;
use std::time::Duration;

use super::{Transport, TransportError};
use crate::message::control::Party;
use crate::message::wire::{Grant, StepHeader, flags};
use crate::message::{Channel, Kind, Payload, Records};
use crate::recording::Script;
use crate::transport::liveness::Hold;

/// The kinds of messages between the solvers.
const BETWEEN: [Kind; 4] = [Kind::Set, Kind::States, Kind::Forces, Kind::Envelopes];

/// The ends of the coupler, and those of the solver for which it stands in. When the solver's answer differs, the script
/// says so ([`Script::failure`]), and nothing more is sent for the other side.
pub struct Replayed<'a> {
    coupler: &'a mut dyn Transport,
    other: Box<dyn Transport>,
    script: Script,
    /// The solver to which it is replayed.
    solver: Party,
    /// What was granted last.
    grant: Grant,
    /// What crosses next between the solvers in the present step.
    to_cross: VecDeque<Kind>,
    inbox: [Payload; 4],
}

impl<'a> Replayed<'a> {
    /// Plays `script` over the ends of the `coupler` and those of the `other` solver to the one whose script it is.
    pub fn new(coupler: &'a mut dyn Transport, other: Box<dyn Transport>, script: Script) -> Self {
        Self {
            coupler,
            other,
            solver: script.solver(),
            script,
            grant: Grant::default(),
            to_cross: VecDeque::new(),
            inbox: BETWEEN.map(Payload::empty),
        }
    }

    /// Sends and takes what crosses between the solvers, until an answer is not there yet or the window is over.
    fn play(&mut self) -> Result<(), TransportError> {
        while self.script.failure().is_none() {
            let Some(&kind) = self.to_cross.front() else {
                if self.next_step() {
                    continue;
                }
                break;
            };
            let channel = Channel::of(Party::Mpm, kind);
            if channel.from() == self.solver {
                if !self.hear(channel)? {
                    break;
                }
            } else if let Some((header, payload)) = self.script.take(channel) {
                self.other.send(channel, &header, payload.records())?;
                if channel.wakes() {
                    self.other.wake(self.solver);
                }
            }
            self.to_cross.pop_front();
        }
        Ok(())
    }

    /// What crosses for the next recorded states, if they belong to the window: a window may have ended early.
    fn next_step(&mut self) -> bool {
        let Some(states) = self.script.next(Channel::of(Party::Mpm, Kind::States)) else {
            return false;
        };
        let Grant { first, steps, .. } = self.grant;
        let window = first..first.saturating_add(steps);
        if states.epoch != self.grant.epoch || !window.contains(&states.step) {
            return false;
        }
        let has = |flag| states.flags & flag != 0;
        self.to_cross
            .extend(has(flags::NEW_SET).then_some(Kind::Set));
        self.to_cross.push_back(Kind::States);
        if has(flags::WANT_ENVELOPES) {
            self.to_cross.push_back(Kind::Envelopes);
        } else if !has(flags::HALT_BEFORE) {
            self.to_cross.push_back(Kind::Forces);
        }
        true
    }

    /// Takes an answer if it is there.
    fn hear(&mut self, channel: Channel) -> Result<bool, TransportError> {
        let buffer = BETWEEN.iter().position(|kind| *kind == channel.kind);
        let buffer = &mut self.inbox[buffer.expect("a channel between the solvers")];
        let header = self.other.receive(channel, buffer)?;
        if let Some(header) = &header {
            self.script.compare(channel, header, buffer.records());
        }
        Ok(header.is_some())
    }
}

impl Transport for Replayed<'_> {
    fn open_measurement(&mut self) -> Result<(), TransportError> {
        self.coupler.open_measurement()
    }

    fn open_exchange(&mut self) -> Result<(), TransportError> {
        self.coupler.open_exchange()
    }

    fn send(
        &mut self,
        channel: Channel,
        header: &StepHeader,
        records: Records<'_>,
    ) -> Result<(), TransportError> {
        if let Records::Grant([grant]) = records {
            self.grant = *grant;
        }
        self.coupler.send(channel, header, records)
    }

    fn receive(
        &mut self,
        channel: Channel,
        into: &mut Payload,
    ) -> Result<Option<StepHeader>, TransportError> {
        if channel.kind == Kind::Report {
            self.play()?;
        }
        let header = self.coupler.receive(channel, into)?;
        if let Some(header) = &header {
            self.script.compare(channel, header, into.records());
        }
        Ok(header)
    }

    fn wake(&mut self, to: Party) {
        self.coupler.wake(to);
    }

    fn sleep(&mut self, from: Party, at_most: Duration) -> u64 {
        // Whoever waits for the report waits first for what the solver says to the other one.
        if self.to_cross.is_empty() {
            self.coupler.sleep(from, at_most)
        } else {
            self.other.sleep(from, at_most)
        }
    }

    fn coupler_lives(&self) -> bool {
        self.coupler.coupler_lives()
    }

    fn held(&self) -> Option<(Party, Hold)> {
        self.coupler.held()
    }
}
