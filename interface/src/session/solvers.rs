//! What the solvers of a session have sent to the coupler, and the clauses on it: S-2, V-1, R-1 to R-6, D-1, K-3.

use std::time::Duration;

use super::check;
use super::error::{SessionError, broken};
use super::pieces::Incoming;
use crate::config::capability::{CONTACTS, PLASTIC_STRAIN, SAVE};
use crate::message::control::{Configure, Hello, PROTOCOL, Party};
use crate::message::wire::{
    BodyState, Budget, ContactState, Grant, GroupState, PointState, Report, StepHeader, flags,
};
use crate::message::{Channel, Kind, Message, Records};
use crate::solver::Readiness;

/// Longest wait for a solver before the first step, unless the run sets another one: first to start and send Hello, then to
/// take its configuration, for which it may have to fill millions of points. The other solver meanwhile waits for two
/// minutes, so that the silent one is named (S-11).
pub const START: Duration = Duration::from_secs(100);

/// The configuration of one solver.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// Its part of the scene.
    pub configure: Configure,
    /// Groups or bodies in it: records of a measurement.
    pub measured: usize,
    /// The saved state from which it continues.
    pub restore: Option<Vec<u8>>,
}

/// The reports of the solvers on the last grant.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Round {
    /// The grant, without budgets.
    pub grant: Grant,
    /// Steps that both have done.
    pub steps: u64,
    /// Whether both may continue with the same step (clause L-5).
    pub within: bool,
    /// Point groups, if measured.
    pub groups: Vec<GroupState>,
    /// Bodies, if measured.
    pub bodies: Vec<BodyState>,
    /// All points, if a frame was asked for, and at the end.
    pub points: Vec<PointState>,
    /// Contacts, if a frame was requested and the bodies' side reports them.
    pub contacts: Vec<ContactState>,
}

/// What one solver has sent.
#[derive(Debug)]
pub(super) struct Sent {
    pub party: Party,
    pub hello: Option<Hello>,
    pub readiness: Option<Readiness>,
    /// Of its configuration.
    pub scene_hash: String,
    /// Records of a measurement.
    pub measured: usize,
    /// Longest wait for its report.
    pub deadline: Duration,
    /// First step that is not reported.
    pub step: u64,
    /// Its last grant.
    pub grant: Grant,
    pub report: Report,
    incoming: Incoming,
    pub saved: Option<Vec<u8>>,
    pub bye: bool,
}

impl Sent {
    fn by(party: Party) -> Self {
        Self {
            party,
            hello: None,
            readiness: None,
            scene_hash: String::new(),
            measured: 0,
            deadline: START,
            step: 0,
            grant: Grant::default(),
            report: Report::default(),
            incoming: Incoming::default(),
            saved: None,
            bye: false,
        }
    }

    pub fn has(&self, capability: &str) -> bool {
        self.hello
            .as_ref()
            .is_some_and(|h| h.capabilities.has(capability))
    }

    pub fn channel(&self, kind: Kind) -> Channel {
        Channel::of(self.party, kind)
    }

    pub fn broke(&self, clause: &'static str, message: String) -> SessionError {
        broken(self.party, clause, self.step, message)
    }

    /// S-2, V-1.
    pub fn greet(&mut self, hello: Hello) -> Result<(), SessionError> {
        if hello.party != self.party {
            let (own, theirs, who) = (self.party, hello.party, &hello.identity);
            let message = format!(
                "what was started as the {own} is `{who}`, which says that it is the {theirs}: it may be given by \
                 `--{theirs}` only"
            );
            return Err(self.broke("S-2", message));
        }
        let ((theirs, _), (ours, _)) = (hello.protocol, PROTOCOL);
        if theirs != ours {
            let message = format!(
                "`{}` speaks protocol {theirs}, this coupler speaks {ours}",
                hello.identity
            );
            return Err(self.broke("V-1", message));
        }
        self.hello = Some(hello);
        Ok(())
    }

    /// K-3: takes a piece of the saved state; returns whether it was the last one.
    pub fn piece(&mut self, header: &StepHeader, piece: &[u8]) -> Result<bool, SessionError> {
        match self.incoming.take(header, piece) {
            Ok(_) if self.grant.flags & flags::CHECKPOINT == 0 || self.saved.is_some() => {
                Err(self.broke("K-3", "a saved state that nobody asked for".into()))
            }
            Ok(whole) => {
                self.saved = whole;
                Ok(self.saved.is_some())
            }
            Err(message) => Err(self.broke("K-3", message)),
        }
    }

