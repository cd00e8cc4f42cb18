//! The coupler's side of a session: which messages have arrived, and which one is next (PROTOCOL.md sections 2, 5 and
//! 9).

mod line;
mod question;
mod reports;

use std::time::Duration;

use self::line::{CONFIGURATION, Line};
pub use self::question::{Decision, Event, Part, Question, Round};
use super::pieces::Outgoing;
use super::{Action, Wait, check};
use crate::config::capability::SAVE;
use crate::core::error::{INDIRECT_WAIT_MARGIN, SessionError};
use crate::message::codec::encode;
use crate::message::control::{Configure, Hello, Notice, Order, Party};
use crate::message::wire::{Grant, Report, StepHeader, flags};
use crate::message::{Channel, Kind, Records};
use crate::solver::Readiness;

/// Longest wait for a solver to start and send Hello, unless the run sets another one.
const ARRIVAL: Duration = Duration::from_secs(30);

/// Deadlines of the coupler for the messages before the first step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// For a solver to join and send Hello.
    pub hello: Duration,
    /// For a solver to take its configuration.
    pub ready: Duration,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            hello: ARRIVAL,
            ready: CONFIGURATION,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    /// Hellos are awaited.
    Hello,
    /// The run decides the configuration of the solvers.
    Configuring,
    /// Configure is being sent to this solver.
    Telling(usize),
    /// A state is being sent to this solver.
    Restoring(usize),
    /// Readies are awaited.
    Ready,
    /// The run is told that all solvers are ready.
    Beginning,
    /// The run decides what comes next.
    Deciding,
    /// The grant is being sent to this solver.
    Granting(usize),
    /// The report of this solver is awaited.
    Report(usize),
    /// The messages that this solver sent before its report are taken.
    Taking(usize),
    /// The run is told of the reports.
    Collecting,
    /// Drain is being sent to this solver.
    Draining(usize),
    /// Byes are awaited.
    Bye,
    /// All points are taken.
    Points,
    /// The run is told that all points have arrived.
    Noting,
    /// Close is being sent to this solver.
    Closing(usize),
    /// Abort is being sent to this solver.
    Aborting(usize),
    /// The session is over.
    Ended,
}

/// The coupler's side of a session.
#[derive(Debug)]
pub struct Coupler {
    lines: Vec<Line>,
    limits: Limits,
    state: State,
    order: Vec<u8>,
    round: Round,
    /// Channels of messages that were sent before the report and have not been taken yet.
    to_take: Vec<Channel>,
    /// Header of the message that is being sent.
    header_to_send: StepHeader,
    verdict: Option<Result<(), SessionError>>,
}

impl Coupler {
    /// A session with these solvers and deadlines.
    pub fn new(solvers: &[Party], limits: Limits) -> Self {
        Self {
            limits,
            lines: solvers.iter().map(|&party| Line::new(party)).collect(),
            state: State::Hello,
            order: Vec::new(),
            round: Round::default(),
            to_take: Vec::new(),
            header_to_send: StepHeader::default(),
            verdict: None,
        }
    }

    /// What to do first.
    pub fn start(&mut self) -> Action<Question> {
        self.await_notices()
    }

    /// How the session ended; `None` before it has.
    pub fn verdict(&self) -> Option<&Result<(), SessionError>> {
        self.verdict.as_ref()
    }

    /// Moves out how the session ended.
    pub fn take_verdict(&mut self) -> Option<Result<(), SessionError>> {
        self.verdict.take()
    }

    /// The notices of all solvers: looked at during every long wait.
    pub fn notices(&self) -> impl Iterator<Item = Channel> {
        self.lines.iter().map(|line| line.channel(Kind::Notice))
    }

    /// The header of the message that is to be sent.
    pub fn header_to_send(&self) -> &StepHeader {
        &self.header_to_send
    }

    /// Whether no grant has been sent yet: an interrupt then ends the session at once.
    pub fn is_arriving(&self) -> bool {
        matches!(self.state, State::Hello | State::Ready)
    }

    /// The Hello of `party`.
    pub fn hello(&self, party: Party) -> Option<&Hello> {
        self.line(party).and_then(|line| line.hello.as_ref())
    }

    /// Whether `party` lists this capability in its Hello.
    pub fn can(&self, party: Party, capability: &str) -> bool {
        let hello = self.hello(party);
        hello.is_some_and(|hello| hello.capabilities.has(capability))
    }

    /// What `party` reported with Ready.
    pub fn readiness(&self, party: Party) -> Option<&Readiness> {
        self.line(party).and_then(|line| line.readiness.as_ref())
    }

