//! A solver's connection to the coupler: its position in the run, and the messages that both sides send and receive alike.

use std::rc::Rc;
use std::time::Duration;

use super::error::{INDIRECT_WAIT_MARGIN, SessionError, broken};
use super::io::{Io, Signal, Wait};
use super::{check, pieces};
use crate::message::control::{Failure, Notice, Order, Party};
use crate::message::wire::{Grant, Limits, StepHeader, flags};
use crate::message::{Channel, Kind, Message, Payload, Records};
use crate::solver::{Fault, Refusal};
use crate::step::{Clock, Step};

/// Longest wait for the coupler before the first grant: the other solver may be filling a large scene.
pub(super) const SETUP: Duration = Duration::from_mins(2);

/// Longest wait for the coupler's answer to a Failed that blames the other solver for its silence. If there is no
/// answer, the coupler is the silent party.
pub(super) const ANSWER: Duration = Duration::from_millis(500);

/// Largest number of a step, and of a set, in a saved state or a grant, so that counting up from it does not overflow.
pub(super) const LATEST: u64 = 1 << 62;

/// What a solver receives between two windows.
pub(super) enum Granted {
    /// Steps.
    Window,
    /// No more of them.
    Drain,
}

/// A solver's connection to the coupler.
pub(super) struct Connection {
    io: Rc<Io>,
    pub party: Party,
    /// Whether there is another solver to exchange with.
    pub coupled: bool,
    /// Longest wait for another party within a step.
    pub deadline: Duration,
    /// The grant in progress.
    pub grant: Grant,
    clock: Clock,
    /// Steps of the grant that are done.
    done: u64,
    /// Limits after the last step.
    pub limits: Limits,
    /// Number of IMPs at present, and number of sets so far.
    pub imps: u64,
    pub set: u64,
    /// Where grants arrive, so that memory is reused.
    grants: Message,
}

impl Connection {
    pub fn new(io: Rc<Io>, party: Party) -> Self {
        Self {
            io,
            party,
            coupled: false,
            deadline: SETUP,
            grant: Grant::default(),
            clock: Clock::new(0.0),
            done: 0,
            limits: Limits::default(),
            imps: 0,
            set: 0,
            grants: Message::empty(Kind::Grant),
        }
    }

    pub fn io(&self) -> &Io {
        &self.io
    }

    /// First step that is not done.
    pub fn step(&self) -> u64 {
        self.io.step.get()
    }

    /// The present step.
    pub fn present(&self) -> Step {
        self.clock
            .step(self.done == 0 && self.grant.flags & flags::MEASURE != 0)
    }

    /// Whether the present step is the first one of the grant.
    pub fn is_first(&self) -> bool {
        self.done == 0
    }

    /// Whether all steps of the grant are done.
    pub fn is_window_done(&self) -> bool {
        self.done == self.grant.steps
    }

    /// L-4: whether the budgets of the grant allow the present step. The coupler has tested them for the first one.
    pub fn may_go_on(&self) -> bool {
        self.done == 0 || self.grant.allows(&self.limits)
    }

    /// The step is done, with these limits for the next one.
    pub fn advanced(&mut self, limits: Limits) -> Result<(), SessionError> {
        check::number(self.party, "L-1", self.step(), &limits)?;
        self.limits = limits;
        self.clock.advance();
        self.done += 1;
        self.io.step.set(self.clock.index());
        Ok(())
    }

    /// The error of a solver that cannot continue.
    pub fn fault(&self, fault: Fault) -> SessionError {
        let step = self.step();
        SessionError::Fault { step, fault }
    }

    pub fn coupler_broke(&self, clause: &'static str, message: String) -> SessionError {
        broken(Party::Coupler, clause, self.step(), message)
    }

    /// Sends a notice.
    pub async fn say(&self, notice: &Notice) -> Result<(), SessionError> {
        let Message { header, payload } = Message::notice(self.step(), notice);
        self.send_under(header, payload.records()).await
    }

