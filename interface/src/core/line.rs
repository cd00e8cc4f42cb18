//! A solver's connection to the coupler: the common part of both sides' sessions (PROTOCOL.md sections 2, 5 and 9).

mod report;

use std::time::Duration;

use super::check;
use super::error::{INDIRECT_WAIT_MARGIN, SessionError, broken};
use super::event::{Action, Done, Event, Task, Wait};
use super::pieces::{Incoming, Mark, Outgoing, solver_part};
use crate::config::capability::Capabilities;
use crate::message::codec::{decode, encode};
use crate::message::control::{Configure, Failure, Hello, Notice, Order, PROTOCOL, Party, Ready};
use crate::message::wire::{Grant, Limits, Report, StepHeader, flags};
use crate::message::{Channel, Kind, Records};
use crate::solver::{Readiness, Refusal};
use crate::step::{Clock, Step};

/// Longest wait for the coupler before the first grant: the other solver may be filling a large scene.
const SETUP: Duration = Duration::from_mins(2);

/// Longest wait for the coupler's answer to a Failed that blames the other solver for its silence. If there is no
/// answer, the coupler is the silent party.
const ANSWER: Duration = Duration::from_millis(500);

/// Largest number of a step, and of a set, in a saved state or a grant, so that counting up from it does not overflow.
const LATEST: u64 = 1 << 62;

/// State of the session.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    /// Nothing has been sent.
    Start,
    /// Hello is being sent.
    Hello,
    /// Configure is awaited.
    Configure,
    /// Pieces of a state to restore are awaited.
    Restore,
    /// The solver takes its configuration.
    Configuring,
    /// The solver restores a saved state.
    Restoring,
    /// Channels are being opened.
    Opening,
    /// Ready is being sent.
    Ready,
    /// A grant is awaited, or Drain.
    Grant,
    /// All points are being sent, before the window.
    Frame,
    /// The state is being sent, before the window.
    Checkpoint,
    /// The steps of a window: the side's own states.
    Window,
    /// The measurement is being sent.
    Measuring,
    /// The contacts of a frame are being sent, after the window.
    Listing,
    /// The report is being sent.
    Reporting,
    /// All points are being sent, at the end.
    Draining,
    /// Bye is being sent.
    Bye,
    /// Close is awaited.
    Close,
    /// Refused is being sent.
    Refusing,
    /// The Abort that answers Refused is awaited.
    Refused,
    /// Failed is being sent.
    Failing,
    /// The Abort that answers Failed is awaited; Failed blamed the other solver for its silence.
    Blaming,
    /// The session is over.
    Ended,
}

/// What follows an event: an action, or a decision of the side.
#[derive(Debug, PartialEq)]
pub(crate) enum Next {
    /// This action.
    Act(Action),
    /// The side reads its configuration.
    Parse,
    /// The side begins a step, or the window is over.
    Step,
}

/// A solver's line to the coupler.
#[derive(Debug)]
pub struct Line {
    party: Party,
    identity: String,
    capabilities: Capabilities,
    state: State,
    /// What is awaited, in words, and from whom.
    awaited: (&'static str, Party),
    configure: Option<Configure>,
    deadline: Duration,
    items: u64,
    incoming: Incoming,
    /// A saved state: the machine's part, then the solver's.
    restored: Option<Vec<u8>>,
    /// First step that is not done.
    pub(crate) step: u64,
    /// The grant under way.
    pub(crate) grant: Grant,
    clock: Clock,
    /// Steps of the grant that are done.
    pub(crate) done: u64,
    /// Limits after the last step.
    pub(crate) limits: Limits,
    /// Number of IMPs at present, and number of sets so far.
    pub(crate) imps: u64,
    pub(crate) set: u64,
    /// The part of a saved state that belongs to the side's own machine.
    pub(crate) carried: [f64; 2],
    notice: Vec<u8>,
    report: [Report; 1],
    outgoing: Outgoing,
    /// Header of the message that is being sent.
    header_to_send: StepHeader,
    verdict: Option<Result<(), SessionError>>,
}

impl Line {
    pub(crate) fn new(party: Party, identity: String, capabilities: Capabilities) -> Self {
        Self {
            party,
            identity,
            capabilities,
            state: State::Start,
            awaited: ("", Party::Coupler),
            configure: None,
            deadline: SETUP,
            items: 0,
            incoming: Incoming::default(),
            restored: None,
            step: 0,
            grant: Grant::default(),
            clock: Clock::new(0.0),
            done: 0,
            limits: Limits::default(),
            imps: 0,
            set: 0,
            carried: [0.0; 2],
            notice: Vec::new(),
            report: [Report::default()],
            outgoing: Outgoing::default(),
            header_to_send: StepHeader::default(),
            verdict: None,
        }
    }

