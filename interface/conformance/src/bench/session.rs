//! One clause being judged, and the sessions that it has with the solver.

use std::cell::{Cell, RefCell};
use std::time::{Duration, Instant};

use interface::config::capability::Capabilities;
use interface::message::control::{Configure, Failure, Hello, Notice, Order, Party, Ready};
use interface::transport::raw::{Kind, Message, RawRun};
use interface::transport::wait::{Awaited, Spin, wait};

use super::subject::{Subject, Worker};
use crate::mutant::Flaw;
use crate::options::Options;
use crate::trace::{Direction, Trace};
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
    /// Most steps granted at once.
    pub window: u64,
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
            window: options.window.max(1),
            startup: options.startup,
            capabilities: hello.clone(),
            trace: RefCell::new(Trace::new(options.trace)),
            started: Instant::now(),
            starting: Cell::new(Duration::ZERO),
            sessions: Cell::new(0),
        }
    }

    /// Time since the clause began.
    pub fn elapsed(&self) -> Duration {
        self.started.elapsed()
    }

    /// A run with the solver, which has been started and has said nothing yet.
    pub fn session(&self) -> Result<Session<'_>, Unmet> {
        let raw_run = RawRun::open(self.subject.party)?;
        let worker = self.subject.start(raw_run.domain());
        let worker = worker.map_err(|e| broken("a solver that starts", e))?;
        self.sessions.set(self.sessions.get() + 1);
        Ok(Session {
            bench: self,
            raw_run,
            flaw: None,
            worker,
            failed: None,
            awaited: Kind::Notice,
            ended: None,
            number: self.sessions.get(),
        })
    }

    /// Whether the solver takes a capability, as far as it says.
    pub fn takes(&self, capability: &str) -> bool {
        self.capabilities.meets(capability)
    }

    /// A run with the solver, which has said Hello.
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
    /// The coupler's and the peer's ends.
    pub raw_run: RawRun,
    /// What is wrong with what the kit says from now on.
    pub flaw: Option<Flaw>,
    worker: Worker,
    /// What the solver said instead of a message.
    pub failed: Option<Failure>,
    /// What is awaited.
    awaited: Kind,
    /// The solver's end. It is reported at the second look, because what was sent before it is looked for in between.
    ended: Option<String>,
    number: u32,
}

