//! A run with a bodies' side under test: the kit is the continuum, whose states a clause writes down.

use interface::config::DemConfig;
use interface::config::needs::missing;
use interface::message::wire::{EnvelopeVertex, ImpForce, ImpInfo, ImpState, StepHeader, flags};
use interface::message::{Kind, Payload};

use super::run::{Run, WindowReport, records};
use super::session::{Bench, configure};
use crate::verdict::{Unmet, broken};

/// What the solver answered to the states of a step.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer {
    /// Header of the forces.
    pub header: StepHeader,
    /// One for each point of the set.
    pub forces: Vec<ImpForce>,
}

impl Bench {
    /// A coupled run of bodies, configured and ready; [`Unmet::Declined`] when the solver refuses it,
    /// [`Unmet::Lacking`] when it has announced that it would.
    pub fn run_bodies(&self, config: &DemConfig) -> Result<Run<'_>, Unmet> {
        let needs = config.needs();
        let lacking = missing(&needs, &self.capabilities);
        if !lacking.is_empty() {
            let names = lacking.iter().map(|need| need.capability.clone());
            return Err(Unmet::Lacking(names.collect()));
        }
        self.run(&configure(config))
    }
}

impl Run<'_> {
    /// Announces a new IMP set with the next states.
    pub fn set(&mut self, set: &[ImpInfo]) {
        self.at.set = set.to_vec();
        self.fresh = true;
    }

    /// Sends states of the next step with these flags.
    fn send_flagged(&mut self, flags: u64, states: &[ImpState]) -> Result<(), Unmet> {
        let header = StepHeader {
            flags,
            ..self.header()
        };
        self.send(header, Payload::States(states.to_vec()))
    }

    /// Sends the states of the next step, with the set if there is a new one.
    pub fn send_states(&mut self, states: &[ImpState]) -> Result<(), Unmet> {
        // Before the first states there is always a set (I-6).
        if !self.fresh && self.at.generation > 0 {
            return self.send_flagged(0, states);
        }
        self.fresh = false;
        self.at.generation += 1;
        let header = StepHeader {
            flags: flags::NEW_SET,
            ..self.header()
        };
        self.send(header, Payload::Set(self.at.set.clone()))?;
        self.send_flagged(flags::NEW_SET, states)
    }

    /// Waits for the forces of the next step, with which it is done.
    pub fn forces(&mut self) -> Result<Answer, Unmet> {
        let step = self.next();
        let (header, forces) = loop {
            let (header, forces) = records!(self.expect(Kind::Forces)?, Forces);
            // A second answer (G-9) is not reported as a late one.
            if header.step >= step {
                break (header, forces);
            }
        };
        if forces.len() < self.at.set.len() {
            let expected = format_args!("{} forces", self.at.set.len());
            return Err(broken(expected, forces.len()).at(step));
        }
        self.done(1);
        Ok(Answer { header, forces })
    }

    /// One exchange of a granted step: sends states, waits for the forces on them.
    pub fn answer(&mut self, states: &[ImpState]) -> Result<Answer, Unmet> {
        self.send_states(states)?;
        self.forces()
    }

    /// A window of one measured step.
    pub fn measured(
        &mut self,
        dt: f64,
        states: &[ImpState],
    ) -> Result<(Answer, WindowReport), Unmet> {
        self.grant(dt, 1, true)?;
        let answer = self.answer(states)?;
        Ok((answer, self.report()?))
    }

    /// Asks for the outlines of the bodies, before the states of the next step, which has been granted.
    pub fn envelopes(&mut self) -> Result<(StepHeader, Vec<EnvelopeVertex>), Unmet> {
        self.send_flagged(flags::WANT_ENVELOPES, &[])?;
        let message = self.session.expect(Kind::Envelopes)?;
        Ok(records!(message, Envelopes))
    }

    /// The other side stops before the next step (H-1).
    pub fn halt_before(&mut self) -> Result<(), Unmet> {
        self.send_flagged(flags::HALT_BEFORE, &[])
    }
}
