//! The coupler's side of a session: its state machine, the run that answers its questions, and the messages received.

use std::time::Duration;

use super::turns::{Inbox, Turn, Turns};
use crate::core::Action;
use crate::core::SessionError;
use crate::core::coupler::{Coupler, Decision, Event, Limits, Question};
use crate::message::Channel;
use crate::message::control::{Hello, Party};
use crate::transport::Transport;

/// The run cannot continue; the solvers receive this reason.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Stop(pub String);

/// The run that a session belongs to, which makes the decisions.
pub trait Supervisor {
    /// Answers a question of the machine. The machine has the messages of the solvers.
    ///
    /// # Errors
    /// [`Stop`] ends the session.
    fn decide(&mut self, question: Question, coupler: &mut Coupler) -> Result<Decision, Stop>;

    /// Deadlines for the solvers before the first step.
    fn limits(&self) -> Limits {
        Limits::default()
    }

    /// A solver has sent Hello.
    fn joined(&mut self, _hello: &Hello) {}

    /// Asked during every long wait: a solver that is gone, and how it ended.
    fn gone(&mut self) -> Option<(Party, String)> {
        None
    }

    /// Asked during every long wait: the reason why the session has to end now. `arriving`: no grant has been sent yet.
    fn interrupted(&mut self, _arriving: bool) -> Option<Stop> {
        None
    }
}

/// The coupler's side of a session.
pub struct CouplerSide<'a> {
    machine: Coupler,
    supervisor: &'a mut dyn Supervisor,
    action: Action<Question>,
    inbox: Inbox,
    /// The solvers that have sent Hello, in the order of arrival.
    joined: Vec<Party>,
}

impl<'a> CouplerSide<'a> {
    /// A session with `solvers`, in which `supervisor` decides.
    pub fn new(solvers: &[Party], supervisor: &'a mut dyn Supervisor) -> Self {
        let mut machine = Coupler::new(solvers, supervisor.limits());
        let action = machine.start();
        Self {
            machine,
            supervisor,
            action,
            inbox: Inbox::new(),
            joined: Vec::new(),
        }
    }

    /// The machine, with what the solvers have reported.
    pub fn coupler(&self) -> &Coupler {
        &self.machine
    }

    /// How the session ended.
    ///
    /// # Errors
    /// Any [`SessionError`]: that of the session, or that it has not ended.
    pub fn take_verdict(&mut self) -> Result<(), SessionError> {
        let verdict = self.machine.take_verdict();
        verdict.unwrap_or_else(|| Err(SessionError::Aborted("the session has not ended".into())))
    }

    /// Ends the session for this reason at its next turn.
    pub fn stop(&mut self, reason: String) {
        if self.machine.verdict().is_none() {
            self.on(Event::Stopped(reason));
        }
    }

    fn on(&mut self, event: Event<'_>) {
        self.action = self.machine.on(event);
    }

    fn take(&mut self, channel: Channel, transport: &mut dyn Transport) -> bool {
        let into = self.inbox.of(channel.kind);
        match transport.receive(channel, into) {
            Ok(None) => return false,
            Ok(Some(header)) => {
                let event = Event::Received(channel, header, into.records());
                self.action = self.machine.on(event);
                self.report_hello(channel.from());
            }
            Err(error) => self.on(Event::Broken(error)),
        }
        true
    }

    /// Reports a new Hello to the run.
    fn report_hello(&mut self, party: Party) {
        if let Some(hello) = self.machine.hello(party)
            && !self.joined.contains(&party)
        {
            self.joined.push(party);
            self.supervisor.joined(hello);
        }
    }

    /// Takes a notice that is not awaited; returns whether there was one.
    fn take_notice(&mut self, transport: &mut dyn Transport) -> bool {
        let mut notices = self.machine.notices();
        let both = [notices.next(), notices.next()];
        drop(notices);
        both.into_iter()
            .flatten()
            .any(|channel| self.take(channel, transport))
    }
}

impl Turns for CouplerSide<'_> {
    fn turn(&mut self, transport: &mut dyn Transport) -> Turn {
        match self.action {
            Action::Wait(wait) => {
                for channel in wait.on.into_iter().flatten() {
                    if self.take(channel, transport) {
                        return Turn::Went;
                    }
                }
                return Turn::Waits(wait);
            }
            Action::Do(question) => {
                let event = match self.supervisor.decide(question, &mut self.machine) {
                    Ok(decision) => Event::Done(decision),
                    Err(Stop(reason)) => Event::Stopped(reason),
                };
                self.on(event);
            }
            Action::Send(channel) => {
                let records = self.machine.ready_to_send(channel);
                let header = self.machine.header_to_send();
                let event = match transport.send(channel, header, records) {
                    Ok(()) => Event::Sent,
                    Err(error) => Event::Broken(error),
                };
                transport.wake(channel.to());
                self.on(event);
            }
            Action::Take(channel) => {
                if !self.take(channel, transport) {
                    self.on(Event::Absent(channel));
                }
            }
            Action::Open { .. } => unreachable!("the coupler has opened its channels"),
            Action::End => return Turn::Ended,
        }
        Turn::Went
    }

    fn look_up(&mut self, transport: &mut dyn Transport) -> bool {
        if let Some(Stop(reason)) = self.supervisor.interrupted(self.machine.is_arriving()) {
            self.on(Event::Stopped(reason));
            return true;
        }
        // A notice is looked for before the end of a process: a solver that has ended may have said why.
        if self.take_notice(transport) {
            return true;
        }
        let Some((who, how)) = self.supervisor.gone() else {
            return false;
        };
        if !self.take_notice(transport) {
            self.on(Event::Gone(who, how));
        }
        true
    }

    fn expire(&mut self, waited: Duration) {
        self.on(Event::Expired(waited));
    }
}
