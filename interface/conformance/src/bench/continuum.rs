//! A run with a continuum under test: the kit is the coupler and the bodies, whose outlines and forces a clause writes
//! down.

use interface::config::MpmConfig;
use interface::message::wire::{EnvelopeVertex, ImpForce, ImpState, PointState, StepHeader, flags};
use interface::message::{Kind, Payload};

use super::run::{Run, WindowReport, records};
use super::session::{Bench, configure};
use crate::verdict::{Unmet, broken};

/// The states that the continuum sent in a step.
#[derive(Debug, Clone, PartialEq)]
pub struct Shown {
    /// Their header.
    pub header: StepHeader,
    /// One for each point of the set.
    pub states: Vec<ImpState>,
    /// Headers of the empty states by which envelopes were asked for before.
    pub asked: Vec<StepHeader>,
    /// Header of the set that came with them.
    pub new_set: Option<StepHeader>,
}

/// Most steps granted at once where many are to be done.
const WINDOW: u64 = 64;

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
    pub fn run_continuum(&self, config: &MpmConfig) -> Result<Run<'_>, Unmet> {
        let mut run = self.run(&configure(config))?;
        run.outlines = around_all(config);
        Ok(run)
    }
}

impl Run<'_> {
    /// The next states message, whatever it says.
    pub fn next_states(&mut self) -> Result<(StepHeader, Vec<ImpState>), Unmet> {
        let message = self.expect(Kind::States)?;
        Ok(records!(message, States))
    }

    /// Sends the outlines, as asked for in the next step.
    pub fn send_outlines(&mut self) -> Result<(), Unmet> {
        let header = StepHeader {
            set: 0,
            flags: 0,
            travel: 0.0,
            ..self.header()
        };
        self.send(header, Payload::Envelopes(self.outlines.clone()))
    }

    /// Waits for the states of the next step; outlines are sent when they are asked for.
    pub fn states(&mut self) -> Result<Shown, Unmet> {
        let halt = broken("states", "HALT_BEFORE").at(self.next());
        self.states_or_halt()?.ok_or(halt)
    }

    /// The same, where the solver may halt before the step.
    pub fn states_or_halt(&mut self) -> Result<Option<Shown>, Unmet> {
        let step = self.next();
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
                return Err(broken(expected, "none").at(step));
            };
            let (of_set, set) = records!(message, Set);
            new_set = Some(of_set);
            self.at.set = set;
            self.at.generation = header.set;
        }
        if states.len() < self.at.set.len() {
            let expected = format_args!("{} states", self.at.set.len());
            return Err(broken(expected, states.len()).at(step));
        }
        Ok(Some(Shown {
            header,
            states,
            asked,
            new_set,
        }))
    }

    /// Sends the forces of the next step, with which it is done.
    pub fn press(&mut self, forces: &[ImpForce]) -> Result<(), Unmet> {
        self.send(self.header(), Payload::Forces(forces.to_vec()))?;
        self.done(1);
        Ok(())
    }

    /// No force on any point.
    pub fn no_forces(&self) -> Vec<ImpForce> {
        vec![ImpForce::default(); self.at.set.len()]
    }

    /// One exchange of a granted step, in which nothing presses.
    pub fn free(&mut self) -> Result<Shown, Unmet> {
        let shown = self.states()?;
        self.press(&self.no_forces())?;
        Ok(shown)
    }

    /// A window of one measured step in which nothing presses.
    pub fn free_step(&mut self, dt: f64) -> Result<(Shown, WindowReport), Unmet> {
        self.grant(dt, 1, true)?;
        let shown = self.free()?;
        Ok((shown, self.report()?))
    }

    /// `steps` steps of `dt` (s), in windows, in which nothing presses.
    pub fn coast(&mut self, dt: f64, steps: u64) -> Result<(), Unmet> {
        let end = self.next() + steps;
        while self.next() < end {
            let window = WINDOW.min(end - self.next());
            self.grant(dt, window, false)?;
            for _ in 0..window {
                if self.coupled {
                    self.free()?;
                } else {
                    self.done(1);
                }
            }
            self.ends(false, self.next())?;
        }
        Ok(())
    }

    /// Asks for the end; returns the final points with their header. Close is left to the clause.
    pub fn drain(&mut self) -> Result<(StepHeader, Vec<PointState>), Unmet> {
        self.session.bye()?;
        match self.session.take(Kind::Points)? {
            Some(message) => Ok(records!(message, Points)),
            None => Err(broken("all points before Bye", "none")),
        }
    }
}