    /// takes the report on the last grant.
    pub fn report(&mut self, reports: &[Report]) -> Result<(), SessionError> {
        let [report] = *reports else {
            let message = format!("{} reports in one message", reports.len());
            return Err(self.broke("R-1", message));
        };
        check::number(self.party, "R-2", self.step, &report)?;
        let grant = &self.grant;
        let last = grant.first + grant.steps;
        let whole = report.next == last && report.halted == 0
            || (report.halted == 1 && report.next > grant.first && report.next < last);
        if report.epoch != grant.epoch || !whole {
            let message = format!(
                "report of epoch {} up to step {}, halted {}; granted {grant:?}",
                report.epoch, report.next, report.halted
            );
            return Err(self.broke("R-1", message));
        }
        let ready = self.readiness.as_ref();
        if let Some(message) = ready.and_then(|ready| ready.absurd(&report)) {
            return Err(self.broke("R-2", message));
        }
        let wanted = grant.flags & flags::MEASURE != 0;
        if wanted != (report.measured == 1) {
            let message = format!("measured is {}, asked for: {wanted}", report.measured);
            return Err(broken(self.party, "R-3", grant.first, message));
        }
        self.step = report.next;
        self.report = report;
        Ok(())
    }

    /// What the last grant made the solver send before its report, in this order.
    pub fn before_report(&self) -> impl Iterator<Item = Channel> + use<> {
        let asked = self.grant.flags;
        let measured = (asked & flags::MEASURE != 0).then_some(match self.party {
            Party::Mpm => Kind::Groups,
            _ => Kind::Bodies,
        });
        let listed = match self.party {
            Party::Mpm => Some(Kind::Points),
            _ => self.has(CONTACTS).then_some(Kind::Contacts),
        };
        let listed = listed.filter(|_| asked & flags::FRAME != 0);
        let party = self.party;
        measured
            .into_iter()
            .chain(listed)
            .map(move |kind| Channel::of(party, kind))
    }
}

/// What the solvers of a session have sent.
#[derive(Debug)]
pub struct Solvers {
    pub(super) each: Vec<Sent>,
    pub(super) round: Round,
}

impl Solvers {
    pub(super) fn new(parties: &[Party]) -> Self {
        Self {
            each: parties.iter().map(|&party| Sent::by(party)).collect(),
            round: Round::default(),
        }
    }

    pub(super) fn of(&self, party: Party) -> Option<&Sent> {
        self.each.iter().find(|sent| sent.party == party)
    }

    /// The Hello of `party`.
    pub fn hello(&self, party: Party) -> Option<&Hello> {
        self.of(party).and_then(|sent| sent.hello.as_ref())
    }

    /// Whether `party` lists this capability in its Hello.
    pub fn can(&self, party: Party, capability: &str) -> bool {
        self.of(party).is_some_and(|sent| sent.has(capability))
    }

    /// What `party` reported with Ready.
    pub fn readiness(&self, party: Party) -> Option<&Readiness> {
        self.of(party).and_then(|sent| sent.readiness.as_ref())
    }

    /// Its last report.
    pub fn report(&self, party: Party) -> Option<&Report> {
        self.of(party).map(|sent| &sent.report)
    }

    /// The state that it has saved, if the last grant asked for it.
    pub fn take_saved(&mut self, party: Party) -> Option<Vec<u8>> {
        let sent = self.each.iter_mut().find(|sent| sent.party == party);
        sent.and_then(|sent| sent.saved.take())
    }

    /// The answers to the last grant.
    pub fn round(&mut self) -> &mut Round {
        &mut self.round
    }

    /// First step that not all solvers have reported.
    pub(super) fn step(&self) -> u64 {
        let steps = self.each.iter().map(|sent| sent.step);
        steps.min().unwrap_or_default()
    }

    /// L-3, G-2: the grant of each solver.
    pub(super) fn grant(&mut self, grant: Grant, budgets: &[Budget]) -> Result<(), SessionError> {
        self.round.grant = grant;
        self.round.within = true;
        for (sent, &budget) in self.each.iter_mut().zip(budgets) {
            sent.grant = grant.within(budget);
            if !sent.has(SAVE) {
                sent.grant.flags &= !flags::CHECKPOINT;
            }
            check::number(Party::Coupler, "G-2", grant.first, &sent.grant)?;
        }
        Ok(())
    }

    /// L-5: the i-th solver has reported.
    pub(super) fn note_limits(&mut self, i: usize) {
        let Sent { grant, report, .. } = &self.each[i];
        self.round.within &= report.halted == 0 && grant.allows(&report.limits);
    }

