//! One clause being judged, and the sessions that it has with the solver.

use std::cell::{Cell, RefCell};
use std::time::{Duration, Instant};

use interface::config::capability::Capabilities;
use interface::hosted::{Hosted, Subject};
use interface::message::control::{Configure, Failure, Hello, Notice, Order, Party, Ready};
use interface::message::{Kind, Message};

use crate::flaw::Flaw;
use crate::options::Options;
use crate::trace::Trace;
use crate::verdict::{Unmet, broken};

/// Longest silence of a solver that is to answer.
pub const PATIENCE: Duration = Duration::from_secs(2);
/// Longest time that a clause takes in all, start-up left out: a solver that answers every time, but late, does not hold up the kit.
pub const LIMIT: Duration = Duration::from_secs(20);
/// An answer that comes so soon is in time even beyond that: the kit or the machine may have been slow.
const PROMPT: Duration = Duration::from_millis(200);
/// Hash of the kit's scenes.
pub const HASH: &str = "00c0ffee";

/// Where one clause is judged.
pub struct Bench {
    /// The solver under test.
    pub subject: Subject,
    /// Longest wait for Hello and for Ready.
    pub startup: Duration,
    /// What the solver says in Hello that it takes.
    pub capabilities: Capabilities,
    trace: RefCell<Trace>,
    started: Instant,
    /// Time spent waiting for Hello and Ready.
    starting: Cell<Duration>,
    sessions: Cell<u32>,
}

impl Bench {
    /// A bench whose clock starts now.
    pub fn new(subject: Subject, options: &Options, hello: &Capabilities) -> Self {
        Self {
            subject,
            startup: options.startup,
            capabilities: hello.clone(),
            trace: RefCell::new(Trace::new(options.trace.is_some())),
            started: Instant::now(),
            starting: Cell::new(Duration::ZERO),
            sessions: Cell::new(0),
        }
    }

    /// Time since the clause began.
    pub fn elapsed(&self) -> Duration {
        self.started.elapsed()
    }

    /// A run with the solver, which has been started and has sent nothing yet.
    pub fn session(&self) -> Result<Session<'_>, Unmet> {
        let solver = self.subject.start();
        let solver = solver.map_err(|e| broken("a solver that starts", e))?;
        self.sessions.set(self.sessions.get() + 1);
        Ok(Session {
            bench: self,
            solver,
            flaw: None,
            silent: false,
            number: self.sessions.get(),
        })
    }

    /// Whether the solver takes a capability, as far as it says.
    pub fn takes(&self, capability: &str) -> bool {
        self.capabilities.meets(capability)
    }

    /// A run with the solver, which has sent Hello.
    pub fn greeted(&self) -> Result<Session<'_>, Unmet> {
        let mut session = self.session()?;
        session.hello()?;
        Ok(session)
    }

    /// Whether the solver was awaited at its start for as long as it may be.
    pub(crate) fn was_kept_waiting(&self) -> bool {
        self.starting.get() >= self.startup
    }

    pub(crate) fn into_trace(self) -> Trace {
        self.trace.into_inner()
    }

    fn left(&self) -> Duration {
        if !self.subject.is_process() {
            // It waits in no time.
            return LIMIT;
        }
        let left = (LIMIT + self.starting.get()).saturating_sub(self.started.elapsed());
        left.max(PROMPT)
    }
}

/// The order that hands a solver `config`, coupled.
pub fn configure<C: serde::Serialize>(config: &C) -> Configure {
    Configure {
        scene_hash: HASH.into(),
        config: serde_json::to_string(config).expect("a configuration has string keys only"),
        coupled: true,
        // Longer than the kit waits, so that a solver's own deadline is not taken for its answer.
        deadline: 5.0 * PATIENCE.as_secs_f64(),
        restore: false,
    }
}

/// One run with the solver under test. Dropping it ends the solver.
pub struct Session<'b> {
    bench: &'b Bench,
    /// The solver, and the ends of the coupler and the peer.
    pub solver: Hosted,
    /// What is wrong with what the kit says from now on.
    pub flaw: Option<Flaw>,
    /// Whether the kit wakes nobody from now on.
    pub silent: bool,
    number: u32,
}

