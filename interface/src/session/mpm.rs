//! Drives a continuum solver through a session.

use iceoryx2::prelude::Service;

use super::SessionError;
use super::desk::{Desk, Next, broken, check, check_set};
use super::stopwatch::Activity;
use crate::channel::{
    Bell, ENVELOPES, GROUPS, IMP_FORCES, IMP_SET, IMP_STATES, Inlet, MPM_SEAT, Outlet, POINTS, Rope,
};
use crate::config::MpmConfig;
use crate::control::Party;
use crate::domain::Domain;
use crate::solver::MpmSolver;
use crate::step::{Clock, Step};
use crate::wait::wait;
use crate::wire::{EnvelopeVertex, Grant, ImpForce, Limits, PointState, Report, StepHeader, flags};

/// Joins the run of `domain` and serves until the session is closed.
///
/// `own_process`: whether this process is the solver's alone (for its CPU time).
///
/// # Errors
/// Any [`SessionError`]; the coupler has been told.
pub fn run<S: Service + 'static, M: MpmSolver>(
    domain: &Domain,
    solver: &mut M,
    own_process: bool,
) -> Result<(), SessionError> {
    let mut desk = Desk::<S>::open(
        domain,
        &MPM_SEAT,
        (solver.identity(), solver.capabilities()),
        own_process,
    )?;
    let served = serve(&mut desk, solver);
    if let Err(error) = &served {
        desk.lament(error);
    }
    served
}

fn serve<S: Service + 'static, M: MpmSolver>(
    desk: &mut Desk<S>,
    solver: &mut M,
) -> Result<(), SessionError> {
    let (configure, config) = desk.configure::<MpmConfig>()?;
    let readiness = match solver.configure(&config) {
        Ok(readiness) => readiness,
        Err(refusal) => return Err(desk.refuse(refusal)),
    };
    let groups = desk.post.outlet(&GROUPS)?;
    let points = desk.post.outlet(&POINTS)?;
    let mut bodies = if configure.coupled {
        let mut line = BodiesLine::open(desk, &config)?;
        let speeds = solver
            .points()
            .into_iter()
            .map(|p| p.velocity[0].hypot(p.velocity[1]));
        line.fastest = speeds.fold(0.0, f64::max);
        Some(line)
    } else {
        None
    };
    let items = readiness.items;
    desk.ready(&configure, readiness)?;
    loop {
        match desk.next()? {
            Next::Steps(grant) => {
                if grant.flags & flags::FRAME != 0 {
                    send_points(desk, solver, &points, "R-5")?;
                }
                let mut report = window(desk, solver, bodies.as_mut(), &grant)?;
                report.items = items;
                if report.measured == 1 {
                    let measurement = solver.measurement();
                    report.ledger = measurement.ledger;
                    check(Party::Mpm, "R-3", desk.step, &measurement.groups)?;
                    groups.send(
                        StepHeader {
                            step: grant.first,
                            ..StepHeader::default()
                        },
                        &measurement.groups,
                    )?;
                }
                desk.report(report)?;
            }
            Next::Drain => {
                send_points(desk, solver, &points, "D-1")?;
                return desk.close();
            }
        }
    }
}

/// Sends the whole cloud as it is before the next step.
fn send_points<S: Service + 'static, M: MpmSolver>(
    desk: &mut Desk<S>,
    solver: &M,
    outlet: &Outlet<S, PointState>,
    clause: &'static str,
) -> Result<(), SessionError> {
    let points = solver.points();
    check(Party::Mpm, clause, desk.step, &points)?;
    desk.watch.lap(Activity::Compute);
    let header = StepHeader {
        step: desk.step,
        ..StepHeader::default()
    };
    outlet.send(header, &points)?;
    desk.watch.lap(Activity::Exchange);
    Ok(())
}

/// The steps of one grant, or as many of them as the limits allow.
fn window<S: Service + 'static, M: MpmSolver>(
    desk: &mut Desk<S>,
    solver: &mut M,
    mut bodies: Option<&mut BodiesLine<S>>,
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
        if k > 0 && !grant.allows(&limits) {
            halted = true;
            if let Some(line) = &mut bodies {
                line.say(desk, grant, flags::HALT_BEFORE)?;
            }
            break;
        }
        let step = clock.step(k == 0 && grant.flags & flags::MEASURE != 0);
        limits = match &mut bodies {
            Some(line) => line.coupled_step(desk, solver, grant, &step)?,
            None => solver
                .step(&step, &[])
                .map_err(|fault| SessionError::Fault {
                    step: step.index,
                    fault,
                })?,
        };
        check(Party::Mpm, "L-1", step.index, &[limits])?;
        clock.advance();
        desk.step = clock.index();
        if let Some(line) = &bodies
            && line.halt_after
            && k + 1 < grant.steps
        {
            halted = true;
            break;
        }
    }
    let (imps, rebuilds) = bodies.map_or((0, 0), |line| (line.imps as u64, line.set));
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