    /// Which side it is.
    pub fn party(&self) -> Party {
        self.party
    }

    /// First step that is not done.
    pub fn step(&self) -> u64 {
        self.step
    }

    /// How the session ended; `None` before it has.
    pub fn verdict(&self) -> Option<&Result<(), SessionError>> {
        self.verdict.as_ref()
    }

    /// Moves out how the session ended.
    pub fn take_verdict(&mut self) -> Option<Result<(), SessionError>> {
        self.verdict.take()
    }

    /// The records of messages that the machine itself makes; `None` if the solver makes them.
    pub fn ready_to_send(&self, kind: Kind) -> Option<Records<'_>> {
        match kind {
            Kind::Notice => Some(Records::Notice(&self.notice)),
            Kind::Report => Some(Records::Report(&self.report)),
            Kind::Saved => Some(Records::Saved(self.outgoing.piece().0)),
            _ => None,
        }
    }

    /// The header of the message that is to be sent.
    pub fn header_to_send(&self) -> &StepHeader {
        &self.header_to_send
    }

    /// Writes times into the report that is to be sent.
    pub fn stamp(&mut self, stamp: impl FnOnce(&mut Report)) {
        stamp(&mut self.report[0]);
    }

    /// The configuration as received.
    pub(crate) fn configuration(&self) -> &Configure {
        self.configure.as_ref().expect("Configure has come")
    }

    /// The solver's part of the state to restore.
    pub(crate) fn restored(&self) -> &[u8] {
        solver_part(self.restored.as_deref().unwrap_or_default())
    }

    /// The present step.
    pub fn present(&self) -> Step {
        self.clock
            .step(self.done == 0 && self.grant.flags & flags::MEASURE != 0)
    }

    /// Waits for a message of this channel.
    pub(crate) fn wait(&mut self, channel: Channel, awaited: &'static str) -> Action {
        self.awaited = (awaited, channel.from());
        Action::Wait(Wait::on(channel, self.deadline))
    }

    /// The solver's Hello.
    pub fn hello(&self) -> Hello {
        Hello {
            protocol: PROTOCOL,
            party: self.party,
            identity: self.identity.clone(),
            pid: std::process::id(),
            capabilities: self.capabilities.clone(),
        }
    }

    pub(crate) fn start(&mut self) -> Action {
        let hello = Notice::Hello(self.hello());
        self.say(State::Hello, &hello)
    }

    /// Ends the session with `error`. The coupler is told, unless it knows already.
    pub(crate) fn fail(&mut self, error: SessionError) -> Action {
        let (fault, message) = match &error {
            SessionError::Fault { fault, .. } => (Some(fault.clone()), fault.to_string()),
            other => (None, other.to_string()),
        };
        let told = matches!(
            self.state,
            State::Failing | State::Blaming | State::Ended | State::Refused | State::Refusing
        ) || matches!(
            error,
            SessionError::Aborted(_) | SessionError::CouplerGone { .. }
        );
        // The first reason is the cause of all later ones.
        self.verdict.get_or_insert(Err(error));
        if told {
            self.state = State::Ended;
            return Action::End;
        }
        let step = self.step;
        self.say(
            State::Failing,
            &Notice::Failed(Failure {
                step,
                fault,
                message,
            }),
        )
    }

    pub(crate) fn on(&mut self, event: Event<'_>) -> Result<Next, SessionError> {
        if self.state == State::Ended {
            return Ok(Next::Act(Action::End));
        }
        match event {
            Event::Received(_, Records::Order(bytes)) => self.ordered(bytes),
            Event::Received(header, Records::Grant(grants)) => self.granted(header, grants),
            Event::Received(header, Records::Restore(piece)) => self.piece(header, piece),
            Event::Opened => {
                self.state = State::Ready;
                let header = self.plain(self.notice.len());
                Ok(Next::Act(self.send(Kind::Notice, header)))
            }
            Event::Sent => Ok(self.sent()),
            Event::Done(done) => self.task_done(done),
            Event::Expired(waited) => self.expired(waited),
            Event::CouplerGone => Err(SessionError::CouplerGone { step: self.step }),
            Event::Broken(error) => Err((*error).into()),
            Event::Received(..) | Event::Absent => {
                unreachable!("{event:?} in {:?}: not waited for", self.state)
            }
        }
    }

