//! A run with a continuum under test: the kit is the coupler and the bodies, whose outlines and forces a clause writes
//! down.

use interface::config::MpmConfig;
use interface::message::control::{Configure, Notice, Order};
use interface::message::wire::{EnvelopeVertex, ImpForce, ImpState, PointState, StepHeader, flags};
use interface::step::Step;
use interface::transport::raw::{Kind, Message, Payload};

use super::kit_run::{KitRun, WindowReport, is_kit_run, records};
use super::session::{Bench, configure};
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

/// A run with a continuum under test.
pub struct ContinuumRun<'b> {
    /// What is the same whichever side is under test.
    pub lead: KitRun<'b>,
    /// Outlines of the bodies, answered when they are asked for.
    pub outlines: Vec<EnvelopeVertex>,
    /// Of the forces to come (F-9).
    pub travel: f64,
    /// Flags of the forces to come.
    pub flags: u64,
}

is_kit_run!(ContinuumRun);

impl<'b> From<KitRun<'b>> for ContinuumRun<'b> {
    /// A run without bodies.
    fn from(lead: KitRun<'b>) -> Self {
        Self {
            lead,
            outlines: Vec::new(),
            travel: 0.0,
            flags: 0,
        }
    }
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
    pub fn run_continuum(&self, config: &MpmConfig) -> Result<ContinuumRun<'_>, Unmet> {
        let mut flow = self.flow_by(&configure(config))?;
        flow.outlines = around_all(config);
        Ok(flow)
    }

    /// A run that is configured just so, without bodies.
    pub fn flow_by(&self, order: &Configure) -> Result<ContinuumRun<'_>, Unmet> {
        self.run_coupled(order).map(ContinuumRun::from)
    }
}

impl ContinuumRun<'_> {
    /// Header of a message of the bodies in the next step.
    pub fn header(&self) -> StepHeader {
        StepHeader {
            flags: self.flags,
            travel: self.travel,
            ..self.lead.header()
        }
    }

    /// The next states message, whatever it says.
    pub fn next_states(&mut self) -> Result<(StepHeader, Vec<ImpState>), Unmet> {
        let message = self.expect(Kind::States)?;
        Ok(records!(message, States))
    }

    /// Sends the outlines, as asked for in the next step.
    pub fn send_outlines(&mut self) -> Result<(), Unmet> {
        let header = StepHeader {
            set: 0,
            ..self.lead.header()
        };
        let outlines = Payload::Envelopes(self.outlines.clone());
        self.session.send(&Message::new(header, outlines))
    }

    /// Waits for the states of the next step; outlines are sent when they are asked for.
    pub fn states(&mut self) -> Result<Shown, Unmet> {
        let halt = broken("states", "HALT_BEFORE").at(self.next());
        self.states_or_halt()?.ok_or(halt)
    }

    /// The same, where the solver may halt before the step.
    pub fn states_or_halt(&mut self) -> Result<Option<Shown>, Unmet> {
        let step = self.next_step();
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
            return Ok(None);
        }
        let mut new_set = None;
        if header.flags & flags::NEW_SET != 0 {
            // Sent before the states, so it is there.
            let Some(message) = self.session.take(Kind::Set)? else {
                let expected = "a set before the states that announce it";
                return Err(broken(expected, "none").at(step.index));
            };
            let (of_set, set) = records!(message, Set);
            new_set = Some(of_set);
            self.at.set = set;
            self.at.generation = header.set;
        }
        if states.len() < self.imps().len() {
            let expected = format_args!("{} states", self.imps().len());
            return Err(broken(expected, states.len()).at(step.index));
        }
        Ok(Some(Shown {
            step,
            header,
            states,
            asked,
            new_set,
        }))
    }

    /// Sends the forces of the next step, with which it is done.
    pub fn forces(&mut self, forces: &[ImpForce]) -> Result<(), Unmet> {
        let message = Message::new(self.header(), Payload::Forces(forces.to_vec()));
        self.send_forces(&message)
    }

    /// The same of a message just so.
    pub fn send_forces(&mut self, message: &Message) -> Result<(), Unmet> {
        self.session.send(message)?;
        self.done(1);
        Ok(())
    }

    /// No force on any point.
    pub fn no_forces(&self) -> Vec<ImpForce> {
        vec![ImpForce::default(); self.imps().len()]
    }

    /// One exchange of a granted step, in which nothing presses.
    pub fn exchange(&mut self) -> Result<Shown, Unmet> {
        let shown = self.states()?;
        self.forces(&self.no_forces())?;
        Ok(shown)
    }

    /// A granted step with the forces that `press` returns; in an uncoupled run there is nothing to exchange.
    fn pressed(
        &mut self,
        press: impl FnOnce(&Self, &Shown) -> Result<Vec<ImpForce>, Unmet>,
    ) -> Result<Option<Shown>, Unmet> {
        if !self.coupled {
            self.done(1);
            return Ok(None);
        }
        let shown = self.states()?;
        let forces = press(self, &shown)?;
        self.forces(&forces)?;
        Ok(Some(shown))
    }

    /// A window of one measured step with the forces that `press` returns; in an uncoupled run there are none.
    pub fn step(
        &mut self,
        dt: f64,
        press: impl FnOnce(&Self, &Shown) -> Vec<ImpForce>,
    ) -> Result<(Option<Shown>, WindowReport), Unmet> {
        self.grant(dt, 1, true)?;
        let shown = self.pressed(|flow, shown| Ok(press(flow, shown)))?;
        Ok((shown, self.report()?))
    }

    /// A window of one measured step in which nothing presses, of a coupled run.
    pub fn free_step(&mut self, dt: f64) -> Result<(Shown, WindowReport), Unmet> {
        let (shown, told) = self.step(dt, |flow, _| flow.no_forces())?;
        let shown = shown.ok_or_else(|| broken("a coupled run", "none"))?;
        Ok((shown, told))
    }

    /// `steps` steps of `dt` (s), in windows, with the forces that `press` returns for the states at `t_n`.
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
                self.pressed(&mut press)?;
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
    pub fn coast(&mut self, dt: f64, steps: u64) -> Result<(), Unmet> {
        self.run(dt, steps, |flow, _| Ok(flow.no_forces()))
    }

    /// Asks for the end; returns the final points with their header. Close is left to the clause.
    pub fn drain(&mut self) -> Result<(StepHeader, Vec<PointState>), Unmet> {
        self.session.order(&Order::Drain)?;
        let notice = self.session.notice()?;
        if notice != Notice::Bye {
            return Err(broken("Bye", format_args!("{notice:?}")));
        }
        match self.session.take(Kind::Points)? {
            Some(message) => Ok(records!(message, Points)),
            None => Err(broken("all points before Bye", "none")),
        }
    }
}