    /// Sends records of this step to the coupler, which belong to no epoch.
    pub fn send(
        &self,
        step: u64,
        records: Records<'_>,
    ) -> impl Future<Output = Result<(), SessionError>> {
        let header = StepHeader {
            step,
            count: records.len() as u64,
            ..StepHeader::default()
        };
        self.send_under(header, records)
    }

    /// Sends records to the other solver.
    pub fn exchange(
        &self,
        flags: u64,
        records: Records<'_>,
    ) -> impl Future<Output = Result<(), SessionError>> {
        self.send_under(self.header(flags, records.len()), records)
    }

    /// The header of a message to the other solver.
    pub fn header(&self, flags: u64, count: usize) -> StepHeader {
        StepHeader {
            epoch: self.grant.epoch,
            step: self.step(),
            count: count as u64,
            flags,
            set: self.set,
            ..StepHeader::default()
        }
    }

    pub fn send_under(
        &self,
        header: StepHeader,
        records: Records<'_>,
    ) -> impl Future<Output = Result<(), SessionError>> {
        let channel = Channel::of(self.party, records.kind());
        self.io.send(channel, header, records)
    }

    /// Refuses the configuration or the saved state: sends the refusal, and waits for the Abort that answers it.
    pub async fn refuse(&self, refusal: Refusal) -> SessionError {
        let sent = self.say(&Notice::Refused(refusal.clone())).await;
        if sent.is_ok() {
            let _ = self.order("the answer to its refusal", SETUP).await;
        }
        SessionError::Refused {
            who: self.party,
            refusal,
        }
    }

    /// Sends the error to the coupler, unless it knows it. The result is the cause of the end, which may be another one.
    pub async fn report_failure(&self, error: SessionError) -> SessionError {
        let fault = match &error {
            SessionError::Aborted(_)
            | SessionError::CouplerGone { .. }
            | SessionError::Refused { .. } => return error,
            SessionError::Fault { fault, .. } => Some(fault.clone()),
            _ => None,
        };
        let message = fault.as_ref().map_or(error.to_string(), Fault::to_string);
        let failed = Notice::Failed(Failure {
            step: self.step(),
            fault,
            message,
        });
        if self.say(&failed).await.is_err() {
            return error;
        }
        if matches!(&error, SessionError::Late { who, .. } if *who != Party::Coupler)
            && let Err(silence @ SessionError::Late { .. }) =
                self.order("the answer to its failure", ANSWER).await
        {
            // There was no answer, so the coupler is silent. The other solver waits for it too.
            return silence;
        }
        error
    }

    /// Waits for an order that is not an Abort.
    pub async fn order(
        &self,
        awaited: &'static str,
        at_most: Duration,
    ) -> Result<Order, SessionError> {
        let channel = Channel::of(self.party, Kind::Order);
        let mut into = Message::empty(Kind::Order);
        self.receive(channel, &mut into, awaited, at_most).await?;
        self.read_order(&into.payload)
    }

    fn read_order(&self, payload: &Payload) -> Result<Order, SessionError> {
        match Order::decode(payload.of()).map_err(|e| self.coupler_broke("S-1", e.to_string()))? {
            Order::Abort(reason) => Err(SessionError::Aborted(reason)),
            order => Ok(order),
        }
    }

    pub fn out_of_turn(&self, order: &Order) -> SessionError {
        self.coupler_broke("S-3", format!("an order out of turn: {order:?}"))
    }

    /// K-4: the state to restore.
    pub async fn state_to_restore(&self) -> Result<Vec<u8>, SessionError> {
        let channel = Channel::of(self.party, Kind::Restore);
        let mut state = pieces::Incoming::default();
        let mut into = Message::empty(Kind::Restore);
        loop {
            self.receive(channel, &mut into, "the state to restore", SETUP)
                .await?;
            match state.take(&into.header, into.payload.of()) {
                Ok(None) => {}
                Ok(Some(whole)) => return Ok(whole),
                Err(message) => return Err(self.coupler_broke("K-4", message)),
            }
        }
    }

