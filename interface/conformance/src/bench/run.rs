//! A run in the order of section 5: the kit is the coupler and the other side, whose messages a clause writes down. It
//! grants, keeps time, counts sets, and judges nothing but that an answer comes.

use interface::message::control::{Configure, Order, Ready};
use interface::message::wire::{
    BodyState, Budget, ContactState, EnvelopeVertex, Grant, GroupState, ImpInfo, ImpState,
    PointState, Report, StepHeader, flags,
};
use interface::message::{Kind, Message, Payload};
use interface::step::{Clock, Step};

use super::session::{Bench, Session};
use crate::verdict::{Unmet, broken, require};

/// Mass points, and their states in the next step: positions at `t_n`, velocities at `t_{n-1/2}`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Points {
    /// Who they are, ids rising.
    pub set: Vec<ImpInfo>,
    /// Where they are.
    pub states: Vec<ImpState>,
}

/// Where a run stands, as far as the kit knows.
#[derive(Debug, Clone)]
pub struct RunState {
    clock: Clock,
    /// The epoch that it is in; 0 before the first.
    epoch: u64,
    /// Generation of the IMP set.
    pub generation: u64,
    /// The IMPs, slot by slot.
    pub set: Vec<ImpInfo>,
}

/// A message with its header.
pub type Sent<T> = Option<(StepHeader, Vec<T>)>;

/// What the solver reported on a window.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct WindowReport {
    /// Its header.
    pub header: StepHeader,
    /// The report.
    pub report: Report,
    /// Reports in its message.
    pub reports: usize,
    /// Header and records of the bodies' states, if they were sent before it.
    pub bodies: Sent<BodyState>,
    /// The same of groups.
    pub groups: Sent<GroupState>,
    /// The same of all points.
    pub points: Sent<PointState>,
    /// The same of the contacts of a frame.
    pub contacts: Sent<ContactState>,
}

/// The records that were sent before a report, `count` of them at least.
pub fn at_least<'a, T>(
    sent: Option<&'a (StepHeader, Vec<T>)>,
    count: usize,
    what: &str,
) -> Result<&'a [T], Unmet> {
    match sent {
        Some((_, records)) if records.len() >= count => Ok(records),
        Some((_, records)) => Err(broken(format_args!("{count} {what}"), records.len())),
        None => Err(broken(format_args!("{what} before the report"), "none")),
    }
}

/// Header and records of a message of a channel that carries nothing else.
macro_rules! records {
    ($message:expr, $kind:ident) => {{
        let message: interface::message::Message = $message;
        match message.payload {
            interface::message::Payload::$kind(records) => (message.header, records),
            _ => unreachable!("a channel carries one kind of records"),
        }
    }};
}
pub(super) use records;

/// A run that the kit leads.
pub struct Run<'b> {
    /// The session with the solver.
    pub session: Session<'b>,
    /// What the solver reported of itself.
    pub ready: Ready,
    /// Of the grants to come.
    pub budget: Budget,
    /// The points that the kit is, in clauses of both sides.
    pub points: Points,
    /// Outlines of the bodies that the kit is, answered when they are asked for.
    pub outlines: Vec<EnvelopeVertex>,
    /// Of their forces to come (F-9).
    pub travel: f64,
    /// Flags of their forces to come.
    pub flags: u64,
    /// Where it stands.
    pub at: RunState,
    pub(super) coupled: bool,
    /// The set of the continuum that the kit is has not been sent.
    pub(super) fresh: bool,
}

impl Bench {
    /// A run that is configured just so, and ready; [`Unmet::Declined`] when the solver refuses it.
    pub fn run(&self, order: &Configure) -> Result<Run<'_>, Unmet> {
        let mut session = self.greeted()?;
        let ready = session.ready(order)?;
        let start = RunState {
            clock: Clock::new(0.0),
            epoch: 0,
            generation: 0,
            set: Vec::new(),
        };
        Ok(Self::led(session, ready, order, start))
    }

    /// A run that goes on in a fresh solver, from where it stood when `state` was saved.
    pub fn resumed(
        &self,
        order: &Configure,
        state: &[u8],
        stand: &RunState,
    ) -> Result<Run<'_>, Unmet> {
        let mut session = self.greeted()?;
        match session.restore(order, state) {
            Err(Unmet::Declined(why)) => Err(broken("Ready after the restored state", why)),
            ready => Ok(Self::led(session, ready?, order, stand.clone())),
        }
    }

    fn led<'b>(session: Session<'b>, ready: Ready, order: &Configure, at: RunState) -> Run<'b> {
        Run {
            session,
            ready,
            budget: Budget::UNLIMITED,
            points: Points::default(),
            outlines: Vec::new(),
            travel: 0.0,
            flags: 0,
            at,
            coupled: order.coupled,
            fresh: false,
        }
    }
}