impl Session<'_> {
    /// Sends a message, as it is if nothing is wrong with it, and wakes its receiver.
    pub fn send(&mut self, message: &Message) -> Result<(), Unmet> {
        let Some(flaw) = &mut self.flaw else {
            return self.pass_on(message);
        };
        let mut changed = flaw.pass(message.clone()).into_iter();
        changed.try_for_each(|message| self.pass_on(&message))
    }

    fn pass_on(&mut self, message: &Message) -> Result<(), Unmet> {
        self.note(message);
        let sent = if self.silent {
            self.solver.send_silently(message)
        } else {
            self.solver.send(message)
        };
        Ok(sent?)
    }

    /// Sends an order.
    pub fn order(&mut self, order: &Order) -> Result<(), Unmet> {
        self.send(&Message::order(order))
    }

    /// The next message of this kind, if it is there.
    pub fn take(&mut self, kind: Kind) -> Result<Option<Message>, Unmet> {
        let message = self.solver.receive(kind)?;
        if let Some(message) = &message {
            self.note(message);
        }
        Ok(message)
    }

    /// The next message of this kind that comes within `time`, if one does: none is expected.
    pub fn unexpected(&mut self, kind: Kind, time: Duration) -> Result<Option<Message>, Unmet> {
        let look = |solver: &mut Hosted| solver.receive(kind).transpose();
        let found = self.solver.until(time, Duration::from_millis(1), look);
        let found = found.transpose()?;
        if let Some(message) = &found {
            self.note(message);
        }
        Ok(found)
    }

    /// Waits for a message of this kind.
    pub fn expect(&mut self, kind: Kind) -> Result<Message, Unmet> {
        self.expect_within(kind, PATIENCE.min(self.bench.left()))
    }

    /// The same, for this long.
    pub fn expect_within(&mut self, kind: Kind, deadline: Duration) -> Result<Message, Unmet> {
        let message = self.solver.expect(kind, deadline);
        let message = message.map_err(|instead| broken(format_args!("{kind:?}"), instead))?;
        self.note(&message);
        Ok(message)
    }

    /// Waits for the next notice.
    pub fn notice(&mut self) -> Result<Notice, Unmet> {
        self.notice_within(PATIENCE.min(self.bench.left()))
    }

    fn notice_within(&mut self, deadline: Duration) -> Result<Notice, Unmet> {
        let message = self.expect_within(Kind::Notice, deadline)?;
        let notice = message.as_notice();
        notice.map_err(|why| broken("a notice as section 3 says", why))
    }

    /// Waits for what a solver says while it starts, whose time is not counted.
    fn starting(&mut self) -> Result<Notice, Unmet> {
        let start = self.solver.elapsed();
        let notice = self.notice_within(self.bench.startup);
        let starting = &self.bench.starting;
        starting.set(starting.get() + self.solver.since(start));
        notice
    }

    /// Waits for Hello.
    pub fn hello(&mut self) -> Result<Hello, Unmet> {
        match self.starting()? {
            Notice::Hello(hello) => Ok(hello),
            other => Err(broken("Hello", format_args!("{other:?}"))),
        }
    }

    /// What the solver says to its configuration.
    pub(super) fn reply(&mut self) -> Result<Ready, Unmet> {
        match self.starting()? {
            Notice::Ready(ready) => Ok(ready),
            Notice::Refused(refusal) => Err(Unmet::Declined(refusal)),
            other => Err(broken("Ready or Refused", format_args!("{other:?}"))),
        }
    }

    /// Hands over a configuration and waits for Ready.
    pub fn ready(&mut self, configure: &Configure) -> Result<Ready, Unmet> {
        self.order(&Order::Configure(configure.clone()))?;
        self.reply()
    }

    /// Waits until the solver says why it cannot go on, whatever it was asked.
    pub fn failure(&mut self) -> Result<Failure, Unmet> {
        self.failure_within(PATIENCE.min(self.bench.left()))
    }

    /// The same, where it may take longer than an answer.
    pub fn failure_within(&mut self, deadline: Duration) -> Result<Failure, Unmet> {
        if let Some(failure) = self.solver.failed.take() {
            return Ok(failure);
        }
        match self.notice_within(deadline)? {
            Notice::Failed(failure) => Ok(failure),
            other => Err(broken("Failed", format_args!("{other:?}"))),
        }
    }

    /// Asks for an orderly end: Drain, then Bye; Close is left to the clause.
    pub fn bye(&mut self) -> Result<(), Unmet> {
        self.order(&Order::Drain)?;
        match self.notice()? {
            Notice::Bye => Ok(()),
            other => Err(broken("Bye", format_args!("{other:?}"))),
        }
    }

    /// The same, and Close.
    pub fn close(&mut self) -> Result<(), Unmet> {
        self.bye()?;
        self.order(&Order::Close)
    }

    /// Whether a bodies' side is under test.
    pub fn is_of_bodies(&self) -> bool {
        self.bench.subject.party == Party::Dem
    }

    fn note(&self, message: &Message) {
        let mut trace = self.bench.trace.borrow_mut();
        let (time, party) = (self.bench.elapsed(), self.bench.subject.party);
        trace.note(self.number, time, party, message);
    }
}