    /// Waits for the next grant, and takes it as the present one; or for Drain. `first`: none has come before.
    pub async fn next_grant(&mut self, first: bool) -> Result<Granted, SessionError> {
        // The first grant comes when the other solver is ready too. Later the coupler may wait for the other solver,
        // which waits for this one.
        let at_most = 2 * INDIRECT_WAIT_MARGIN + if first { SETUP } else { self.deadline };
        let [grants, orders] = [Kind::Grant, Kind::Order].map(|kind| Channel::of(self.party, kind));
        let mut grant = std::mem::replace(&mut self.grants, Message::empty(Kind::Grant));
        let mut order = Message::empty(Kind::Order);
        let look = |io: &Io| {
            if io.receive(grants, &mut grant)? {
                return Ok(Some(Granted::Window));
            }
            Ok(io.receive(orders, &mut order)?.then_some(Granted::Drain))
        };
        let wait = (Party::Coupler, "the next grant", at_most);
        match self.arrival(wait, true, look).await? {
            Granted::Window => {
                self.take_grant(&grant.header, grant.payload.of())?;
                self.grants = grant;
                Ok(Granted::Window)
            }
            Granted::Drain => match self.read_order(&order.payload)? {
                Order::Drain => Ok(Granted::Drain),
                order => Err(self.out_of_turn(&order)),
            },
        }
    }

    /// C-4, G-1 to G-3.
    fn take_grant(&mut self, header: &StepHeader, grants: &[Grant]) -> Result<(), SessionError> {
        let step = self.step();
        let [grant] = *grants else {
            let message = format!("{} grants in one message", grants.len());
            return Err(self.coupler_broke("G-1", message));
        };
        if !check::counted(header, Records::Grant(grants)) {
            let message = format!("1 grant, {} announced", header.count);
            return Err(self.coupler_broke("C-4", message));
        }
        check::number(Party::Coupler, "G-2", step, &grant)?;
        if grant.first != step || grant.steps == 0 {
            let message = format!(
                "steps {} + {} granted, {step} is next",
                grant.first, grant.steps
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
        Ok(())
    }

    /// Waits for the next message of `channel`.
    pub fn receive(
        &self,
        channel: Channel,
        into: &mut Message,
        awaited: &'static str,
        at_most: Duration,
    ) -> impl Future<Output = Result<(), SessionError>> {
        let wait = (channel.from(), awaited, at_most);
        let awaits_order = channel.kind == Kind::Order;
        let look = move |io: &Io| Ok(io.receive(channel, into)?.then_some(()));
        self.arrival(wait, awaits_order, look)
    }

    /// Waits until `look` finds a message, until the coupler ends the session or is gone, or until the deadline is over.
    fn arrival<T>(
        &self,
        (from, awaited, at_most): (Party, &'static str, Duration),
        awaits_order: bool,
        mut look: impl FnMut(&Io) -> Result<Option<T>, SessionError>,
    ) -> impl Future<Output = Result<T, SessionError>> {
        let io = &*self.io;
        io.arrival(Wait { from, at_most }, move |signal| {
            let found = look(io)?;
            if found.is_some() {
                return Ok(found);
            }
            match signal {
                Signal::None => Ok(None),
                Signal::Expired(waited) => Err(SessionError::Late {
                    who: from,
                    awaited,
                    step: io.step.get(),
                    waited,
                }),
                Signal::LookUp(_) => {
                    self.unexpected_order(awaits_order)?;
                    if io.with(|transport| transport.coupler_lives()) {
                        return Ok(None);
                    }
                    // An Abort may have arrived between the two looks, and it says why.
                    let found = look(io)?;
                    self.unexpected_order(awaits_order)?;
                    match found {
                        Some(_) => Ok(found),
                        None => Err(SessionError::CouplerGone {
                            step: io.step.get(),
                        }),
                    }
                }
            }
        })
    }

    /// An order that has arrived while the session waits for another message: an Abort, or one out of turn.
    fn unexpected_order(&self, awaits_order: bool) -> Result<(), SessionError> {
        if awaits_order {
            return Ok(());
        }
        let mut order = Message::empty(Kind::Order);
        let channel = Channel::of(self.party, Kind::Order);
        if self.io.receive(channel, &mut order)? {
            return Err(self.out_of_turn(&self.read_order(&order.payload)?));
        }
        Ok(())
    }
}
