//! The bodies' side of a session: the order of PROTOCOL.md section 5 as its receiver of states and sender of forces.

use super::error::{SessionError, broken};
use super::line::{Line, Next};
use super::{Action, Done, Event, Machine, Task, check};
use crate::config::capability::Capabilities;
use crate::config::{DemConfig, Interface};
use crate::message::control::Party;
use crate::message::wire::{
    EnvelopeVertex, ImpForce, ImpInfo, ImpState, Limits, StepHeader, flags,
};
use crate::message::{Channel, Kind, Records};
use crate::solver::Answer;

/// Where a step of the exchange is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Exchange {
    /// No step is under way.
    Idle,
    /// The states are awaited.
    States,
    /// The solver gives its envelopes.
    Outlining,
    /// The envelopes are being sent.
    Envelopes,
    /// The set that the states announce is taken.
    Set,
    /// The solver takes the set.
    TakingSet,
    /// The solver evaluates contact.
    Evaluating,
    /// The forces are being sent.
    Forces,
    /// The solver moves the bodies.
    Advancing,
}

/// The bodies' side of a session.
#[derive(Debug)]
pub struct Bodies {
    line: Line,
    config: Option<DemConfig>,
    coupled: bool,
    exchange: Exchange,
    /// Header and number of the states that have come.
    states: (StepHeader, usize),
    /// Limits that hold after the step under way.
    limits: Limits,
    /// Whether the envelopes have been asked for in this step.
    asked: bool,
}

impl Bodies {
    /// The side of a solver that calls itself `identity`.
    pub fn new(identity: String, capabilities: Capabilities) -> Self {
        Self {
            line: Line::new(Party::Dem, identity, capabilities),
            config: None,
            coupled: false,
            exchange: Exchange::Idle,
            states: (StepHeader::default(), 0),
            limits: Limits::default(),
            asked: false,
        }
    }

    /// What [`Task::Configure`] is about.
    pub fn config(&self) -> &DemConfig {
        self.config
            .as_ref()
            .expect("the configuration has been read")
    }

    /// What [`Task::Restore`] is about.
    pub fn restored(&self) -> &[u8] {
        self.line.restored()
    }

    /// IMPs at present: as many states and forces belong to a step.
    pub fn imps(&self) -> usize {
        // In an uncoupled run the number in a saved state has no meaning.
        if self.coupled {
            self.line.imps as usize
        } else {
            0
        }
    }

    fn parse(&mut self) -> Result<Action, SessionError> {
        let configure = self.line.configuration();
        let config = serde_json::from_str(&configure.config).map_err(|e| {
            let message = format!("a configuration that does not parse: {e}");
            self.line.coupler_broke("S-5", message)
        })?;
        self.coupled = configure.coupled;
        self.config = Some(config);
        Ok(Action::Do(Task::Configure))
    }

    /// Begins the next step of the window, or ends the window.
    fn begin(&mut self) -> Action {
        // L-4, H-2, H-4: the forces of the last step had HALT_AFTER.
        let halted = self.line.done > 0 && !self.line.grant.allows(&self.line.limits);
        if self.line.window_done() || halted {
            return self.finish();
        }
        self.asked = false;
        if self.coupled {
            return self.await_states();
        }
        self.exchange = Exchange::Evaluating;
        Action::Do(Task::Contact)
    }

    fn finish(&mut self) -> Action {
        self.exchange = Exchange::Idle;
        self.line.finish()
    }

    fn await_states(&mut self) -> Action {
        self.exchange = Exchange::States;
        let channel = Channel::of(Party::Mpm, Kind::States);
        self.line.wait(channel, "the states of the points")
    }

    /// Checks I-1, then does what the flags ask for.
    fn states(&mut self, header: StepHeader, states: &[ImpState]) -> Result<Action, SessionError> {
        let step = self.line.step;
        if header.step != step || header.epoch != self.line.grant.epoch {
            let message = format!("states of step {} epoch {}", header.step, header.epoch);
            return Err(broken(Party::Mpm, "I-1", step, message));
        }
        for (flag, clause) in [(flags::HALT_BEFORE, "I-4"), (flags::WANT_ENVELOPES, "I-5")] {
            if header.flags & flag != 0 && !states.is_empty() {
                let message = format!("{} states where none follow", states.len());
                return Err(broken(Party::Mpm, clause, step, message));
            }
        }
        if header.flags & flags::HALT_BEFORE != 0 {
            return Ok(self.finish());
        }
        if header.flags & flags::WANT_ENVELOPES != 0 {
            if core::mem::replace(&mut self.asked, true) {
                let message = "the envelopes are asked for twice".into();
                return Err(broken(Party::Mpm, "G-9", step, message));
            }
            self.exchange = Exchange::Outlining;
            return Ok(Action::Do(Task::Envelopes));
        }
        self.states = (header, states.len());
        check::numbers(Party::Mpm, "I-3", step, Records::States(states))?;
        if header.flags & flags::NEW_SET != 0 {
            self.exchange = Exchange::Set;
            return Ok(Action::Take(Channel::of(Party::Mpm, Kind::Set)));
        }
        self.evaluate()
    }

