//! A run in the order of section 5 with a continuum under test: the kit is the coupler and the bodies, whose outlines
//! and forces a clause writes down. It judges nothing but that an answer comes.

use interface::config::MpmConfig;
use interface::control::{Configure, Order, Ready};
use interface::stage::{Kind, Message, Payload};
use interface::step::Step;
use interface::wire::{
    EnvelopeVertex, Grant, GroupState, ImpForce, ImpInfo, ImpState, PointState, Report, StepHeader,
    flags,
};

use super::timeline::{Budget, Timeline};
use super::{Bench, Session, configure, sent};
use crate::verdict::{Unmet, broken};

/// The states that the continuum sent in a step.
#[derive(Debug, Clone, PartialEq)]
pub struct Shown {
    /// The step.
    pub step: Step,
    /// Their header.
    pub header: StepHeader,
    /// One for each point of the set.
    pub states: Vec<ImpState>,
    /// Headers of the empty states by which envelopes were asked for before.
    pub asked: Vec<StepHeader>,
    /// Header of the set that came with them.
    pub new_set: Option<StepHeader>,
}

/// What the continuum reported on a window.
#[derive(Debug, Clone, PartialEq)]
pub struct Told {
    /// Its header.
    pub header: StepHeader,
    /// The report.
    pub report: Report,
    /// Header and records of the groups, if they were sent before it.
    pub groups: Option<(StepHeader, Vec<GroupState>)>,
    /// The same of all points.
    pub points: Option<(StepHeader, Vec<PointState>)>,
}

impl Told {
    /// The groups.
    ///
    /// # Errors
    /// [`Unmet::Broken`] when they were not sent, or are fewer than `count`.
    pub fn groups(&self, count: usize) -> Result<&[GroupState], Unmet> {
        sent(self.groups.as_ref(), count, "groups")
    }
}

/// A run with a continuum under test.
pub struct Flow<'b> {
    /// The run.
    pub session: Session<'b>,
    /// What the solver said of itself.
    pub ready: Ready,
    /// Most steps granted at once by [`Self::run`].
    pub window: u64,
    /// Of the grants to come.
    pub budget: Budget,
    /// Outlines of the bodies, answered when they are asked for.
    pub outlines: Vec<EnvelopeVertex>,
    /// Of the forces to come (F-9).
    pub travel: f64,
    /// Flags of the forces to come.
    pub flags: u64,
    /// The IMPs, slot by slot.
    pub set: Vec<ImpInfo>,
    timeline: Timeline,
    generation: u64,
    coupled: bool,
}

/// An outline around everything: all points are IMPs, and their states are seen in every step.
pub fn around_all(config: &MpmConfig) -> Vec<EnvelopeVertex> {
    let [[left, bottom], [right, top]] = config.domain;
    let (w, h) = (right - left, top - bottom);
    let corners = [
        [left - w, bottom - h],
        [right + w, bottom - h],
        [right + w, top + h],
        [left - w, top + h],
    ];
    outline(0, 0.0, &corners)
}

/// The outline of one body.
pub fn outline(body: u64, reach: f64, vertices: &[[f64; 2]]) -> Vec<EnvelopeVertex> {
    let vertex = |&position| EnvelopeVertex {
        body,
        position,
        reach,
    };
    vertices.iter().map(vertex).collect()
}

impl Bench {
    /// A coupled run of a continuum, ready, all of whose points are IMPs; [`Unmet::Declined`] when it refuses.
    ///
    /// # Errors
    /// [`Unmet`].
    pub fn flow(&self, config: &MpmConfig) -> Result<Flow<'_>, Unmet> {
        let mut flow = self.flow_by(&configure(config))?;
        flow.outlines = around_all(config);
        Ok(flow)
    }

    /// A run that is configured just so, without bodies.
    ///
    /// # Errors
    /// [`Unmet`].
    pub fn flow_by(&self, order: &Configure) -> Result<Flow<'_>, Unmet> {
        let mut session = self.session()?;
        session.hello()?;
        let ready = session.ready(order)?;
        Ok(Flow::new(session, ready, self.window, order.coupled))
    }
}

impl<'b> Flow<'b> {
    /// A run whose solver is ready, without bodies.
    pub(super) fn new(session: Session<'b>, ready: Ready, window: u64, coupled: bool) -> Self {
        Self {
            session,
            ready,
            window,
            budget: Budget::ALL,
            outlines: Vec::new(),
            travel: 0.0,
            flags: 0,
            set: Vec::new(),
            timeline: Timeline::new(),
            generation: 0,
            coupled,
        }
    }

    pub(super) fn timeline(&self) -> &Timeline {
        &self.timeline
    }

    /// Takes up a run in the middle.
    pub(super) fn go_on(&mut self, timeline: Timeline, generation: u64, set: Vec<ImpInfo>) {
        self.timeline = timeline;
        self.generation = generation;
        self.set = set;
    }
}