impl<'b> Run<'b> {
    /// Ends the run in order.
    pub fn closed(mut self) -> Result<Session<'b>, Unmet> {
        self.session.close()?;
        Ok(self.session)
    }

    /// Ends the run by an Abort.
    pub fn aborted(mut self) -> Result<Session<'b>, Unmet> {
        let order = Order::Abort("the kit has seen enough".into());
        self.session.order(&order)?;
        Ok(self.session)
    }

    /// Number of the step that comes next.
    pub fn next(&self) -> u64 {
        self.at.clock.index()
    }

    /// The step that comes next, as a solver sees it.
    pub fn coming(&self, measure: bool) -> Step {
        self.at.clock.step(measure)
    }

    /// Takes note of steps that were done otherwise.
    pub fn done(&mut self, steps: u64) {
        self.at.clock.advance_by(steps);
    }

    /// Begins an epoch of steps of `dt` (s), as the coupler does after a halt.
    pub fn begin_epoch(&mut self, dt: f64) {
        self.at.clock.begin_epoch(dt);
        self.at.epoch += 1;
    }

    /// The next grant: of `steps` steps of `dt` (s). A measured one begins an epoch, as one with another step does.
    pub fn next_grant(&mut self, dt: f64, steps: u64, measure: bool) -> Grant {
        if measure || self.at.epoch == 0 || dt != self.at.clock.dt() {
            self.begin_epoch(dt);
        }
        let (epoch_start, steps_in_epoch, dt_before_epoch) = self.at.clock.epoch();
        Grant {
            epoch: self.at.epoch,
            first: self.next(),
            steps,
            flags: if measure { flags::MEASURE } else { 0 },
            epoch_start,
            steps_in_epoch,
            dt_before_epoch,
            dt,
            ..Grant::default()
        }
        .within(self.budget)
    }

    /// Sends a grant.
    pub fn send_grant(&mut self, grant: Grant) -> Result<(), Unmet> {
        let header = StepHeader {
            epoch: grant.epoch,
            step: grant.first,
            ..StepHeader::default()
        };
        let grant = Payload::Grant(vec![grant]);
        self.session.send(&Message::new(header, grant))
    }

    /// Grants `steps` steps of `dt` (s).
    pub fn grant(&mut self, dt: f64, steps: u64, measure: bool) -> Result<(), Unmet> {
        let grant = self.next_grant(dt, steps, measure);
        self.send_grant(grant)
    }

    /// Header of a message of the kit in the next step.
    pub fn header(&self) -> StepHeader {
        StepHeader {
            epoch: self.at.epoch,
            step: self.next(),
            set: self.at.generation,
            flags: self.flags,
            travel: self.travel,
            ..StepHeader::default()
        }
    }

    /// Sends what belongs to the next step.
    pub(super) fn send(&mut self, header: StepHeader, payload: Payload) -> Result<(), Unmet> {
        self.session.send(&Message::new(header, payload))
    }

    /// Waits for a message of the next step.
    pub(super) fn expect(&mut self, kind: Kind) -> Result<Message, Unmet> {
        let step = self.next();
        self.session.expect(kind).map_err(|e| e.at(step))
    }

    /// Waits for the report on the last grant; what belongs to it was sent before, so it is there.
    pub fn report(&mut self) -> Result<WindowReport, Unmet> {
        let message = self.expect(Kind::Report)?;
        let step = self.next();
        let (header, reports) = records!(message, Report);
        let Some(&report) = reports.first() else {
            return Err(broken("a report", "none in its message").at(step));
        };
        let mut received = WindowReport {
            header,
            report,
            reports: reports.len(),
            ..WindowReport::default()
        };
        macro_rules! take {
            ($kind:ident) => {
                self.session
                    .take(Kind::$kind)?
                    .map(|message| records!(message, $kind))
            };
        }
        if self.session.is_of_bodies() {
            (received.bodies, received.contacts) = (take!(Bodies), take!(Contacts));
        } else {
            (received.groups, received.points) = (take!(Groups), take!(Points));
        }
        Ok(received)
    }

    /// Waits for the report on a window that ends before the step `next`, by a halt or not.
    pub fn ends(&mut self, halted: bool, next: u64) -> Result<(), Unmet> {
        let report = self.report()?.report;
        let expected = format_args!("halted = {}, next = {next}", u64::from(halted));
        let got = format_args!("halted = {}, next = {}", report.halted, report.next);
        let agrees = (report.halted, report.next) == (u64::from(halted), next);
        require(agrees, expected, got).map_err(|e| e.at(next))
    }
}