    /// Its last report.
    pub fn report(&self, party: Party) -> Option<&Report> {
        self.line(party).map(|line| &line.report)
    }

    /// The state that it has saved, if the last grant asked for it.
    pub fn take_saved(&mut self, party: Party) -> Option<Vec<u8>> {
        let line = self.lines.iter_mut().find(|line| line.party == party);
        line.and_then(|line| line.saved.take())
    }

    /// First step that `party` has not reported.
    pub fn step_of(&self, party: Party) -> u64 {
        self.line(party).map_or(0, |line| line.step)
    }

    /// The answers of the solvers to the last grant.
    pub fn round(&mut self) -> &mut Round {
        &mut self.round
    }

    /// Records of the message that is to be sent.
    pub fn ready_to_send(&self, channel: Channel) -> Records<'_> {
        let line = self.line(channel.to()).expect("a solver of this session");
        match channel.kind {
            Kind::Grant => Records::Grant(&line.grant),
            Kind::Restore => {
                let state = line.restore.as_ref().expect("a state is being sent");
                Records::Restore(state.piece().0)
            }
            _ => Records::Order(&self.order),
        }
    }

    fn line(&self, party: Party) -> Option<&Line> {
        self.lines.iter().find(|line| line.party == party)
    }

    /// The next action after an event.
    pub fn on(&mut self, event: Event<'_>) -> Action<Question> {
        if self.state == State::Ended {
            return Action::End;
        }
        match self.react(event) {
            Ok(action) => action,
            Err(error) => self.fail(error),
        }
    }

    fn fail(&mut self, error: SessionError) -> Action<Question> {
        if let State::Aborting(i) = self.state {
            // If it cannot be sent, no further error is needed.
            return self.abort(i + 1);
        }
        let reason = match &error {
            SessionError::Aborted(reason) => reason.clone(),
            other => other.to_string(),
        };
        self.order = encode(&Order::Abort(reason));
        self.verdict = Some(Err(error));
        self.abort(0)
    }

    /// Tells the solvers from the i-th on that the session is over.
    fn abort(&mut self, i: usize) -> Action<Question> {
        if i == self.lines.len() {
            self.state = State::Ended;
            return Action::End;
        }
        self.state = State::Aborting(i);
        self.send_order(i)
    }

    fn react(&mut self, event: Event<'_>) -> Result<Action<Question>, SessionError> {
        match event {
            Event::Received(channel, header, records) => self.received(channel, &header, records),
            Event::Absent(channel) => Err(self.absent(channel)),
            Event::Sent => Ok(self.sent()),
            Event::Expired(waited) => Err(self.late(waited)),
            Event::Gone(who, how) => Err(SessionError::Vanished {
                who,
                how,
                step: self.step_of(who),
            }),
            Event::Broken(error) => Err(error.into()),
            Event::Stopped(reason) => Err(SessionError::Aborted(reason)),
            Event::Done(decision) => self.decided(decision),
        }
    }

    fn received(
        &mut self,
        channel: Channel,
        header: &StepHeader,
        records: Records<'_>,
    ) -> Result<Action<Question>, SessionError> {
        let i = self
            .lines
            .iter()
            .position(|line| line.party == channel.from())
            .expect("a solver of this session");
        match records {
            Records::Notice(bytes) => self.noticed(i, bytes),
            Records::Report(reports) => self.reported(i, reports),
            Records::Saved(piece) => self.piece(i, header, piece),
            Records::Groups(groups) => {
                self.measured(i, header, records)?;
                self.round.groups.clear();
                self.round.groups.extend_from_slice(groups);
                Ok(self.take_next(i))
            }
            Records::Bodies(bodies) => {
                self.measured(i, header, records)?;
                self.round.bodies.clear();
                self.round.bodies.extend_from_slice(bodies);
                Ok(self.take_next(i))
            }
            Records::Contacts(contacts) => {
                self.before_report(i, "R-6", header, records)?;
                self.round.contacts.clear();
                self.round.contacts.extend_from_slice(contacts);
                Ok(self.take_next(i))
            }
            Records::Points(points) => self.points(i, header, points),
            _ => unreachable!("{channel:?} does not lead to the coupler"),
        }
    }

    fn noticed(&mut self, i: usize, bytes: &[u8]) -> Result<Action<Question>, SessionError> {
        let line = &mut self.lines[i];
        let notice = Notice::decode(bytes).map_err(|e| line.broke("S-1", e.to_string()))?;
        match (self.state, notice) {
            (_, Notice::Failed(failure)) => {
                return Err(SessionError::Failed {
                    who: line.party,
                    failure,
                });
            }
            (State::Hello, Notice::Hello(hello)) if line.hello.is_none() => line.greet(hello)?,
            (State::Telling(_) | State::Restoring(_) | State::Ready, Notice::Ready(ready))
                if line.readiness.is_none() =>
            {
                if ready.scene_hash != line.scene_hash {
                    let (theirs, ours) = (ready.scene_hash, &line.scene_hash);
                    let message = format!("ready for scene {theirs}, the coupler's is {ours}");
                    return Err(line.broke("S-6", message));
                }
                if let Some(message) = ready.readiness.impossible_value() {
                    return Err(line.broke("S-6", message));
                }
                line.readiness = Some(ready.readiness);
            }
            (State::Telling(_) | State::Restoring(_) | State::Ready, Notice::Refused(refusal)) => {
                return Err(SessionError::Refused {
                    who: line.party,
                    refusal,
                });
            }
            (State::Draining(_) | State::Bye, Notice::Bye) if !line.bye => line.bye = true,
            (State::Aborting(_) | State::Ended, _) => {}
            (_, notice) => return Err(line.broke("S-2", format!("{notice:?} out of turn"))),
        }
        Ok(self.await_notices())
    }

    /// Waits for notices until all have arrived, and then begins the next phase.
    fn await_notices(&mut self) -> Action<Question> {
        let missing = self.missing().map(|line| line.party);
        match (self.state, missing) {
            (State::Hello, None) => {
                self.state = State::Configuring;
                Action::Do(Question::Configure)
            }
            (State::Ready, None) => {
                self.state = State::Beginning;
                Action::Do(Question::Ready)
            }
            (State::Bye, None) => {
                if self.line(Party::Mpm).is_some() {
                    self.state = State::Points;
                    return Action::Take(Channel::of(Party::Mpm, Kind::Points));
                }
                self.round.points.clear();
                self.state = State::Noting;
                Action::Do(Question::Drained)
            }
            (_, Some(party)) => {
                let mut notices = self.notices();
                let at_most = match self.state {
                    State::Hello => self.limits.hello,
                    State::Ready => self.limits.ready,
                    _ => CONFIGURATION,
                };
                Action::Wait(Wait {
                    on: [notices.next(), notices.next(), None],
                    from: party,
                    at_most,
                })
            }
            (state, None) => unreachable!("no notice is awaited in {state:?}"),
        }
    }

    /// The first solver whose notice is still missing.
    fn missing(&self) -> Option<&Line> {
        let state = self.state;
        self.lines.iter().find(|line| match state {
            State::Hello => line.hello.is_none(),
            State::Ready => line.readiness.is_none(),
            State::Bye => !line.bye,
            _ => false,
        })
    }

    fn decided(&mut self, decision: Decision) -> Result<Action<Question>, SessionError> {
        match (self.state, decision) {
            (State::Configuring, Decision::Configure(parts)) => {
                for (line, part) in self.lines.iter_mut().zip(parts) {
                    if line.readiness.is_some() {
                        continue; // it was configured in the session before
                    }
                    line.scene_hash.clone_from(&part.configure.scene_hash);
                    line.measured = part.measured;
                    // A solver may itself wait for the other one, which has this deadline.
                    line.deadline =
                        Duration::from_secs_f64(part.configure.deadline) + INDIRECT_WAIT_MARGIN;
                    line.restore = part.restore.map(Outgoing::new);
                    line.grant = [Grant::default()];
                    let configure = Configure {
                        restore: line.restore.is_some(),
                        ..part.configure
                    };
                    line.configure(configure)?;
                }
                Ok(self.tell(0))
            }
            (State::Beginning | State::Collecting, Decision::Noted) => {
                self.state = State::Deciding;
                Ok(Action::Do(Question::Next))
            }
            (State::Deciding, Decision::Grant(grant, budgets)) => {
                self.round.grant = grant;
                for (line, [omega_sq, speed, damping]) in self.lines.iter_mut().zip(budgets) {
                    let flags = if line.has(SAVE) {
                        grant.flags
                    } else {
                        grant.flags & !flags::CHECKPOINT
                    };
                    line.grant = [Grant {
                        flags,
                        budget_omega_sq: omega_sq,
                        budget_speed: speed,
                        budget_damping: damping,
                        ..grant
                    }];
                    check::number(Party::Coupler, "G-2", grant.first, &line.grant[0])?;
                }
                Ok(self.grant(0))
            }
            (State::Deciding, Decision::Drain) => {
                self.order = encode(&Order::Drain);
                Ok(self.drain(0))
            }
            (State::Noting, Decision::Noted) => {
                self.order = encode(&Order::Close);
                Ok(self.close(0))
            }
            (state, decision) => unreachable!("{decision:?} in {state:?}"),
        }
    }

    fn sent(&mut self) -> Action<Question> {
        match self.state {
            State::Telling(i) if self.lines[i].restore.is_some() => {
                self.state = State::Restoring(i);
                self.send_piece(i)
            }
            State::Telling(i) => self.tell(i + 1),
            State::Restoring(i) => {
                let state = self.lines[i].restore.as_mut();
                if state.is_some_and(Outgoing::sent) {
                    return self.send_piece(i);
                }
                self.lines[i].restore = None;
                self.tell(i + 1)
            }
            State::Granting(i) => self.grant(i + 1),
            State::Draining(i) => self.drain(i + 1),
            State::Closing(i) => self.close(i + 1),
            State::Aborting(i) => self.abort(i + 1),
            state => unreachable!("something sent in {state:?}"),
        }
    }

    fn tell(&mut self, i: usize) -> Action<Question> {
        if i == self.lines.len() {
            self.state = State::Ready;
            return self.await_notices();
        }
        if self.lines[i].told.is_empty() {
            return self.tell(i + 1);
        }
        self.state = State::Telling(i);
        self.order = core::mem::take(&mut self.lines[i].told);
        self.send_order(i)
    }

    fn grant(&mut self, i: usize) -> Action<Question> {
        if i == self.lines.len() {
            self.round.within = true;
            return self.await_report(0);
        }
        self.state = State::Granting(i);
        let grant = &self.lines[i].grant[0];
        let header = StepHeader {
            epoch: grant.epoch,
            step: grant.first,
            count: 1,
            ..StepHeader::default()
        };
        self.send(i, Kind::Grant, header)
    }

    fn drain(&mut self, i: usize) -> Action<Question> {
        if i == self.lines.len() {
            self.state = State::Bye;
            return self.await_notices();
        }
        self.state = State::Draining(i);
        self.send_order(i)
    }

    fn close(&mut self, i: usize) -> Action<Question> {
        if i == self.lines.len() {
            self.verdict = Some(Ok(()));
            self.state = State::Ended;
            return Action::End;
        }
        self.state = State::Closing(i);
        self.send_order(i)
    }

    fn send_order(&mut self, i: usize) -> Action<Question> {
        let header = StepHeader {
            count: self.order.len() as u64,
            ..StepHeader::default()
        };
        self.send(i, Kind::Order, header)
    }

    fn send_piece(&mut self, i: usize) -> Action<Question> {
        let state = self.lines[i]
            .restore
            .as_ref()
            .expect("a state is being sent");
        let (piece, flags) = state.piece();
        let header = StepHeader {
            flags,
            count: piece.len() as u64,
            ..StepHeader::default()
        };
        self.send(i, Kind::Restore, header)
    }

    fn send(&mut self, i: usize, kind: Kind, header: StepHeader) -> Action<Question> {
        self.header_to_send = header;
        Action::Send(self.lines[i].channel(kind))
    }

    fn await_report(&mut self, i: usize) -> Action<Question> {
        if i == self.lines.len() {
            return match self.stopped_alike() {
                Ok(steps) => {
                    self.round.steps = steps;
                    self.state = State::Collecting;
                    Action::Do(Question::Collected)
                }
                Err(error) => self.fail(error),
            };
        }
        self.state = State::Report(i);
        let line = &self.lines[i];
        let mut on = [Some(line.channel(Kind::Report)), None, None];
        if self.round.grant.flags & flags::CHECKPOINT != 0 {
            for (slot, line) in on[1..].iter_mut().zip(&self.lines) {
                *slot = Some(line.channel(Kind::Saved));
            }
        }
        Action::Wait(Wait {
            on,
            from: line.party,
            at_most: line.deadline,
        })
    }

    fn late(&self, waited: Duration) -> SessionError {
        let (line, awaited) = match self.state {
            State::Report(i) => (Some(&self.lines[i]), "its report"),
            State::Hello => (self.missing(), "its hello"),
            State::Ready => (self.missing(), "that it is ready"),
            _ => (self.missing(), "its goodbye"),
        };
        SessionError::Late {
            who: line.map_or(Party::Coupler, |line| line.party),
            awaited,
            step: line.map_or(0, |line| line.step),
            waited,
        }
    }
}
