//! A coupled run in the order of section 5, with the kit as coupler and continuum. It grants, sends, receives and keeps
//! time; it judges nothing but that an answer comes.

use std::time::{Duration, Instant};

use interface::control::Order;
use interface::stage::{Kind, Message, Payload};
use interface::step::Step;
use interface::wire::{
    BodyState, EnvelopeVertex, Grant, ImpForce, ImpInfo, ImpState, Report, StepHeader, flags,
};

use super::timeline::{Budget, Timeline};
use super::{Points, Session, sent};
use crate::verdict::{Unmet, broken};

/// What the solver answered to the states of a step.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer {
    /// The step.
    pub step: Step,
    /// Header of the forces.
    pub header: StepHeader,
    /// One for each point of the set.
    pub forces: Vec<ImpForce>,
}

/// What the solver reported on a window.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// Its header.
    pub header: StepHeader,
    /// The report.
    pub report: Report,
    /// Header and records of the bodies' states, if they were sent before it.
    pub bodies: Option<(StepHeader, Vec<BodyState>)>,
}

impl Measured {
    /// The bodies.
    ///
    /// # Errors
    /// [`Unmet::Broken`] when they were not sent, or are fewer than `count`.
    pub fn bodies(&self, count: usize) -> Result<&[BodyState], Unmet> {
        sent(self.bodies.as_ref(), count, "bodies")
    }
}

/// A coupled run with a bodies' side under test.
pub struct Play<'b> {
    /// The run.
    pub session: Session<'b>,
    /// Most steps granted at once by [`Self::run`].
    pub window: u64,
    /// Of the grants to come.
    pub budget: Budget,
    timeline: Timeline,
    generation: u64,
    set: Vec<ImpInfo>,
    /// The set has not been sent.
    fresh: bool,
}

impl<'b> Play<'b> {
    /// A run whose solver is ready.
    pub fn new(session: Session<'b>, window: u64) -> Self {
        Self {
            session,
            window,
            budget: Budget::ALL,
            timeline: Timeline::new(),
            generation: 0,
            set: Vec::new(),
            fresh: false,
        }
    }

    pub(super) fn timeline(&self) -> &Timeline {
        &self.timeline
    }

    /// Generation and members of the IMP set.
    pub(super) fn imps(&self) -> (u64, &[ImpInfo]) {
        (self.generation, &self.set)
    }

    /// Takes up a run in the middle.
    pub(super) fn go_on(&mut self, timeline: Timeline, generation: u64, set: Vec<ImpInfo>) {
        self.timeline = timeline;
        self.generation = generation;
        self.set = set;
    }

    /// Number of the step that comes next.
    pub fn next(&self) -> u64 {
        self.timeline.clock.index()
    }

    /// Present time in s.
    pub fn time(&self) -> f64 {
        self.timeline.clock.time()
    }

    /// Announces a new IMP set with the next states.
    pub fn set(&mut self, set: &[ImpInfo]) {
        self.set = set.to_vec();
        self.fresh = true;
    }

    /// The next grant: of `steps` steps of `dt` (s). A measured one begins an epoch, as one with another step does.
    pub fn next_grant(&mut self, dt: f64, steps: u64, measure: bool) -> Grant {
        self.timeline.next_grant(dt, steps, measure, &self.budget)
    }

    /// Sends a grant.
    ///
    /// # Errors
    /// [`Unmet::Broken`] when the solver takes nothing.
    pub fn send_grant(&mut self, grant: &Grant) -> Result<(), Unmet> {
        let header = StepHeader {
            epoch: grant.epoch,
            step: grant.first,
            ..StepHeader::default()
        };
        self.session
            .send(&Message::new(header, Payload::Grant(vec![*grant])))
    }

    /// Grants `steps` steps of `dt` (s).
    ///
    /// # Errors
    /// [`Unmet::Broken`] when the solver takes nothing.
    pub fn grant(&mut self, dt: f64, steps: u64, measure: bool) -> Result<(), Unmet> {
        let grant = self.next_grant(dt, steps, measure);
        self.send_grant(&grant)
    }

    /// Header of a message of the next step.
    pub fn header(&self) -> StepHeader {
        StepHeader {
            set: self.generation,
            ..self.timeline.header()
        }
    }

    /// Sends the states of the next step, with the set if there is a new one.
    ///
    /// # Errors
    /// [`Unmet::Broken`] when the solver takes nothing.
    pub fn send_states(&mut self, states: &[ImpState]) -> Result<(), Unmet> {
        let mut announce = 0;
        // Before the first states there is always a set (I-6).
        if self.fresh || self.generation == 0 {
            self.fresh = false;
            self.generation += 1;
            announce = flags::NEW_SET;
            let header = StepHeader {
                flags: announce,
                ..self.header()
            };
            self.session
                .send(&Message::new(header, Payload::Set(self.set.clone())))?;
        }
        let header = StepHeader {
            flags: announce,
            ..self.header()
        };
        self.session
            .send(&Message::new(header, Payload::States(states.to_vec())))
    }

    /// Waits for the forces of the next step, with which it is done.
    ///
    /// # Errors
    /// [`Unmet::Broken`] when nothing comes, or fewer than there are points.
    pub fn forces(&mut self) -> Result<Answer, Unmet> {
        let step = self.timeline.clock.step(false);
        let message = loop {
            let message = self.session.expect(Kind::Forces);
            let message = message.map_err(|e| e.at(step.index))?;
            // One that answers twice (G-9) is not taken for one that is late.
            if message.header.step >= step.index {
                break message;
            }
        };
        let Payload::Forces(forces) = message.payload else {
            unreachable!("only forces come on their channel");
        };
        if forces.len() < self.set.len() {
            let expected = format_args!("{} forces", self.set.len());
            return Err(broken(expected, forces.len()).at(step.index));
        }
        self.timeline.clock.advance();
        Ok(Answer {
            step,
            header: message.header,
            forces,
        })
    }