/// The continuum's line to the bodies.
struct BodiesLine<S: Service> {
    set_out: Outlet<S, crate::wire::ImpInfo>,
    states_out: Outlet<S, crate::wire::ImpState>,
    forces_in: Inlet<S, ImpForce>,
    envelopes_in: Inlet<S, EnvelopeVertex>,
    rope: Rope<S>,
    bell: Bell<S>,
    /// Travel of points and surfaces together after which the set is built anew: the skin less half the largest
    /// radius, so that whatever may begin to touch within a step is in the set, and in the step limit, before it does.
    allowed_travel: f64,
    /// Smallest contact radius of any group, in m; 0 where the configuration leaves radii to the solver.
    radius_min: f64,
    /// Speed of the fastest point of all in m/s.
    fastest: f64,
    /// Generation of the IMP set; 0 before the first.
    set: u64,
    imps: usize,
    /// Travel of the bodies' surfaces since their envelopes were published.
    bodies_travel: f64,
    halt_after: bool,
    forces: Vec<ImpForce>,
    envelopes: Vec<EnvelopeVertex>,
}

impl<S: Service + 'static> BodiesLine<S> {
    fn open(desk: &Desk<S>, config: &MpmConfig) -> Result<Self, SessionError> {
        let radii = || {
            config
                .groups
                .iter()
                .filter_map(|group| group.contact_radius)
        };
        let radius_min = radii().fold(f64::INFINITY, f64::min);
        Ok(Self {
            set_out: desk.post.outlet(&IMP_SET)?,
            states_out: desk.post.outlet(&IMP_STATES)?,
            forces_in: desk.post.inlet(&IMP_FORCES)?,
            envelopes_in: desk.post.inlet(&ENVELOPES)?,
            rope: desk.post.rope(Party::Mpm, Party::Dem)?,
            bell: desk.post.bell(Party::Dem, Party::Mpm)?,
            allowed_travel: config.skin - 0.5 * radii().fold(0.0, f64::max),
            radius_min: if radius_min.is_finite() {
                radius_min
            } else {
                0.0
            },
            fastest: 0.0,
            set: 0,
            imps: 0,
            bodies_travel: 0.0,
            halt_after: false,
            forces: Vec::new(),
            envelopes: Vec::new(),
        })
    }

    fn header(&self, desk: &Desk<S>, grant: &Grant, flags: u64) -> StepHeader {
        StepHeader {
            epoch: grant.epoch,
            step: desk.step,
            flags,
            set: self.set,
            ..StepHeader::default()
        }
    }

    /// A message without states.
    fn say(&self, desk: &mut Desk<S>, grant: &Grant, flags: u64) -> Result<(), SessionError> {
        desk.watch.lap(Activity::Compute);
        self.states_out.send(self.header(desk, grant, flags), &[])?;
        self.rope.ring();
        desk.watch.lap(Activity::Exchange);
        Ok(())
    }

    fn coupled_step<M: MpmSolver>(
        &mut self,
        desk: &mut Desk<S>,
        solver: &mut M,
        grant: &Grant,
        step: &Step,
    ) -> Result<Limits, SessionError> {
        // Clause I-6.
        let new_set = self.set == 0 || solver.travel() + self.bodies_travel > self.allowed_travel;
        if new_set {
            self.rebuild(desk, solver, grant)?;
        }
        let travel = solver.travel();
        let states = solver.imp_states();
        desk.watch.lap(Activity::Compute);
        check(Party::Mpm, "I-3", step.index, states)?;
        let flags = if new_set { flags::NEW_SET } else { 0 };
        self.states_out
            .send(self.header(desk, grant, flags), states)?;
        self.rope.ring();
        desk.watch.lap(Activity::Exchange);

        let failed = |fault| SessionError::Fault {
            step: step.index,
            fault,
        };
        solver.predict(step).map_err(failed)?;
        self.await_forces(desk, grant, step.index)?;
        let limits = solver.correct(step, &self.forces).map_err(failed)?;
        desk.watch.lap(Activity::Compute);
        Ok(self.with_approach(limits, solver.travel() - travel, step))
    }

    /// The solver's limits with what the kinematic limit needs to know before there is an IMP: any point may become
    /// one, so the fastest of all counts, as far as its travel tells, and the smallest radius of any. A travel that has
    /// become infinite asks for a new set and tells no speed.
    fn with_approach(&mut self, limits: Limits, travelled: f64, step: &Step) -> Limits {
        if step.dt > 0.0 && travelled.is_finite() {
            self.fastest = travelled / step.dt;
        }
        Limits {
            speed: limits.speed.max(self.fastest),
            radius_min: self.radius_min,
            ..limits
        }
    }

    /// Chooses the IMPs anew from the bodies' present envelopes and announces them.
    fn rebuild<M: MpmSolver>(
        &mut self,
        desk: &mut Desk<S>,
        solver: &mut M,
        grant: &Grant,
    ) -> Result<(), SessionError> {
        self.say(desk, grant, flags::WANT_ENVELOPES)?;
        let (inlet, envelopes) = (&self.envelopes_in, &mut self.envelopes);
        let step = desk.step;
        let header = wait(
            desk.patience,
            || Ok(inlet.receive(envelopes)?),
            |nap| self.bell.sleep(nap),
            || desk.alarm(),
            |waited| SessionError::Late {
                who: Party::Dem,
                awaited: "the envelopes of the bodies",
                step,
                waited,
            },
        )?;
        desk.watch.lap(Activity::Wait);
        if header.step != step
            || header.epoch != grant.epoch
            || header.count != self.envelopes.len() as u64
        {
            let message = format!(
                "envelopes of step {} with {} vertices announced",
                header.step, header.count
            );
            return Err(broken(Party::Dem, "E-2", step, message));
        }
        check(Party::Dem, "E-3", step, &self.envelopes)?;
        let set = solver.select_imps(&self.envelopes);
        self.imps = set.len();
        self.set += 1;
        self.bodies_travel = 0.0;
        desk.watch.lap(Activity::Compute);
        check_set(set, step)?;
        let header = self.header(desk, grant, flags::NEW_SET);
        self.set_out.send(header, set)?;
        desk.watch.lap(Activity::Exchange);
        Ok(())
    }
}