    /// both sides stop before the same step. Sets the number of steps that are done.
    pub(super) fn stopped_alike(&mut self) -> Result<(), SessionError> {
        let mut ends = self.each.iter().map(|sent| sent.report.next);
        let first = self.round.grant.first;
        let end = ends.next().unwrap_or(first);
        if let Some(other) = ends.find(|&other| other != end) {
            let message = format!("the sides stopped at steps {end} and {other}");
            return Err(broken(Party::Mpm, "R-4", first, message));
        }
        self.round.steps = end - first;
        Ok(())
    }

    /// Takes records of a step of the i-th solver, which have to be as a clause says, at the end D-1.
    pub(super) fn take(
        &mut self,
        i: usize,
        Message { header, payload }: &Message,
        (clause, step): (&'static str, u64),
    ) -> Result<(), SessionError> {
        let (sent, records) = (&self.each[i], payload.records());
        let party = sent.party;
        if header.step != step || !check::counted(header, records) {
            let name = Channel::of(party, records.kind()).name();
            let message = format!(
                "{name} of step {} with {} records announced, {} there",
                header.step,
                header.count,
                records.len()
            );
            return Err(broken(party, clause, step, message));
        }
        check::numbers(party, clause, step, records)?;
        if matches!(records, Records::Groups(_) | Records::Bodies(_))
            && records.len() != sent.measured
        {
            let (got, expected) = (records.len(), sent.measured);
            let message = format!("{got} records of a measurement, expected {expected}");
            return Err(broken(party, clause, step, message));
        }
        let round = &mut self.round;
        match records {
            Records::Groups(groups) => copy(groups, &mut round.groups),
            Records::Bodies(bodies) => copy(bodies, &mut round.bodies),
            Records::Contacts(contacts) => copy(contacts, &mut round.contacts),
            Records::Points(points) => {
                check_points(sent, clause, step, points)?;
                copy(points, &mut round.points);
            }
            other => unreachable!("{:?} do not come before a report", other.kind()),
        }
        Ok(())
    }
}

/// The clause that requires the records of this kind before a report.
pub(super) fn clause_of(kind: Kind) -> &'static str {
    match kind {
        Kind::Points => "R-5",
        Kind::Contacts => "R-6",
        Kind::Saved => "K-3",
        _ => "R-3",
    }
}

/// Of the points of a frame, or at the end: at most as many as there are, in the order of their ids, and their plastic
/// strains, if the solver reports them.
fn check_points(
    sent: &Sent,
    clause: &'static str,
    step: u64,
    points: &[PointState],
) -> Result<(), SessionError> {
    let complain = |message| Err(broken(sent.party, clause, step, message));
    let ordered = points.windows(2).all(|pair| pair[0].id < pair[1].id);
    let known = sent.report.items;
    if points.len() as u64 > known || !ordered {
        return complain(format!(
            "{} points of {known}, ids rising: {ordered}",
            points.len()
        ));
    }
    if sent.has(PLASTIC_STRAIN) {
        let impossible =
            |p: &&PointState| !(p.plastic_strain >= 0.0 && p.plastic_strain.is_finite());
        if let Some(point) = points.iter().find(impossible) {
            let (id, strain) = (point.id, point.plastic_strain);
            return complain(format!("the plastic strain of point {id} is {strain}"));
        }
    }
    Ok(())
}

fn copy<T: Copy>(records: &[T], into: &mut Vec<T>) {
    into.clear();
    into.extend_from_slice(records);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 10^18 points and CPU times of centuries were taken and shown.
    #[test]
    fn counts_and_times_that_no_solver_can_have_are_refused() {
        type Spoil = fn(&mut Report);
        let report = |report: Report| {
            let mut sent = Sent::by(Party::Mpm);
            sent.readiness = Some(Readiness {
                items: 4,
                ..Readiness::default()
            });
            sent.grant.steps = 1;
            let result = sent.report(&[Report { next: 1, ..report }]);
            result.err().map(|error| error.to_string())
        };
        let sound = Report {
            items: 4,
            imps: 7,
            cpu_ns: 1 << 50,
            ..Report::default()
        };
        assert_eq!(report(sound), None);
        let rows: [(Spoil, &str); 4] = [
            (|report| report.items = 5, "items = 5, expected 4 at most"),
            (
                |report| report.imps = 1 << 40,
                "imps = 1099511627776, expected",
            ),
            (
                |report| report.cpu_ns = u64::MAX,
                "cpu_ns = 18446744073709551615",
            ),
            (|report| report.wait_ns = 1 << 61, "wait_ns"),
        ];
        for (spoil, words) in rows {
            let mut absurd = sound;
            spoil(&mut absurd);
            let message = report(absurd).unwrap();
            assert!(message.contains("the mpm broke clause R-2"), "{message}");
            assert!(message.contains(words), "{message}");
        }
    }
}
