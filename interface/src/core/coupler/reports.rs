//! The clauses on reports, and on the messages before them, D-1, K-3.

use super::question::Question;
use super::{Coupler, State};
use crate::config::capability::{CONTACTS, PLASTIC_STRAIN, SAVE};
use crate::core::error::{SessionError, broken};
use crate::core::{Action, check};
use crate::message::control::Party;
use crate::message::wire::{PointState, Report, StepHeader, flags};
use crate::message::{Channel, Kind, Records};

impl Coupler {
    /// Checks, and then takes what was sent before the report.
    pub(super) fn reported(
        &mut self,
        i: usize,
        reports: &[Report],
    ) -> Result<Action<Question>, SessionError> {
        let asked = self.round.grant.flags;
        let line = &mut self.lines[i];
        let [report] = *reports else {
            let message = format!("{} reports in one message", reports.len());
            return Err(line.broke("R-1", message));
        };
        check::number(line.party, "R-2", line.step, &report)?;
        let grant = &line.grant[0];
        let last = grant.first + grant.steps;
        let whole = report.next == last && report.halted == 0
            || (report.halted == 1 && report.next > grant.first && report.next < last);
        if report.epoch != grant.epoch || !whole {
            let message = format!(
                "report of epoch {} up to step {}, halted {}; granted {grant:?}",
                report.epoch, report.next, report.halted
            );
            return Err(line.broke("R-1", message));
        }
        let wanted = asked & flags::MEASURE != 0;
        if wanted != (report.measured == 1) {
            let message = format!("measured is {}, asked for: {wanted}", report.measured);
            return Err(broken(line.party, "R-3", grant.first, message));
        }
        if asked & flags::CHECKPOINT != 0 && line.has(SAVE) && line.saved.is_none() {
            // The pieces were sent before the report, and nobody has looked at them since.
            self.to_take.push(line.channel(Kind::Saved));
        }
        self.round.within &= report.halted == 0 && grant.allows(&report.limits);
        line.step = report.next;
        line.report = report;
        let frame = asked & flags::FRAME != 0;
        if wanted {
            let kind = if line.party == Party::Mpm {
                Kind::Groups
            } else {
                Kind::Bodies
            };
            self.to_take.push(line.channel(kind));
        }
        if frame && line.party == Party::Mpm {
            self.to_take.push(line.channel(Kind::Points));
        }
        if frame && line.party == Party::Dem && line.has(CONTACTS) {
            self.to_take.push(line.channel(Kind::Contacts));
        }
        self.to_take.reverse();
        self.state = State::Taking(i);
        Ok(self.take_next(i))
    }

    pub(super) fn take_next(&mut self, i: usize) -> Action<Question> {
        match self.to_take.pop() {
            Some(channel) => Action::Take(channel),
            None => self.await_report(i + 1),
        }
    }

    pub(super) fn piece(
        &mut self,
        i: usize,
        header: &StepHeader,
        piece: &[u8],
    ) -> Result<Action<Question>, SessionError> {
        let asked = self.round.grant.flags & flags::CHECKPOINT != 0;
        let line = &mut self.lines[i];
        let whole = match line.incoming.take(header, piece) {
            Ok(whole) if asked && line.saved.is_none() => whole,
            Ok(_) => return Err(line.broke("K-3", "a saved state that nobody asked for".into())),
            Err(message) => return Err(line.broke("K-3", message)),
        };
        let channel = line.channel(Kind::Saved);
        let ended = whole.is_some();
        if ended {
            line.saved = whole;
        }
        match self.state {
            State::Taking(_) if ended => Ok(self.take_next(i)),
            State::Taking(_) => Ok(Action::Take(channel)),
            State::Report(j) => Ok(self.await_report(j)),
            state => unreachable!("a piece of a state in {state:?}"),
        }
    }

    /// checks the step, the number of records and the numbers.
    pub(super) fn measured(
        &self,
        i: usize,
        header: &StepHeader,
        records: Records<'_>,
    ) -> Result<(), SessionError> {
        self.before_report(i, "R-3", header, records)?;
        let (got, expected) = (records.len(), self.lines[i].measured);
        if got == expected {
            return Ok(());
        }
        let message = format!("{got} records of a measurement, expected {expected}");
        let step = self.round.grant.first;
        Err(broken(self.lines[i].party, "R-3", step, message))
    }

    pub(super) fn before_report(
        &self,
        i: usize,
        clause: &'static str,
        header: &StepHeader,
        records: Records<'_>,
    ) -> Result<(), SessionError> {
        let (party, step) = (self.lines[i].party, self.round.grant.first);
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
        check::numbers(party, clause, step, records)
    }

    /// R-5 and D-1: all points that remain, in the order of their ids.
    pub(super) fn points(
        &mut self,
        i: usize,
        header: &StepHeader,
        points: &[PointState],
    ) -> Result<Action<Question>, SessionError> {
        let records = Records::Points(points);
        let frame = matches!(self.state, State::Taking(_));
        let (clause, step) = if frame {
            ("R-5", self.round.grant.first)
        } else {
            ("D-1", self.lines[i].step)
        };
        if frame {
            self.before_report(i, clause, header, records)?;
        } else if header.step != step || !check::counted(header, records) {
            let message = format!(
                "{} points of step {} announced, {} there",
                header.count,
                header.step,
                points.len()
            );
            return Err(broken(Party::Mpm, clause, step, message));
        }
        check::numbers(Party::Mpm, clause, step, records)?;
        let ordered = points.windows(2).all(|pair| pair[0].id < pair[1].id);
        let known = self.lines[i].report.items;
        if points.len() as u64 > known || !ordered {
            let message = format!("{} points of {known}, ids rising: {ordered}", points.len());
            return Err(broken(Party::Mpm, clause, step, message));
        }
        if self.lines[i].has(PLASTIC_STRAIN) {
            let strain = points.iter().find(|p| {
                let strain = p.plastic_strain;
                !(strain >= 0.0 && strain.is_finite())
            });
            if let Some(point) = strain {
                let (id, strain) = (point.id, point.plastic_strain);
                let message = format!("the plastic strain of point {id} is {strain}");
                return Err(broken(Party::Mpm, clause, step, message));
            }
        }
        self.round.points.clear();
        self.round.points.extend_from_slice(points);
        if frame {
            return Ok(self.take_next(i));
        }
        self.state = State::Noting;
        Ok(Action::Do(Question::Drained))
    }

    /// both sides stop before the same step.
    pub(super) fn stopped_alike(&self) -> Result<u64, SessionError> {
        let mut ends = self.lines.iter().map(|line| line.report.next);
        let first = self.round.grant.first;
        let end = ends.next().unwrap_or(first);
        match ends.find(|&other| other != end) {
            None => Ok(end - first),
            Some(other) => {
                let message = format!("the sides stopped at steps {end} and {other}");
                Err(broken(Party::Mpm, "R-4", first, message))
            }
        }
    }

    pub(super) fn absent(&self, channel: Channel) -> SessionError {
        let (clause, before) = match (channel.kind, self.state) {
            (Kind::Points, State::Points) => ("D-1", "goodbye"),
            (Kind::Points, _) => ("R-5", "report"),
            (Kind::Contacts, _) => ("R-6", "report"),
            (Kind::Saved, _) => ("K-3", "report"),
            _ => ("R-3", "report"),
        };
        let message = format!("nothing on {} before the {before}", channel.name());
        let step = match self.state {
            State::Points => self.step_of(channel.from()),
            _ => self.round.grant.first,
        };
        broken(channel.from(), clause, step, message)
    }
}