impl<S: Service + 'static> BodiesLine<S> {
    /// Waits for the forces of this step.
    fn await_forces(
        &mut self,
        desk: &mut Desk<S>,
        grant: &Grant,
        step: u64,
    ) -> Result<(), SessionError> {
        let line = self;
        desk.watch.lap(Activity::Compute);
        let (inlet, forces) = (&line.forces_in, &mut line.forces);
        let header = wait(
            desk.patience,
            || Ok(inlet.receive(forces)?),
            |nap| line.bell.sleep(nap),
            || desk.alarm(),
            |waited| SessionError::Late {
                who: Party::Dem,
                awaited: "the contact forces",
                step,
                waited,
            },
        )?;
        desk.watch.lap(Activity::Wait);
        let complain = |clause, message| Err(broken(Party::Dem, clause, step, message));
        if header.step != step || header.epoch != grant.epoch {
            return complain(
                "F-2",
                format!("forces of step {} epoch {}", header.step, header.epoch),
            );
        }
        if header.set != line.set || forces.len() != line.imps || header.count != line.imps as u64 {
            let (set, imps) = (line.set, line.imps);
            let message = format!(
                "{} forces for set {}, expected {imps} for set {set}",
                forces.len(),
                header.set
            );
            return complain("F-3", message);
        }
        check(Party::Dem, "F-4", step, forces)?;
        check(Party::Dem, "F-4", step, &[header])?;
        for (slot, force) in forces.iter().enumerate() {
            if force.stiffness < 0.0 || (force.stiffness == 0.0 && force.force != [0.0, 0.0]) {
                return complain(
                    "F-5",
                    format!("slot {slot}: a force without the stiffness behind it: {force:?}"),
                );
            }
        }
        line.bodies_travel = header.travel;
        line.halt_after = header.flags & flags::HALT_AFTER != 0;
        desk.watch.lap(Activity::Exchange);
        Ok(())
    }
}
