//! Drives a rigid-body solver through a session.

use iceoryx2::prelude::Service;

use super::SessionError;
use super::desk::{Desk, Next, broken, check, check_set};
use super::stopwatch::Activity;
use crate::channel::{
    BODIES, Bell, DEM_SEAT, ENVELOPES, IMP_FORCES, IMP_SET, IMP_STATES, Inlet, Outlet, Rope,
};
use crate::config::DemConfig;
use crate::control::Party;
use crate::domain::Domain;
use crate::solver::{Answer, DemSolver};
use crate::step::{Clock, Step};
use crate::wait::wait;
use crate::wire::{
    EnvelopeVertex, Grant, ImpForce, ImpInfo, ImpState, Limits, Report, StepHeader, flags,
};

/// Joins the run of `domain` and serves until the session is closed.
///
/// `own_process`: whether this process is the solver's alone (for its CPU time).
///
/// # Errors
/// Any [`SessionError`]; the coupler has been told.
pub fn run<S: Service + 'static, D: DemSolver>(
    domain: &Domain,
    solver: &mut D,
    own_process: bool,
) -> Result<(), SessionError> {
    let mut desk = Desk::<S>::open(
        domain,
        &DEM_SEAT,
        (solver.identity(), solver.capabilities()),
        own_process,
    )?;
    let served = serve(&mut desk, solver);
    if let Err(error) = &served {
        desk.lament(error);
    }
    served
}

fn serve<S: Service + 'static, D: DemSolver>(
    desk: &mut Desk<S>,
    solver: &mut D,
) -> Result<(), SessionError> {
    let (configure, config) = desk.configure::<DemConfig>()?;
    let readiness = match solver.configure(&config) {
        Ok(readiness) => readiness,
        Err(refusal) => return Err(desk.refuse(refusal)),
    };
    let bodies = desk.post.outlet(&BODIES)?;
    let mut points = if configure.coupled {
        Some(PointsLine::open(desk)?)
    } else {
        None
    };
    let items = readiness.items;
    desk.ready(&configure, readiness)?;
    loop {
        match desk.next()? {
            Next::Steps(grant) => {
                let mut report = window(desk, solver, points.as_mut(), &grant)?;
                report.items = items;
                if report.measured == 1 {
                    let measurement = solver.measurement();
                    report.ledger = measurement.ledger;
                    check(Party::Dem, "R-3", desk.step, &measurement.bodies)?;
                    bodies.send(
                        StepHeader {
                            step: grant.first,
                            ..StepHeader::default()
                        },
                        &measurement.bodies,
                    )?;
                }
                desk.report(report)?;
            }
            Next::Drain => return desk.close(),
        }
    }
}

/// The steps of one grant, or as many of them as the limits allow.
fn window<S: Service + 'static, D: DemSolver>(
    desk: &mut Desk<S>,
    solver: &mut D,
    mut points: Option<&mut PointsLine<S>>,
    grant: &Grant,
) -> Result<Report, SessionError> {
    let mut clock = Clock::within_epoch(
        grant.first,
        grant.epoch_start,
        grant.steps_in_epoch,
        grant.dt_before_epoch,
        grant.dt,
    );
    let mut limits = Limits::default();
    let mut halted = false;
    for k in 0..grant.steps {
        let step = clock.step(k == 0 && grant.flags & flags::MEASURE != 0);
        let answer = match &mut points {
            Some(line) => {
                let Some(answer) = line.answer(desk, solver, grant, &step)? else {
                    halted = true;
                    break;
                };
                answer
            }
            None => solver
                .contact(&step, &[], &mut [])
                .map_err(|fault| SessionError::Fault {
                    step: step.index,
                    fault,
                })?,
        };
        limits = answer.limits;
        check(Party::Dem, "L-1", step.index, &[limits])?;
        solver.advance(&step).map_err(|fault| SessionError::Fault {
            step: step.index,
            fault,
        })?;
        clock.advance();
        desk.step = clock.index();
        if !grant.allows(&limits) && k + 1 < grant.steps {
            halted = true;
            break;
        }
    }
    let (imps, rebuilds) = points.map_or((0, 0), |line| (line.set.len() as u64, line.generation));
    Ok(Report {
        epoch: grant.epoch,
        halted: halted.into(),
        measured: (grant.flags & flags::MEASURE != 0).into(),
        imps,
        rebuilds,
        limits,
        ..Report::default()
    })
}

/// The bodies' line to the continuum.
struct PointsLine<S: Service> {
    set_in: Inlet<S, ImpInfo>,
    states_in: Inlet<S, ImpState>,
    forces_out: Outlet<S, ImpForce>,
    envelopes_out: Outlet<S, EnvelopeVertex>,
    rope: Rope<S>,
    bell: Bell<S>,
    /// Generation of the IMP set; 0 before the first.
    generation: u64,
    set: Vec<ImpInfo>,
    states: Vec<ImpState>,
    forces: Vec<ImpForce>,
}