impl Session<'_> {
    /// Sends a message as it is, and wakes its receiver.
    pub fn send(&mut self, message: &Message) -> Result<(), Unmet> {
        let Some(flaw) = &mut self.flaw else {
            self.note(Direction::ToSolver, message);
            return Ok(self.raw_run.send(message)?);
        };
        for changed in (flaw.pass)(message.clone()) {
            self.note(Direction::ToSolver, &changed);
            self.raw_run.send(&changed)?;
        }
        Ok(())
    }

    /// Sends a message as it is, and wakes nobody.
    pub fn send_silently(&mut self, message: &Message) -> Result<(), Unmet> {
        self.note(Direction::ToSolver, message);
        Ok(self.raw_run.send_silently(message)?)
    }

    /// Sends an order.
    pub fn order(&mut self, order: &Order) -> Result<(), Unmet> {
        self.send(&Message::order(order))
    }

    /// The next message of this kind, if it is there.
    pub fn take(&mut self, kind: Kind) -> Result<Option<Message>, Unmet> {
        let message = self.raw_run.receive(kind)?;
        if let Some(message) = &message {
            self.note(Direction::FromSolver, message);
        }
        Ok(message)
    }

    /// The next message of this kind that comes within `time`, if one does: none is expected.
    pub fn unexpected(&mut self, kind: Kind, time: Duration) -> Result<Option<Message>, Unmet> {
        let start = Instant::now();
        loop {
            let message = self.take(kind)?;
            if message.is_some() || start.elapsed() >= time {
                return Ok(message);
            }
            self.raw_run.sleep(kind, Duration::from_millis(1));
        }
    }

    /// Waits for a message of this kind.
    pub fn expect(&mut self, kind: Kind) -> Result<Message, Unmet> {
        self.expect_within(kind, PATIENCE.min(self.bench.left()))
    }

    /// The same, for this long.
    pub fn expect_within(&mut self, kind: Kind, deadline: Duration) -> Result<Message, Unmet> {
        (self.awaited, self.ended) = (kind, None);
        let message = wait(self, &mut Spin::default(), deadline);
        let message = message.map_err(|waited| {
            let got = format_args!("nothing for {:.1} s", waited.as_secs_f64());
            broken(format_args!("{kind:?}"), got)
        })??;
        self.note(Direction::FromSolver, &message);
        Ok(message)
    }

    /// Waits for the next notice.
    pub fn notice(&mut self) -> Result<Notice, Unmet> {
        self.notice_within(PATIENCE.min(self.bench.left()))
    }

    fn notice_within(&mut self, deadline: Duration) -> Result<Notice, Unmet> {
        let message = self.expect_within(Kind::Notice, deadline)?;
        let notice = message.as_notice();
        notice.map_err(|_| broken("a notice as section 3 says", words(&message)))
    }

    /// Waits for what a solver says while it starts, whose time is not counted.
    fn starting(&mut self) -> Result<Notice, Unmet> {
        let start = Instant::now();
        let notice = self.notice_within(self.bench.startup);
        let starting = &self.bench.starting;
        starting.set(starting.get() + start.elapsed());
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
        if let Some(failure) = self.failed.take() {
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

    /// Waits for the end of the solver for `within` at most; returns how it ended.
    pub fn end(&mut self, within: Duration) -> Option<String> {
        let start = Instant::now();
        loop {
            let end = self.worker.ended();
            if end.is_some() || start.elapsed() >= within {
                return end;
            }
            interface::transport::wait::nap(Duration::from_micros(200));
        }
    }

    /// Whether a bodies' side is under test.
    pub fn is_of_bodies(&self) -> bool {
        self.bench.subject.party == Party::Dem
    }

    /// Process id of the solver, if it is a process.
    pub fn pid(&self) -> Option<u32> {
        self.worker.pid()
    }

    fn note(&self, direction: Direction, message: &Message) {
        let mut trace = self.bench.trace.borrow_mut();
        trace.note(self.number, self.bench.elapsed(), direction, message);
    }
}

impl Drop for Session<'_> {
    fn drop(&mut self) {
        if self.worker.pid().is_none() {
            // A thread cannot be killed: it is told, and sees that the coupler is gone.
            let _ = self.raw_run.send(&Message::order(&Order::Abort(
                "the clause is judged".into(),
            )));
            self.raw_run.release();
        }
        self.worker.dismiss();
    }
}

impl Awaited for Session<'_> {
    type Found = Result<Message, Unmet>;

    /// Short, because many clauses wait for the end of a solver.
    const NAP: Duration = Duration::from_micros(500);

    fn look(&mut self) -> Option<Self::Found> {
        let message = self.raw_run.receive(self.awaited);
        message.map_err(Unmet::from).transpose()
    }

    fn block(&mut self, at_most: Duration) {
        self.raw_run.sleep(self.awaited, at_most);
    }

    fn interruption(&mut self, _: Duration) -> Option<Self::Found> {
        let awaited = self.awaited;
        let instead = |got: String| Some(Err(broken(format_args!("{awaited:?}"), got)));
        if awaited != Kind::Notice {
            match self.raw_run.receive(Kind::Notice) {
                Ok(None) => {}
                Ok(Some(notice)) => {
                    if let Ok(Notice::Failed(failure)) = notice.as_notice() {
                        self.failed = Some(failure);
                    }
                    return instead(words(&notice));
                }
                Err(error) => return Some(Err(error.into())),
            }
        }
        if let Some(end) = self.ended.take() {
            return instead(format!("a solver that {end}"));
        }
        self.ended = self.worker.ended();
        None
    }
}

/// A notice for people, or its bytes.
fn words(message: &Message) -> String {
    match message.as_notice() {
        Ok(Notice::Failed(failure)) => format!("Failed: {}", failure.message),
        Ok(notice) => format!("{notice:?}"),
        Err(e) => format!("{e}: {:?}", message.payload),
    }
}