    fn ordered(&mut self, bytes: &[u8]) -> Result<Next, SessionError> {
        let order = decode(bytes).map_err(|e| self.coupler_broke("S-1", e.to_string()))?;
        match (self.state, order) {
            (_, Order::Abort(reason)) => Err(SessionError::Aborted(reason)),
            (State::Configure, Order::Configure(configure)) => {
                let Some(deadline) = configure.longest_wait() else {
                    let message = format!("a deadline of {} s", configure.deadline);
                    return Err(self.coupler_broke("S-5", message));
                };
                self.deadline = deadline;
                let restore = configure.restore;
                self.configure = Some(configure);
                if restore {
                    self.state = State::Restore;
                    let channel = Channel::of(self.party, Kind::Restore);
                    self.awaited = ("the state to restore", Party::Coupler);
                    return Ok(Next::Act(Action::Wait(Wait::on(channel, SETUP))));
                }
                self.state = State::Configuring;
                Ok(Next::Parse)
            }
            (State::Configure, order) => {
                Err(self.coupler_broke("S-4", format!("an order that is not Configure: {order:?}")))
            }
            (State::Grant, Order::Drain) if self.party == Party::Mpm => {
                self.state = State::Draining;
                Ok(Next::Act(Action::Do(Task::Points)))
            }
            (State::Grant, Order::Drain) => Ok(Next::Act(self.say(State::Bye, &Notice::Bye))),
            (State::Close, Order::Close) => {
                self.verdict = Some(Ok(()));
                self.state = State::Ended;
                Ok(Next::Act(Action::End))
            }
            (_, order) => {
                Err(self.coupler_broke("S-3", format!("an order out of turn: {order:?}")))
            }
        }
    }

    fn granted(&mut self, header: &StepHeader, grants: &[Grant]) -> Result<Next, SessionError> {
        let [grant] = *grants else {
            return Err(
                self.coupler_broke("G-1", format!("{} grants in one message", grants.len()))
            );
        };
        if !check::counted(header, Records::Grant(grants)) {
            return Err(self.coupler_broke("C-4", format!("{} grants announced", header.count)));
        }
        check::number(Party::Coupler, "G-2", self.step, &grant)?;
        if grant.first != self.step || grant.steps == 0 {
            let message = format!(
                "steps {} + {} granted, {} is next",
                grant.first, grant.steps, self.step
            );
            return Err(self.coupler_broke("G-3", message));
        }
        if grant.steps.max(grant.steps_in_epoch) > LATEST {
            let message = format!(
                "{} steps granted, {} done in the epoch: no run has so many",
                grant.steps, grant.steps_in_epoch
            );
            return Err(self.coupler_broke("G-3", message));
        }
        self.grant = grant;
        self.done = 0;
        self.clock = Clock::within_epoch(
            grant.first,
            grant.epoch_start,
            grant.steps_in_epoch,
            grant.dt_before_epoch,
            grant.dt,
        );
        if grant.flags & flags::FRAME != 0 && self.party == Party::Mpm {
            self.state = State::Frame;
            return Ok(Next::Act(Action::Do(Task::Points)));
        }
        Ok(self.checkpoint())
    }

    /// Sends the state if the grant asks for it, and then begins the steps.
    fn checkpoint(&mut self) -> Next {
        if self.grant.flags & flags::CHECKPOINT != 0 {
            self.state = State::Checkpoint;
            return Next::Act(Action::Do(Task::Save));
        }
        self.state = State::Window;
        Next::Step
    }

    fn piece(&mut self, header: &StepHeader, piece: &[u8]) -> Result<Next, SessionError> {
        match self.incoming.take(header, piece) {
            Ok(None) => {
                let channel = Channel::of(self.party, Kind::Restore);
                Ok(Next::Act(Action::Wait(Wait::on(channel, SETUP))))
            }
            Ok(Some(whole)) => {
                self.restored = Some(whole);
                self.state = State::Configuring;
                Ok(Next::Parse)
            }
            Err(message) => Err(self.coupler_broke("K-4", message)),
        }
    }