impl<S: Service + 'static> PointsLine<S> {
    fn open(desk: &Desk<S>) -> Result<Self, SessionError> {
        Ok(Self {
            set_in: desk.post.inlet(&IMP_SET)?,
            states_in: desk.post.inlet(&IMP_STATES)?,
            forces_out: desk.post.outlet(&IMP_FORCES)?,
            envelopes_out: desk.post.outlet(&ENVELOPES)?,
            rope: desk.post.rope(Party::Dem, Party::Mpm)?,
            bell: desk.post.bell(Party::Mpm, Party::Dem)?,
            generation: 0,
            set: Vec::new(),
            states: Vec::new(),
            forces: Vec::new(),
        })
    }

    /// Takes the IMPs of this step and answers their forces; `None` when the continuum halts before it.
    fn answer<D: DemSolver>(
        &mut self,
        desk: &mut Desk<S>,
        solver: &mut D,
        grant: &Grant,
        step: &Step,
    ) -> Result<Option<Answer>, SessionError> {
        loop {
            let header = self.await_states(desk, grant, step)?;
            if header.flags & flags::HALT_BEFORE != 0 {
                return Ok(None);
            }
            if header.flags & flags::WANT_ENVELOPES != 0 {
                let envelopes = solver.envelopes();
                check(Party::Dem, "E-3", step.index, envelopes)?;
                let header = StepHeader {
                    epoch: grant.epoch,
                    step: step.index,
                    ..StepHeader::default()
                };
                self.envelopes_out.send(header, envelopes)?;
                self.rope.ring();
                desk.watch.lap(Activity::Exchange);
                continue;
            }
            if header.flags & flags::NEW_SET != 0 {
                self.take_set(&header, step)?;
                solver.imp_set(&self.set);
                desk.watch.lap(Activity::Compute);
            }
            self.check_states(&header, step)?;
            break;
        }
        // Forces never accumulate from one step to the next.
        self.forces.clear();
        self.forces.resize(self.set.len(), ImpForce::default());
        desk.watch.lap(Activity::Exchange);
        let answer = solver
            .contact(step, &self.states, &mut self.forces)
            .map_err(|fault| SessionError::Fault {
                step: step.index,
                fault,
            })?;
        desk.watch.lap(Activity::Compute);
        let halt = if grant.allows(&answer.limits) {
            0
        } else {
            flags::HALT_AFTER
        };
        let header = StepHeader {
            epoch: grant.epoch,
            step: step.index,
            flags: halt,
            travel: answer.travel,
            set: self.generation,
            ..StepHeader::default()
        };
        check(Party::Dem, "F-4", step.index, &self.forces)?;
        check(Party::Dem, "F-4", step.index, &[header])?;
        self.forces_out.send(header, &self.forces)?;
        self.rope.ring();
        desk.watch.lap(Activity::Exchange);
        Ok(Some(answer))
    }

    fn await_states(
        &mut self,
        desk: &mut Desk<S>,
        grant: &Grant,
        step: &Step,
    ) -> Result<StepHeader, SessionError> {
        desk.watch.lap(Activity::Compute);
        let (inlet, states) = (&self.states_in, &mut self.states);
        let header = wait(
            desk.patience,
            || Ok(inlet.receive(states)?),
            |nap| self.bell.sleep(nap),
            || desk.alarm(),
            |waited| SessionError::Late {
                who: Party::Mpm,
                awaited: "the states of the points",
                step: step.index,
                waited,
            },
        )?;
        desk.watch.lap(Activity::Wait);
        if header.step != step.index || header.epoch != grant.epoch {
            let message = format!("states of step {} epoch {}", header.step, header.epoch);
            return Err(broken(Party::Mpm, "I-1", step.index, message));
        }
        Ok(header)
    }

    fn take_set(&mut self, states: &StepHeader, step: &Step) -> Result<(), SessionError> {
        let complain = |message: String| Err(broken(Party::Mpm, "I-2", step.index, message));
        // The set was sent before the states that announce it.
        let Some(header) = self.set_in.receive(&mut self.set)? else {
            return complain(format!(
                "nothing on {} although the states announce a set",
                self.set_in.name()
            ));
        };
        if header.set != states.set
            || header.set != self.generation + 1
            || header.count != self.set.len() as u64
        {
            let (set, next, count) = (header.set, self.generation + 1, header.count);
            return complain(format!(
                "set {set} of {count} announced for states of set {}, {next} is next",
                states.set
            ));
        }
        check_set(&self.set, step.index)?;
        self.generation = header.set;
        Ok(())
    }

    fn check_states(&self, header: &StepHeader, step: &Step) -> Result<(), SessionError> {
        let (sent, expected) = (self.states.len(), self.set.len());
        if header.set != self.generation || sent != expected || header.count != expected as u64 {
            let message = format!(
                "{sent} states for set {}, expected {expected} for set {}",
                header.set, self.generation
            );
            return Err(broken(Party::Mpm, "I-3", step.index, message));
        }
        check(Party::Mpm, "I-3", step.index, &self.states)
    }
}
