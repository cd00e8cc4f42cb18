//! The continuum's side of a session: the order of PROTOCOL.md section 5 as its sender of states and receiver of forces.

use super::approach::Approach;
use super::error::{SessionError, broken};
use super::line::{Line, Next};
use super::{Action, Done, Event, Machine, Task, check};
use crate::config::MpmConfig;
use crate::config::capability::Capabilities;
use crate::message::control::Party;
use crate::message::wire::{
    EnvelopeVertex, ImpForce, ImpInfo, ImpState, Limits, StepHeader, flags,
};
use crate::message::{Channel, Kind, Records};

/// Where a step of the exchange is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Exchange {
    /// No step is under way.
    Idle,
    /// HALT_BEFORE is being sent.
    Halting,
    /// WANT_ENVELOPES is being sent.
    Asking,
    /// The envelopes are awaited.
    Envelopes,
    /// The solver chooses the IMPs.
    Selecting,
    /// The set is being sent.
    Announcing,
    /// The solver gives the states.
    Gathering,
    /// The states are being sent.
    States,
    /// The solver computes what needs no forces.
    Predicting,
    /// The forces are awaited.
    Forces,
    /// The solver does the rest of the step.
    Correcting,
}

/// The continuum's side of a session.
#[derive(Debug)]
pub struct Continuum {
    line: Line,
    config: Option<MpmConfig>,
    coupled: bool,
    exchange: Exchange,
    approach: Approach,
    new_set: bool,
    /// The bodies stop after the step under way.
    halt_after: bool,
}

impl Continuum {
    /// The side of a solver that calls itself `identity`.
    pub fn new(identity: String, capabilities: Capabilities) -> Self {
        Self {
            line: Line::new(Party::Mpm, identity, capabilities),
            config: None,
            coupled: false,
            exchange: Exchange::Idle,
            approach: Approach::default(),
            new_set: false,
            halt_after: false,
        }
    }

    /// What [`Task::Configure`] is about.
    pub fn config(&self) -> &MpmConfig {
        self.config
            .as_ref()
            .expect("the configuration has been read")
    }

    /// Whether there are bodies to exchange with.
    pub fn is_coupled(&self) -> bool {
        self.coupled
    }

    /// What [`Task::Restore`] is about.
    pub fn restored(&self) -> &[u8] {
        self.line.restored()
    }

    fn parse(&mut self) -> Result<Action, SessionError> {
        let configure = self.line.configuration();
        let config: MpmConfig = serde_json::from_str(&configure.config).map_err(|e| {
            let message = format!("a configuration that does not parse: {e}");
            self.line.coupler_broke("S-5", message)
        })?;
        self.coupled = configure.coupled;
        self.approach = Approach::new(&config);
        self.config = Some(config);
        Ok(Action::Do(Task::Configure))
    }

    /// Begins the next step of the window, or ends the window.
    fn begin(&mut self) -> Action {
        if self.line.window_done() || (self.line.done > 0 && self.halt_after) {
            self.exchange = Exchange::Idle;
            return self.line.finish();
        }
        // L-4, H-1, H-4.
        if self.line.done > 0 && !self.line.grant.allows(&self.line.limits) {
            if !self.coupled {
                self.exchange = Exchange::Idle;
                return self.line.finish();
            }
            return self.say(Exchange::Halting, flags::HALT_BEFORE);
        }
        if !self.coupled {
            self.exchange = Exchange::Predicting;
            return Action::Do(Task::Predict);
        }
        // I-6.
        self.new_set = self.line.set == 0 || self.approach.set_is_old();
        if self.new_set {
            return self.say(Exchange::Asking, flags::WANT_ENVELOPES);
        }
        self.exchange = Exchange::Gathering;
        Action::Do(Task::States)
    }

    /// Sends a message without states.
    fn say(&mut self, exchange: Exchange, flags: u64) -> Action {
        self.exchange = exchange;
        let header = self.line.header(flags, 0);
        self.line.send(Kind::States, header)
    }

    fn sent(&mut self) -> Option<Action> {
        match self.exchange {
            Exchange::Halting => {
                self.exchange = Exchange::Idle;
                Some(self.line.finish())
            }
            Exchange::Asking => {
                self.exchange = Exchange::Envelopes;
                let channel = Channel::of(Party::Mpm, Kind::Envelopes);
                Some(self.line.wait(channel, "the envelopes of the bodies"))
            }
            Exchange::Announcing => {
                self.exchange = Exchange::Gathering;
                Some(Action::Do(Task::States))
            }
            Exchange::States => {
                self.exchange = Exchange::Predicting;
                Some(Action::Do(Task::Predict))
            }
            _ => None,
        }
    }

    /// E-2, E-3.
    fn envelopes(
        &mut self,
        header: &StepHeader,
        envelopes: &[EnvelopeVertex],
    ) -> Result<Action, SessionError> {
        let (step, epoch) = (self.line.step, self.line.grant.epoch);
        let records = Records::Envelopes(envelopes);
        if header.step != step || header.epoch != epoch || !check::counted(header, records) {
            let message = format!(
                "envelopes of step {} with {} vertices announced",
                header.step, header.count
            );
            return Err(broken(Party::Dem, "E-2", step, message));
        }
        check::numbers(Party::Dem, "E-3", step, records)?;
        self.exchange = Exchange::Selecting;
        Ok(Action::Do(Task::Select))
    }