impl Flow<'_> {
    /// Number of the step that comes next.
    pub fn next(&self) -> u64 {
        self.timeline.clock.index()
    }

    /// Present time in s.
    pub fn time(&self) -> f64 {
        self.timeline.clock.time()
    }

    /// Generation of the IMP set.
    pub fn generation(&self) -> u64 {
        self.generation
    }

    /// The next grant: of `steps` steps of `dt` (s). A measured one begins an epoch, as one with another step does.
    pub fn next_grant(&mut self, dt: f64, steps: u64, measure: bool) -> Grant {
        self.timeline.next_grant(dt, steps, measure, &self.budget)
    }

    /// Begins an epoch of steps of `dt` (s), as the coupler does after a halt.
    pub fn begin_epoch(&mut self, dt: f64) {
        self.timeline.begin_epoch(dt);
    }

    /// Sends a grant.
    ///
    /// # Errors
    /// [`Unmet::Broken`] when the solver takes nothing.
    pub fn send_grant(&mut self, grant: &Grant) -> Result<(), Unmet> {
        self.send_grants(&[*grant])
    }

    /// Sends any number of grants in one message.
    ///
    /// # Errors
    /// [`Unmet::Broken`] when the solver takes nothing.
    pub fn send_grants(&mut self, grants: &[Grant]) -> Result<(), Unmet> {
        let header = self.timeline.header();
        self.session
            .send(&Message::new(header, Payload::Grant(grants.to_vec())))
    }

    /// Grants `steps` steps of `dt` (s).
    ///
    /// # Errors
    /// [`Unmet::Broken`] when the solver takes nothing.
    pub fn grant(&mut self, dt: f64, steps: u64, measure: bool) -> Result<(), Unmet> {
        let grant = self.next_grant(dt, steps, measure);
        self.send_grant(&grant)
    }

    /// Header of a message of the bodies in the next step.
    pub fn header(&self) -> StepHeader {
        StepHeader {
            flags: self.flags,
            travel: self.travel,
            set: self.generation,
            ..self.timeline.header()
        }
    }

    /// The next states message, whatever it says.
    ///
    /// # Errors
    /// [`Unmet::Broken`] when nothing comes.
    pub fn next_states(&mut self) -> Result<(StepHeader, Vec<ImpState>), Unmet> {
        let step = self.timeline.clock.index();
        let message = self.session.expect(Kind::States).map_err(|e| e.at(step))?;
        match message.payload {
            Payload::States(states) => Ok((message.header, states)),
            _ => unreachable!("only states come on their channel"),
        }
    }

    /// Sends the outlines, as asked for in the next step.
    ///
    /// # Errors
    /// [`Unmet::Broken`] when the solver takes nothing.
    pub fn send_outlines(&mut self) -> Result<(), Unmet> {
        let header = StepHeader {
            flags: 0,
            travel: 0.0,
            set: 0,
            ..self.header()
        };
        let outlines = Payload::Envelopes(self.outlines.clone());
        self.session.send(&Message::new(header, outlines))
    }

    /// Waits for the states of the next step; outlines are sent when they are asked for.
    ///
    /// # Errors
    /// [`Unmet::Broken`] when nothing comes, or a halt, or fewer than there are points in the set.
    pub fn states(&mut self) -> Result<Shown, Unmet> {
        let step = self.timeline.clock.step(false);
        let mut asked = Vec::new();
        let (header, states) = loop {
            let (header, states) = self.next_states()?;
            if header.flags & flags::WANT_ENVELOPES == 0 {
                break (header, states);
            }
            asked.push(header);
            self.send_outlines()?;
        };
        if header.flags & flags::HALT_BEFORE != 0 {
            return Err(broken("states", "HALT_BEFORE").at(step.index));
        }
        let mut new_set = None;
        if header.flags & flags::NEW_SET != 0 {
            // Sent before the states, so it is there.
            let Some(message) = self.session.take(Kind::Set)? else {
                return Err(
                    broken("a set before the states that announce it", "none").at(step.index)
                );
            };
            new_set = Some(message.header);
            if let Payload::Set(set) = message.payload {
                self.set = set;
            }
            self.generation = header.set;
        }
        if states.len() < self.set.len() {
            let expected = format_args!("{} states", self.set.len());
            return Err(broken(expected, states.len()).at(step.index));
        }
        Ok(Shown {
            step,
            header,
            states,
            asked,
            new_set,
        })
    }

    /// Sends the forces of the next step, with which it is done.
    ///
    /// # Errors
    /// [`Unmet::Broken`] when the solver takes nothing.
    pub fn forces(&mut self, forces: &[ImpForce]) -> Result<(), Unmet> {
        let message = Message::new(self.header(), Payload::Forces(forces.to_vec()));
        self.send_forces(&message)
    }

    /// The same of a message just so.
    ///
    /// # Errors
    /// [`Unmet::Broken`] when the solver takes nothing.
    pub fn send_forces(&mut self, message: &Message) -> Result<(), Unmet> {
        self.session.send(message)?;
        self.timeline.clock.advance();
        Ok(())
    }

    /// No force on any point.
    pub fn no_forces(&self) -> Vec<ImpForce> {
        vec![ImpForce::default(); self.set.len()]
    }

    /// One exchange of a granted step, in which nothing presses.
    ///
    /// # Errors
    /// [`Unmet::Broken`].
    pub fn exchange(&mut self) -> Result<Shown, Unmet> {
        let shown = self.states()?;
        self.forces(&self.no_forces())?;
        Ok(shown)
    }

    /// Waits for the report on the last grant.
    ///
    /// # Errors
    /// [`Unmet::Broken`] when nothing comes.
    pub fn report(&mut self) -> Result<Told, Unmet> {
        let step = self.timeline.clock.index();
        let message = self.session.expect(Kind::Report).map_err(|e| e.at(step))?;
        // Sent before the report, so it is there.
        let groups = self.session.take(Kind::Groups)?;
        let groups = groups.map(|message| match message.payload {
            Payload::Groups(groups) => (message.header, groups),
            _ => unreachable!("only groups come on their channel"),
        });
        let points = self.session.take(Kind::Points)?;
        let points = points.map(|message| match message.payload {
            Payload::Points(points) => (message.header, points),
            _ => unreachable!("only points come on their channel"),
        });
        let header = message.header;
        match message.payload {
            Payload::Report(reports) if !reports.is_empty() => Ok(Told {
                header,
                report: reports[0],
                groups,
                points,
            }),
            other => Err(broken("a report", format_args!("{other:?}")).at(step)),
        }
    }

    /// A window of one measured step with the forces that `press` returns; in an uncoupled run there are none.
    ///
    /// # Errors
    /// [`Unmet::Broken`].
    pub fn step(
        &mut self,
        dt: f64,
        press: impl FnOnce(&Self, &Shown) -> Vec<ImpForce>,
    ) -> Result<(Option<Shown>, Told), Unmet> {
        self.grant(dt, 1, true)?;
        let shown = if self.coupled {
            let shown = self.states()?;
            let forces = press(self, &shown);
            self.forces(&forces)?;
            Some(shown)
        } else {
            self.timeline.clock.advance();
            None
        };
        Ok((shown, self.report()?))
    }

    /// A window of one measured step in which nothing presses, of a coupled run.
    ///
    /// # Errors
    /// [`Unmet::Broken`].
    pub fn free_step(&mut self, dt: f64) -> Result<(Shown, Told), Unmet> {
        let (shown, told) = self.step(dt, |flow, _| flow.no_forces())?;
        let shown = shown.ok_or_else(|| broken("a coupled run", "none"))?;
        Ok((shown, told))
    }

    /// `steps` steps of `dt` (s), in windows, with the forces that `press` returns for the states at `t_n`.
    ///
    /// # Errors
    /// [`Unmet::Broken`], also when the solver halts although nothing limits.
    pub fn run(
        &mut self,
        dt: f64,
        steps: u64,
        mut press: impl FnMut(&Self, &Shown) -> Result<Vec<ImpForce>, Unmet>,
    ) -> Result<(), Unmet> {
        let end = self.next() + steps;
        while self.next() < end {
            let window = self.window.min(end - self.next());
            self.grant(dt, window, false)?;
            for _ in 0..window {
                if self.coupled {
                    let shown = self.states()?;
                    let forces = press(self, &shown)?;
                    self.forces(&forces)?;
                } else {
                    self.timeline.clock.advance();
                }
            }
            let report = self.report()?.report;
            if report.halted != 0 || report.next != self.next() {
                let got = format_args!("a halt before step {}", report.next);
                return Err(broken("a whole window", got).at(self.next()));
            }
        }
        Ok(())
    }

    /// `steps` free steps of `dt` (s), in windows.
    ///
    /// # Errors
    /// [`Unmet::Broken`].
    pub fn coast(&mut self, dt: f64, steps: u64) -> Result<(), Unmet> {
        self.run(dt, steps, |flow, _| Ok(flow.no_forces()))
    }

    /// Takes note of steps that were done otherwise.
    pub fn done(&mut self, steps: u64) {
        self.timeline.clock.advance_by(steps);
    }

    /// Asks for the end; returns the final points with their header. Close is left to the clause.
    ///
    /// # Errors
    /// [`Unmet::Broken`].
    pub fn drain(&mut self) -> Result<(StepHeader, Vec<PointState>), Unmet> {
        self.session.order(&Order::Drain)?;
        let notice = self.session.notice()?;
        if notice != interface::control::Notice::Bye {
            return Err(broken("Bye", format_args!("{notice:?}")));
        }
        match self.session.take(Kind::Points)? {
            Some(Message {
                header,
                payload: Payload::Points(points),
            }) => Ok((header, points)),
            _ => Err(broken("all points before Bye", "none")),
        }
    }
}