    /// The step is done, with these limits for the next one.
    pub(crate) fn advanced(&mut self, limits: Limits) -> Result<(), SessionError> {
        check::number(self.party, "L-1", self.step, &limits)?;
        self.limits = limits;
        self.clock.advance();
        self.done += 1;
        self.step = self.clock.index();
        Ok(())
    }

    /// Whether all steps of the grant are done.
    pub(crate) fn window_done(&self) -> bool {
        self.done == self.grant.steps
    }

    fn sent(&mut self) -> Next {
        let next = match self.state {
            State::Hello => {
                self.state = State::Configure;
                self.await_order("its part of the scene", SETUP)
            }
            State::Ready | State::Reporting => self.await_grant(),
            State::Frame => return self.checkpoint(),
            State::Checkpoint if self.outgoing.sent() => self.send_piece(),
            State::Checkpoint => {
                self.state = State::Window;
                return Next::Step;
            }
            State::Measuring => self.list_contacts(),
            State::Listing => self.report_now(),
            State::Draining => self.say(State::Bye, &Notice::Bye),
            State::Bye => {
                self.state = State::Close;
                // The coupler still waits for the Bye of the other solver.
                self.await_order("leave to close", SETUP + 2 * INDIRECT_WAIT_MARGIN)
            }
            State::Refusing => {
                self.state = State::Refused;
                self.await_order("the answer to its refusal", SETUP)
            }
            State::Failing if self.blames_the_other() => {
                self.state = State::Blaming;
                self.await_order("the answer to its failure", ANSWER)
            }
            State::Failing => {
                self.state = State::Ended;
                Action::End
            }
            state => unreachable!("something sent in {state:?}"),
        };
        Next::Act(next)
    }

    fn task_done(&mut self, done: Done<'_>) -> Result<Next, SessionError> {
        let next = match (self.state, done) {
            (State::Configuring, Done::Configured { readiness, .. }) => {
                self.items = readiness.items;
                self.notice = self.ready(*readiness);
                if self.restored.is_some() {
                    self.state = State::Restoring;
                    if let Err(refusal) = self.take_mark() {
                        return Ok(Next::Act(self.refuse(refusal)));
                    }
                    Action::Do(Task::Restore)
                } else {
                    self.open()
                }
            }
            (State::Restoring, Done::Restored(_)) => {
                self.restored = None;
                self.open()
            }
            (State::Configuring | State::Restoring, Done::Refused(refusal)) => {
                self.refuse(*refusal)
            }
            (State::Frame, Done::Points(points)) => {
                check::numbers(self.party, "R-5", self.step, Records::Points(points))?;
                self.send_points(points.len())
            }
            (State::Draining, Done::Points(points)) => {
                check::numbers(self.party, "D-1", self.step, Records::Points(points))?;
                self.send_points(points.len())
            }
            (State::Checkpoint, Done::Saved(state)) => {
                let mark = Mark {
                    step: self.step,
                    set: self.set,
                    imps: self.imps,
                    items: self.items,
                    carried: self.carried,
                };
                let mut bytes = mark.bytes();
                bytes.extend(state);
                self.outgoing = Outgoing::new(bytes);
                self.send_piece()
            }
            (State::Measuring, Done::Measured(ledger, records)) => {
                self.report[0].ledger = *ledger;
                check::numbers(self.party, "R-3", self.step, records)?;
                let header = StepHeader {
                    step: self.grant.first,
                    count: records.len() as u64,
                    ..StepHeader::default()
                };
                self.send(records.kind(), header)
            }
            (State::Listing, Done::Listed(contacts)) => {
                check::numbers(self.party, "R-6", self.step, Records::Contacts(contacts))?;
                let header = StepHeader {
                    step: self.grant.first,
                    count: contacts.len() as u64,
                    ..StepHeader::default()
                };
                self.send(Kind::Contacts, header)
            }
            (_, Done::Failed(fault)) => {
                return Err(SessionError::Fault {
                    step: self.step,
                    fault: *fault,
                });
            }
            (state, done) => unreachable!("{done:?} in {state:?}"),
        };
        Ok(Next::Act(next))
    }