    /// F-2 to F-5.
    fn forces(&mut self, header: &StepHeader, forces: &[ImpForce]) -> Result<Action, SessionError> {
        let (step, set, imps) = (self.line.step, self.line.set, self.line.imps);
        let complain = |clause, message| Err(broken(Party::Dem, clause, step, message));
        if header.step != step || header.epoch != self.line.grant.epoch {
            let message = format!("forces of step {} epoch {}", header.step, header.epoch);
            return complain("F-2", message);
        }
        if header.set != set || header.count != imps || forces.len() as u64 != imps {
            let message = format!(
                "{} forces for set {}, expected {imps} for set {set}",
                forces.len(),
                header.set
            );
            return complain("F-3", message);
        }
        check::forces(header, forces, step)?;
        self.approach.bodies = header.travel;
        self.halt_after = header.flags & flags::HALT_AFTER != 0;
        self.exchange = Exchange::Correcting;
        Ok(Action::Do(Task::Correct))
    }

    fn selected(&mut self, set: &[ImpInfo]) -> Result<Action, SessionError> {
        let step = self.line.step;
        check::set(set, step)?;
        check::links(set, step)?;
        self.approach.selected();
        self.line.imps = set.len() as u64;
        self.line.set += 1;
        self.exchange = Exchange::Announcing;
        let header = self.line.header(flags::NEW_SET, set.len());
        Ok(self.line.send(Kind::Set, header))
    }

    fn gathered(&mut self, states: &[ImpState]) -> Result<Action, SessionError> {
        let records = Records::States(states);
        check::numbers(Party::Mpm, "I-3", self.line.step, records)?;
        self.exchange = Exchange::States;
        let flags = if self.new_set { flags::NEW_SET } else { 0 };
        let header = self.line.header(flags, states.len());
        Ok(self.line.send(Kind::States, header))
    }

    fn predicted(&mut self) -> Action {
        if self.coupled {
            self.exchange = Exchange::Forces;
            let channel = Channel::of(Party::Mpm, Kind::Forces);
            return self.line.wait(channel, "the contact forces");
        }
        self.exchange = Exchange::Correcting;
        Action::Do(Task::Correct)
    }

    fn corrected(&mut self, limits: &Limits, travel: f64) -> Result<Action, SessionError> {
        let limits = if self.coupled {
            let dt = self.line.grant.dt;
            self.approach.moved(*limits, travel, dt)
        } else {
            *limits
        };
        self.line.advanced(limits)?;
        Ok(self.begin())
    }

    /// Handles the result of a task that is not part of a step.
    fn task_done(&mut self, done: Done<'_>) -> Result<Action, SessionError> {
        match &done {
            Done::Configured { fastest, .. } => self.approach.fastest = *fastest,
            Done::Restored(travel) => {
                self.approach.points = *travel;
                [self.approach.bodies, self.approach.fastest] = self.line.carried;
            }
            Done::Saved(_) => {
                self.line.carried = [self.approach.bodies, self.approach.fastest];
            }
            _ => {}
        }
        self.pass(Event::Done(done))
    }

    /// Passes on an event that both sides handle alike.
    fn pass(&mut self, event: Event<'_>) -> Result<Action, SessionError> {
        match self.line.on(event)? {
            Next::Act(action) => Ok(action),
            Next::Parse => self.parse(),
            Next::Step => {
                self.halt_after = false;
                Ok(self.begin())
            }
        }
    }
}

impl Machine for Continuum {
    fn react(&mut self, event: Event<'_>) -> Result<Action, SessionError> {
        // The events of a step are matched here, because handing one on copies it, which costs more than all the rest.
        match event {
            Event::Received(header, Records::Envelopes(envelopes))
                if self.exchange == Exchange::Envelopes =>
            {
                self.envelopes(header, envelopes)
            }
            Event::Received(header, Records::Forces(forces))
                if self.exchange == Exchange::Forces =>
            {
                self.forces(header, forces)
            }
            Event::Done(Done::Selected(set)) if self.exchange == Exchange::Selecting => {
                self.selected(set)
            }
            Event::Done(Done::States(states)) if self.exchange == Exchange::Gathering => {
                self.gathered(states)
            }
            Event::Done(Done::Predicted) if self.exchange == Exchange::Predicting => {
                Ok(self.predicted())
            }
            Event::Done(Done::Corrected(limits, travel))
                if self.exchange == Exchange::Correcting =>
            {
                self.corrected(limits, travel)
            }
            Event::Done(done) => self.task_done(done),
            Event::Sent => match self.sent() {
                Some(action) => Ok(action),
                None => self.pass(Event::Sent),
            },
            event => self.pass(event),
        }
    }

    fn leave_exchange(&mut self) {
        self.exchange = Exchange::Idle;
    }

    fn line(&self) -> &Line {
        &self.line
    }

    fn line_mut(&mut self) -> &mut Line {
        &mut self.line
    }
}