    /// Checks I-2 and I-8.
    fn set(&mut self, header: &StepHeader, set: &[ImpInfo]) -> Result<Action, SessionError> {
        let (announced, next) = (self.states.0.set, self.line.set + 1);
        let counted = check::counted(header, Records::Set(set));
        if header.set != announced || header.set != next || !counted {
            let message = format!(
                "set {} of {} announced for states of set {announced}, {next} is next",
                header.set, header.count
            );
            return Err(broken(Party::Mpm, "I-2", self.line.step, message));
        }
        check::set(set, self.line.step)?;
        if self.config().interface == Interface::Segments {
            check::links(set, self.line.step)?;
        }
        self.line.set = header.set;
        self.line.imps = set.len() as u64;
        self.exchange = Exchange::TakingSet;
        Ok(Action::Do(Task::TakeSet))
    }

    /// Checks I-3, then sends the forces.
    fn evaluate(&mut self) -> Result<Action, SessionError> {
        let (header, sent) = self.states;
        let (set, imps) = (self.line.set, self.line.imps);
        if header.set != set || sent as u64 != imps || header.count != imps {
            let message = format!(
                "{sent} states for set {}, expected {imps} for set {set}",
                header.set
            );
            return Err(broken(Party::Mpm, "I-3", self.line.step, message));
        }
        self.exchange = Exchange::Evaluating;
        Ok(Action::Do(Task::Contact))
    }

    fn contacts(&mut self, answer: &Answer, forces: &[ImpForce]) -> Result<Action, SessionError> {
        let step = self.line.step;
        self.limits = answer.limits;
        check::number(Party::Dem, "L-1", step, &self.limits)?;
        if !self.coupled {
            self.exchange = Exchange::Advancing;
            return Ok(Action::Do(Task::Advance));
        }
        let halt = if self.line.grant.allows(&self.limits) {
            0
        } else {
            flags::HALT_AFTER
        };
        let header = StepHeader {
            travel: answer.travel,
            ..self.line.header(halt, forces.len())
        };
        check::forces(&header, forces, step)?;
        self.exchange = Exchange::Forces;
        Ok(self.line.send(Kind::Forces, header))
    }

    /// E-3.
    fn outlined(&mut self, envelopes: &[EnvelopeVertex]) -> Result<Action, SessionError> {
        let records = Records::Envelopes(envelopes);
        check::numbers(Party::Dem, "E-3", self.line.step, records)?;
        self.exchange = Exchange::Envelopes;
        let header = StepHeader {
            set: 0,
            ..self.line.header(0, envelopes.len())
        };
        Ok(self.line.send(Kind::Envelopes, header))
    }

    /// Passes on an event that both sides handle alike.
    fn pass(&mut self, event: Event<'_>) -> Result<Action, SessionError> {
        match self.line.on(event)? {
            Next::Act(action) => Ok(action),
            Next::Parse => self.parse(),
            Next::Step => Ok(self.begin()),
        }
    }
}

impl Machine for Bodies {
    fn react(&mut self, event: Event<'_>) -> Result<Action, SessionError> {
        // The events of a step are matched here, because handing one on copies it, which costs more than all the rest.
        match event {
            Event::Received(header, Records::States(states))
                if self.exchange == Exchange::States =>
            {
                self.states(*header, states)
            }
            Event::Received(header, Records::Set(set)) if self.exchange == Exchange::Set => {
                self.set(header, set)
            }
            Event::Absent if self.exchange == Exchange::Set => {
                let message = format!(
                    "nothing on {} although the states announce a set",
                    Channel::of(Party::Mpm, Kind::Set).name()
                );
                Err(broken(Party::Mpm, "I-2", self.line.step, message))
            }
            Event::Sent if self.exchange == Exchange::Envelopes => Ok(self.await_states()),
            Event::Sent if self.exchange == Exchange::Forces => {
                self.exchange = Exchange::Advancing;
                Ok(Action::Do(Task::Advance))
            }
            Event::Done(Done::Envelopes(envelopes)) if self.exchange == Exchange::Outlining => {
                self.outlined(envelopes)
            }
            Event::Done(Done::SetTaken) if self.exchange == Exchange::TakingSet => self.evaluate(),
            Event::Done(Done::Contacts(answer, forces))
                if self.exchange == Exchange::Evaluating =>
            {
                self.contacts(answer, forces)
            }
            Event::Done(Done::Advanced) if self.exchange == Exchange::Advancing => {
                self.line.advanced(self.limits)?;
                Ok(self.begin())
            }
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