    fn expired(&mut self, waited: Duration) -> Result<Next, SessionError> {
        if self.state == State::Refused {
            self.state = State::Ended;
            return Ok(Next::Act(Action::End));
        }
        if self.state == State::Blaming {
            // There was no answer, so the coupler is silent. The other solver waits for it too.
            self.verdict = None;
        }
        let (awaited, who) = self.awaited;
        Err(SessionError::Late {
            who,
            awaited,
            step: self.step,
            waited,
        })
    }

    /// Whether the verdict blames the other solver for its silence.
    fn blames_the_other(&self) -> bool {
        matches!(&self.verdict, Some(Err(SessionError::Late { who, .. })) if *who != Party::Coupler)
    }

    fn ready(&self, readiness: Readiness) -> Vec<u8> {
        encode(&Notice::Ready(Ready {
            scene_hash: self.configuration().scene_hash.clone(),
            readiness,
        }))
    }

    /// Opens the channels that S-7 requires; Ready follows.
    fn open(&mut self) -> Action {
        self.state = State::Opening;
        let coupled = self.configuration().coupled;
        Action::Open { coupled }
    }

    /// Takes from the saved state the step at which the run continues.
    fn take_mark(&mut self) -> Result<(), Refusal> {
        let whole = self.restored.as_deref().unwrap_or_default();
        let Some(mark) = Mark::read(whole) else {
            let text = format!("{} bytes are no saved state", whole.len());
            return Err(Refusal::new("restore", text));
        };
        if mark.items != self.items {
            let text = format!(
                "the saved state is of {} points or bodies, the configuration has {}",
                mark.items, self.items
            );
            return Err(Refusal::new("restore", text));
        }
        if mark.step.max(mark.set) > LATEST {
            let text = format!("step {} and set {} are of no run", mark.step, mark.set);
            return Err(Refusal::new("restore", text));
        }
        (self.step, self.set, self.imps) = (mark.step, mark.set, mark.imps);
        self.carried = mark.carried;
        Ok(())
    }

    pub(crate) fn refuse(&mut self, refusal: Refusal) -> Action {
        self.verdict = Some(Err(SessionError::Refused {
            who: self.party,
            refusal: refusal.clone(),
        }));
        self.say(State::Refusing, &Notice::Refused(refusal))
    }

    fn say(&mut self, state: State, notice: &Notice) -> Action {
        self.state = state;
        self.notice = encode(notice);
        let header = self.plain(self.notice.len());
        self.send(Kind::Notice, header)
    }

    fn send_points(&mut self, count: usize) -> Action {
        let header = self.plain(count);
        self.send(Kind::Points, header)
    }

    fn send_piece(&mut self) -> Action {
        let (piece, flags) = self.outgoing.piece();
        let header = StepHeader {
            flags,
            ..self.plain(piece.len())
        };
        self.send(Kind::Saved, header)
    }

    fn await_order(&mut self, awaited: &'static str, at_most: Duration) -> Action {
        self.awaited = (awaited, Party::Coupler);
        Action::Wait(Wait::on(Channel::of(self.party, Kind::Order), at_most))
    }

    fn await_grant(&mut self) -> Action {
        // The first grant comes when the other solver is ready too. Later the coupler may wait for the other solver,
        // which waits for this one.
        let first = self.state == State::Ready;
        let at_most = 2 * INDIRECT_WAIT_MARGIN + if first { SETUP } else { self.deadline };
        self.state = State::Grant;
        self.awaited = ("the next grant", Party::Coupler);
        let of = |kind| Some(Channel::of(self.party, kind));
        Action::Wait(Wait {
            on: [of(Kind::Grant), of(Kind::Order), None],
            from: Party::Coupler,
            at_most,
        })
    }

    pub(crate) fn send(&mut self, kind: Kind, header: StepHeader) -> Action {
        self.header_to_send = header;
        Action::Send(Channel::of(self.party, kind))
    }

    /// The header of a message to the coupler that belongs to no epoch.
    fn plain(&self, count: usize) -> StepHeader {
        StepHeader {
            step: self.step,
            count: count as u64,
            ..StepHeader::default()
        }
    }

    /// The header of a message to the other solver.
    pub(crate) fn header(&self, flags: u64, count: usize) -> StepHeader {
        StepHeader {
            epoch: self.grant.epoch,
            step: self.step,
            count: count as u64,
            flags,
            set: self.set,
            ..StepHeader::default()
        }
    }

    pub(crate) fn coupler_broke(&self, clause: &'static str, message: String) -> SessionError {
        broken(Party::Coupler, clause, self.step, message)
    }
}
