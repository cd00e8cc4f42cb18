//! A session: open, configure, step, drain, closed; abort from any of them (PROTOCOL.md section 2).
//!
//! Each party's side is one `async` function that reads as PROTOCOL.md does: [`coupler`] leads, [`solver`] follows, and
//! within a window of steps [`continuum`] and [`bodies`] exchange what the points and bodies need of one another. A
//! [`Session`] polls such a function: in each turn it goes on until a message has been sent or received, or until it has to
//! wait for one. [`drive`] gives one party turns until its session is over, with the waits of a process; [`together`] gives
//! turns to all three parties in one thread; a simulation decides by itself whose turn it is.

mod approach;
mod bodies;
mod check;
mod connection;
mod continuum;
mod coupler;
mod error;
mod follow;
mod io;
mod pieces;
pub mod process;
mod serve;
mod solver;
mod solvers;
mod stopwatch;
pub mod together;

use std::any::Any;
use std::pin::Pin;
use std::rc::Rc;
use std::task::{Context, Poll, Waker};
use std::time::Duration;

use self::bodies::Bodies;
use self::connection::Connection;
use self::continuum::Continuum;
use self::coupler::Coupler;
use self::io::{Io, Signal};
use self::stopwatch::Stopwatch;
use crate::hosted::Host;
use crate::message::Channel;
use crate::message::control::Party;
use crate::recording::RecordingSink;
use crate::trace::Trace;
use crate::transport::Ends;
use crate::transport::domain::Domain;
use crate::transport::wait::{Awaited, Spin, wait};

pub use coupler::{Next, Stop, Supervisor};
pub use error::SessionError;
pub use io::Wait;
pub use pieces::solver_part;
pub use serve::serve;
pub use solvers::{Part, Round, START, Solvers};
pub use stopwatch::{Clocked, cpu_time};

/// The result of a turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Turn {
    /// A message was sent or received.
    Went,
    /// There is nothing to do until a message arrives.
    Waits(Wait),
    /// The session of this party is over.
    Ended,
}

/// One party's side of a session, with its ends of the channels.
pub struct Session<'a> {
    io: Rc<Io>,
    side: Side<'a>,
    verdict: Option<Result<(), SessionError>>,
}

type Side<'a> = Pin<Box<dyn Future<Output = Result<(), SessionError>> + 'a>>;

impl Session<'static> {
    /// A solver's side.
    pub fn solver(host: Host, ends: Ends, clocked: Clocked) -> Self {
        let hello = host.hello();
        Self::of(ends, clocked, |io| {
            let to = Connection::new(io, host.party());
            match host {
                Host::Mpm(solver) => Box::pin(solver::session(to, hello, Continuum::new(solver))),
                Host::Dem(solver) => Box::pin(solver::session(to, hello, Bodies::new(solver))),
            }
        })
    }
}

impl<'a> Session<'a> {
    /// The coupler's side with these solvers, in which `supervisor` decides.
    pub fn coupler(solvers: &[Party], supervisor: &'a mut dyn Supervisor, ends: Ends) -> Self {
        Self::of(ends, Clocked::Shared, |io| {
            Box::pin(Coupler::new(io, solvers, supervisor).session())
        })
    }

    fn of(ends: Ends, clocked: Clocked, side: impl FnOnce(Rc<Io>) -> Side<'a>) -> Self {
        let io = Rc::new(Io::new(ends, Stopwatch::start(clocked)));
        Self {
            side: side(io.clone()),
            io,
            verdict: None,
        }
    }

    /// What keeps its ends of the channels open when it is over: what was sent, and not yet received, is lost when they close.
    pub fn ends(&self) -> Rc<dyn Any> {
        self.io.clone()
    }

    /// Adds what it does to the timeline of the run, if there is one.
    #[must_use]
    pub fn traced(self, domain: &Domain, party: Party) -> Self {
        if let Some(trace) = Trace::of(domain, party) {
            self.io.watch().trace(trace);
        }
        self
    }

    /// Records, if there is a sink, every message that it sends or receives on the channels that `notes` selects.
    #[must_use]
    pub fn recorded(self, sink: Option<&RecordingSink>, notes: fn(Channel) -> bool) -> Self {
        if let Some(sink) = sink {
            let _ = self.io.recording.set((sink.clone(), notes));
        }
        self
    }

    /// Goes on until a message has been sent or received, or until there is nothing to do before one arrives.
    pub fn turn(&mut self) -> Turn {
        if self.verdict.is_some() {
            return Turn::Ended;
        }
        match self
            .side
            .as_mut()
            .poll(&mut Context::from_waker(Waker::noop()))
        {
            Poll::Ready(verdict) => {
                self.verdict = Some(verdict);
                Turn::Ended
            }
            Poll::Pending => self.io.wait.take().map_or(Turn::Went, Turn::Waits),
        }
    }

    /// A turn during a long wait, which also looks for what nobody waits for: an abort, or the end of a process. Returns
    /// whether there was something.
    pub fn look_up(&mut self) -> bool {
        self.io.signal.set(Signal::LookUp(Duration::ZERO));
        self.verdict.is_none() && !matches!(self.turn(), Turn::Waits(_))
    }

    /// The deadline of the present wait is over, after this silence.
    pub fn expire(&mut self, waited: Duration) {
        self.io.signal.set(Signal::Expired(waited));
        self.turn();
    }

    /// First step that is not done; of the coupler: that not all solvers have reported.
    pub fn step(&self) -> u64 {
        self.io.step.get()
    }

    /// How the session ended; `None` before it has.
    pub fn verdict(&self) -> Option<&Result<(), SessionError>> {
        self.verdict.as_ref()
    }

    /// How the session ended.
    ///
    /// # Errors
    /// Any [`SessionError`]: that of the session, or that it has not ended.
    pub fn into_verdict(self) -> Result<(), SessionError> {
        self.verdict
            .unwrap_or_else(|| Err(SessionError::Aborted("the session has not ended".into())))
    }
}

/// Gives `party` turns until its session is over, waiting as [`crate::transport::wait`] says. Returns how it ended.
///
/// # Errors
/// Any [`SessionError`].
pub fn drive(mut party: Session<'_>) -> Result<(), SessionError> {
    let mut spins = [Spin::default(); Party::ALL.len()];
    loop {
        match party.turn() {
            Turn::Went => {}
            Turn::Waits(present) => {
                let spin = &mut spins[present.from as usize];
                let mut next = NextTurn {
                    party: &mut party,
                    present,
                };
                if let Err(waited) = wait(&mut next, spin, present.at_most) {
                    party.expire(waited);
                }
            }
            Turn::Ended => return party.into_verdict(),
        }
    }
}

/// The next turn of a party, once there is something to do.
struct NextTurn<'a, 'b> {
    party: &'a mut Session<'b>,
    /// What the party waits for. A look may end this wait and begin another one, with a deadline of its own.
    present: Wait,
}

impl Awaited for NextTurn<'_, '_> {
    type Found = ();

    fn look(&mut self) -> Option<()> {
        (self.party.turn() != Turn::Waits(self.present)).then_some(())
    }

    fn block(&mut self, at_most: Duration) {
        let from = self.present.from;
        self.party
            .io
            .with(|transport| transport.sleep(from, at_most));
    }

    fn interruption(&mut self, silence: Duration) -> Option<()> {
        self.party.io.signal.set(Signal::LookUp(silence));
        self.look()
    }

    fn held(&mut self) -> bool {
        self.party.io.with(|transport| transport.held().is_some())
    }
}