    /// One exchange of a granted step: sends states, waits for the forces on them.
    ///
    /// # Errors
    /// [`Unmet::Broken`].
    pub fn exchange(&mut self, states: &[ImpState]) -> Result<Answer, Unmet> {
        self.send_states(states)?;
        self.forces()
    }

    /// Waits for the report on the last grant.
    ///
    /// # Errors
    /// [`Unmet::Broken`] when nothing comes.
    pub fn report(&mut self) -> Result<Measured, Unmet> {
        let step = self.timeline.clock.index();
        let message = self.session.expect(Kind::Report).map_err(|e| e.at(step))?;
        // Sent before the report, so it is there.
        let bodies = self.session.take(Kind::Bodies)?;
        let bodies = bodies.map(|message| match message.payload {
            Payload::Bodies(bodies) => (message.header, bodies),
            _ => unreachable!("only bodies come on their channel"),
        });
        let header = message.header;
        match message.payload {
            Payload::Report(reports) if !reports.is_empty() => Ok(Measured {
                header,
                report: reports[0],
                bodies,
            }),
            other => Err(broken("a report", format_args!("{other:?}")).at(step)),
        }
    }

    /// A window of one measured step.
    ///
    /// # Errors
    /// [`Unmet::Broken`].
    pub fn step(&mut self, dt: f64, states: &[ImpState]) -> Result<(Answer, Measured), Unmet> {
        self.grant(dt, 1, true)?;
        let answer = self.exchange(states)?;
        Ok((answer, self.report()?))
    }

    /// `steps` steps of `dt` (s), in windows, with points that the forces move (T-1). `each` sees the points at `t_n`
    /// and the forces on them. Where the solver halts it is granted the rest.
    ///
    /// # Errors
    /// [`Unmet::Broken`].
    pub fn run(
        &mut self,
        points: &mut Points,
        dt: f64,
        steps: u64,
        mut each: impl FnMut(&Points, &Answer) -> Result<(), Unmet>,
    ) -> Result<(), Unmet> {
        let end = self.next() + steps;
        while self.next() < end {
            let window = self.window.min(end - self.next());
            self.grant(dt, window, false)?;
            for _ in 0..window {
                let answer = self.exchange(&points.states)?;
                each(points, &answer)?;
                points.advance(&answer.step, &answer.forces);
                if answer.header.flags & flags::HALT_AFTER != 0 {
                    break;
                }
            }
            self.report()?;
        }
        Ok(())
    }

    /// Asks for the outlines of the bodies, before the states of the next step, which has been granted.
    ///
    /// # Errors
    /// [`Unmet::Broken`].
    pub fn envelopes(&mut self) -> Result<(StepHeader, Vec<EnvelopeVertex>), Unmet> {
        let header = StepHeader {
            flags: flags::WANT_ENVELOPES,
            ..self.header()
        };
        self.session
            .send(&Message::new(header, Payload::States(Vec::new())))?;
        let message = self.session.expect(Kind::Envelopes)?;
        match message.payload {
            Payload::Envelopes(vertices) => Ok((message.header, vertices)),
            _ => unreachable!("only envelopes come on their channel"),
        }
    }

    /// The next message of this kind that comes within `time`, if one does: none is expected.
    ///
    /// # Errors
    /// [`Unmet::Broken`] when the channel does not work.
    pub fn unexpected(&mut self, kind: Kind, time: Duration) -> Result<Option<Message>, Unmet> {
        let start = Instant::now();
        loop {
            let message = self.session.take(kind)?;
            if message.is_some() || start.elapsed() >= time {
                return Ok(message);
            }
            self.session.stage.sleep(kind, Duration::from_millis(1));
        }
    }

    /// The other side stops before the next step (H-1).
    ///
    /// # Errors
    /// [`Unmet::Broken`] when the solver takes nothing.
    pub fn halt_before(&mut self) -> Result<(), Unmet> {
        let header = StepHeader {
            flags: flags::HALT_BEFORE,
            ..self.header()
        };
        self.session
            .send(&Message::new(header, Payload::States(Vec::new())))
    }

    /// Sends a set and states of the coming step under headers that may be wrong; `spoil` gets them as they would be
    /// right.
    ///
    /// # Errors
    /// [`Unmet::Broken`] when the solver takes nothing.
    pub fn send_spoilt(
        &mut self,
        points: &Points,
        spoil: impl FnOnce(&mut Message, &mut Message),
    ) -> Result<(), Unmet> {
        let header = StepHeader {
            flags: flags::NEW_SET,
            set: self.generation + 1,
            ..self.header()
        };
        let mut set = Message::new(header, Payload::Set(points.set.clone()));
        let mut states = Message::new(header, Payload::States(points.states.clone()));
        spoil(&mut set, &mut states);
        self.session.send(&set)?;
        self.session.send(&states)
    }

    /// Ends the run in order.
    ///
    /// # Errors
    /// [`Unmet::Broken`].
    pub fn close(mut self) -> Result<Session<'b>, Unmet> {
        self.session.close()?;
        Ok(self.session)
    }

    /// Ends the run by an Abort.
    ///
    /// # Errors
    /// [`Unmet::Broken`] when the solver takes nothing.
    pub fn abort(&mut self) -> Result<(), Unmet> {
        self.session
            .order(&Order::Abort("the kit has seen enough".into()))
    }
}
