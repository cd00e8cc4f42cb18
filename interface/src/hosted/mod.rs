//! One solver that is started alone, while all other ends of its run are in the hands of the caller: the conformance kit
//! judges it, a replay compares what it answers ([`crate::recording::replay`]).
//!
//! The caller sends and receives [`Message`]s as they are: any header, any records, any bytes, in any order. Nothing is
//! checked here, on purpose. Solvers and the coupler use [`crate::session`].

mod host;
mod in_thread;

use std::collections::VecDeque;
use std::io;
use std::process::{Child, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};

use thiserror::Error;

use self::in_thread::Served;
use crate::message::control::{Failure, Notice, Party};
use crate::message::{Channel, Kind, Message};
use crate::session::process;
use crate::transport::direct::Direct;
use crate::transport::domain::{Domain, OwnedDomain};
use crate::transport::iceoryx::{Created, create, join};
use crate::transport::wait::{Awaited, Spin, until, wait};
use crate::transport::{Transport, TransportError};

pub use self::host::Host;
pub use crate::transport::Ends;

/// Longest wait of a send to a full channel. It is short, so that the kit soon notices that a solver takes nothing.
const SEND_TIMEOUT: Duration = Duration::from_secs(1);

/// Makes a solver for a run in which it has these ends, and says through which ones it talks.
pub type Make = Arc<dyn Fn(Ends) -> (Host, Ends) + Send + Sync>;

/// How a solver is started.
#[derive(Clone)]
pub enum Start {
    /// A program and its arguments, to which `--join RUN` is added.
    Command(Vec<String>),
    /// In the thread of its caller.
    InThread(Make),
}

/// A solver that can be started alone.
#[derive(Clone)]
pub struct Subject {
    /// Its side.
    pub party: Party,
    /// How it is started.
    pub start: Start,
}

impl Subject {
    /// A solver in the thread of its caller.
    pub fn in_thread(make: impl Fn() -> Host + Send + Sync + 'static) -> Self {
        let party = make().party();
        let start = Start::InThread(Arc::new(move |ends| (make(), ends)));
        Self { party, start }
    }

    /// Whether it is a process.
    pub fn is_process(&self) -> bool {
        matches!(self.start, Start::Command(_))
    }

    /// Starts it in a run of its own.
    ///
    /// # Errors
    /// Why the run cannot be opened, or the solver not be started.
    pub fn start(&self) -> io::Result<Hosted> {
        let (party, other) = (self.party, self.party.other_solver());
        let other = other.expect("a solver is under test");
        let (coupler, peer, worker): (Ends, Ends, _) = match &self.start {
            Start::Command(command) => {
                // In this order, so that the directory is removed last if there is no such program.
                let (domain, created, coupler, peer) =
                    shared(party, other).map_err(io::Error::other)?;
                let child = process::start(command, party, domain.domain(), Stdio::inherit())?;
                let worker = Worker::Process {
                    child,
                    start: Instant::now(),
                    created,
                    domain,
                };
                (coupler, peer, worker)
            }
            Start::InThread(make) => {
                let ends = Direct::new();
                let (host, own) = make(Box::new(ends.of(party)));
                let peer = Box::new(ends.of(other));
                let worker = Worker::InThread(Served::new(host, own), ends.clone());
                (Box::new(ends), peer, worker)
            }
        };
        Ok(Hosted {
            party,
            coupler,
            peer,
            failed: None,
            awaited: Kind::Notice,
            pieces: VecDeque::new(),
            ended: None,
            worker,
        })
    }
}

/// A run of a solver in shared memory: its names, all channels, and the ends of the coupler and of the `other` solver.
fn shared(
    solver: Party,
    other: Party,
) -> Result<(OwnedDomain, Created, Ends, Ends), TransportError> {
    let domain = OwnedDomain::create()?;
    let names = domain.domain();
    let created = create(names, &[Party::Mpm, Party::Dem], false)?;
    let coupler = join(names, Party::Coupler, &[solver], SEND_TIMEOUT)?;
    let mut peer = join(names, other, &[], SEND_TIMEOUT)?;
    peer.open(&Channel::before_ready(other, true))?;
    Ok((domain, created, coupler, peer))
}

/// A solver at work, and where its channels are.
enum Worker {
    /// In a process, which has joined this run in shared memory.
    Process {
        child: Child,
        start: Instant,
        created: Created,
        domain: OwnedDomain,
    },
    /// In the thread of its caller.
    InThread(Served, Direct),
}

impl Worker {
    /// How it ended, if it has.
    fn ended(&mut self) -> Option<String> {
        match self {
            Self::Process { child, .. } => child.try_wait().ok().flatten().map(process::describe),
            Self::InThread(solver, _) => solver.ended(),
        }
    }

    /// Gives a solver in this thread a turn; returns whether it did anything.
    fn turn(&mut self) -> bool {
        match self {
            Self::Process { .. } => false,
            Self::InThread(solver, _) => solver.turn(),
        }
    }

    /// Lets time pass while a solver in this thread waits, `at_most` and no more than it waits for.
    fn skip(&mut self, at_most: Duration) {
        if let Self::InThread(solver, _) = self {
            solver.skip(at_most);
        }
    }
}

/// What there is instead of a message.
#[derive(Debug, Error)]
pub enum Instead {
    /// The channels do not work.
    #[error(transparent)]
    Channel(#[from] TransportError),
    /// Nothing, for this long.
    #[error("nothing for {:.1} s", .0.as_secs_f64())]
    Nothing(Duration),
    /// A notice, in words.
    #[error("{0}")]
    Notice(String),
    /// The end of the solver.
    #[error("a solver that {0}")]
    End(String),
}

/// A solver in a run of its own. Dropping it ends the solver, and the run as if the coupler had died.
pub struct Hosted {
    party: Party,
    /// The coupler's ends of every channel that the solver may open, those of a coupled run included.
    coupler: Ends,
    /// Those of the other solver.
    peer: Ends,
    /// The last words of the solver, if they came instead of a message.
    pub failed: Option<Failure>,
    /// What is awaited.
    awaited: Kind,
    /// Pieces of a state that came before it: there may be more than a channel holds (clause K-3).
    pieces: VecDeque<Message>,
    /// The solver's end. It is reported at the second look, because what was sent before it is looked for in between.
    ended: Option<String>,
    // The last field, so that the ports are dropped before the directory is removed.
    worker: Worker,
}

impl Hosted {
    /// The channel of this kind, and those ends of which one is its other end.
    fn ends(&mut self, kind: Kind) -> (Channel, &mut dyn Transport) {
        let channel = Channel::of(self.party, kind);
        let ends = if channel.is_between_solvers() {
            &mut self.peer
        } else {
            &mut self.coupler
        };
        (channel, &mut **ends)
    }

    /// Sends a message as it is, and wakes its receiver as B-2 says.
    ///
    /// # Errors
    /// [`TransportError::Full`] if the solver takes nothing.
    pub fn send(&mut self, message: &Message) -> Result<(), TransportError> {
        let (channel, ends) = self.ends(message.kind());
        ends.send_and_wake(channel, message)
    }

    /// Sends a message as it is, and wakes nobody.
    ///
    /// # Errors
    /// As [`Self::send`].
    pub fn send_silently(&mut self, message: &Message) -> Result<(), TransportError> {
        let (channel, ends) = self.ends(message.kind());
        ends.send(channel, &message.header, message.payload.records())
    }

    /// The next message of this kind, if there is one.
    ///
    /// # Errors
    /// [`TransportError`].
    pub fn receive(&mut self, kind: Kind) -> Result<Option<Message>, TransportError> {
        if kind == Kind::Saved && !self.pieces.is_empty() {
            return Ok(self.pieces.pop_front());
        }
        let (channel, ends) = self.ends(kind);
        ends.take(channel)
    }

    /// Channels that the solver has not opened at its end.
    pub fn unopened(&self) -> Vec<&str> {
        match &self.worker {
            Worker::Process { created, .. } => created.unopened(self.party),
            Worker::InThread(_, ends) => ends.unopened(self.party),
        }
    }

    /// From now on the solver sees the coupler as gone, although the channels still exist.
    pub fn release(&self) {
        match &self.worker {
            Worker::Process { domain, .. } => domain.release(),
            Worker::InThread(_, ends) => ends.release(),
        }
    }

    /// Time since it was started. In the thread of the caller only time in which both wait counts, and it is not waited for.
    pub fn elapsed(&self) -> Duration {
        match &self.worker {
            Worker::Process { start, .. } => start.elapsed(),
            Worker::InThread(solver, _) => solver.waited(),
        }
    }

    /// Time since then.
    pub fn since(&self, start: Duration) -> Duration {
        self.elapsed().saturating_sub(start)
    }

    /// Waits for a message of this kind.
    ///
    /// # Errors
    /// What there is instead.
    pub fn expect(&mut self, kind: Kind, deadline: Duration) -> Result<Message, Instead> {
        (self.awaited, self.ended) = (kind, None);
        if self.pid().is_some() {
            return wait(self, &mut Spin::default(), deadline).map_err(Instead::Nothing)?;
        }
        self.turns(deadline, Self::look, |solver| {
            let instead = solver.notice_instead();
            let instead = instead.or_else(|| solver.worker.ended().map(Instead::End));
            instead.map(Err)
        })
        .unwrap_or_else(|silence| Err(Instead::Nothing(silence)))
    }

    /// Looks until something is there, for `at_most` at most, every so often if the solver is a process.
    pub fn until<T>(
        &mut self,
        at_most: Duration,
        every: Duration,
        mut look: impl FnMut(&mut Self) -> Option<T>,
    ) -> Option<T> {
        if self.pid().is_some() {
            return until(at_most, every, || look(self));
        }
        self.turns(at_most, look, |_| None).ok()
    }

    /// Gives a solver in this thread turns until something is there, for `at_most` at most. When it only waits, there may be
    /// something else `instead`.
    ///
    /// # Errors
    /// How long nothing was there.
    fn turns<T>(
        &mut self,
        at_most: Duration,
        mut look: impl FnMut(&mut Self) -> Option<T>,
        instead: impl Fn(&mut Self) -> Option<T>,
    ) -> Result<T, Duration> {
        let start = self.elapsed();
        loop {
            if let Some(found) = look(self) {
                return Ok(found);
            }
            if self.worker.turn() {
                continue;
            }
            if let Some(instead) = instead(self) {
                return Ok(instead);
            }
            let silence = self.since(start);
            if silence >= at_most {
                return Err(silence);
            }
            self.worker.skip(at_most.saturating_sub(silence));
        }
    }

    /// Blocks until the solver wakes the receiver of this kind, for `at_most` at most; returns how often it has since the
    /// last call.
    pub fn sleep(&mut self, kind: Kind, at_most: Duration) -> u64 {
        if self.pid().is_some() || at_most.is_zero() {
            let (channel, ends) = self.ends(kind);
            return ends.sleep(channel.from(), at_most);
        }
        let woken = |solver: &mut Self| {
            let times = solver.sleep(kind, Duration::ZERO);
            (times > 0).then_some(times)
        };
        self.until(at_most, at_most, woken).unwrap_or(0)
    }

    /// Leaves the solver alone for this long.
    pub fn leave_alone(&mut self, time: Duration) {
        self.until(time, time, |_| None::<()>);
    }

    /// Waits for the end of the solver for `within` at most; returns how it ended.
    pub fn end(&mut self, within: Duration) -> Option<String> {
        let every = Duration::from_micros(200);
        self.until(within, every, |solver| solver.worker.ended())
    }

    /// A notice, if something else is awaited, or why there is none.
    fn notice_instead(&mut self) -> Option<Instead> {
        if self.awaited == Kind::Notice {
            return None;
        }
        let notice = match self.receive(Kind::Notice) {
            Ok(notice) => notice?,
            Err(error) => return Some(error.into()),
        };
        let words = match notice.as_notice() {
            Ok(Notice::Failed(failure)) => {
                let words = format!("Failed: {}", failure.message);
                self.failed = Some(failure);
                words
            }
            Ok(notice) => format!("{notice:?}"),
            Err(why) => why,
        };
        Some(Instead::Notice(words))
    }

    /// Process id of the solver, if it is a process.
    pub fn pid(&self) -> Option<u32> {
        match &self.worker {
            Worker::Process { child, .. } => Some(child.id()),
            Worker::InThread(..) => None,
        }
    }

    /// The run that the solver has joined, if it is a process.
    pub fn domain(&self) -> Option<&Domain> {
        match &self.worker {
            Worker::Process { domain, .. } => Some(domain.domain()),
            Worker::InThread(..) => None,
        }
    }
}

impl Awaited for Hosted {
    type Found = Result<Message, Instead>;

    /// Short, because the kit often waits for the end of a solver.
    const NAP: Duration = Duration::from_micros(500);

    fn look(&mut self) -> Option<Self::Found> {
        let message = self.receive(self.awaited);
        if let Ok(None) = message {
            let (saved, ends) = self.ends(Kind::Saved);
            let pieces = core::iter::from_fn(|| ends.take(saved).transpose());
            match pieces.collect::<Result<Vec<_>, _>>() {
                Ok(pieces) => self.pieces.extend(pieces),
                Err(error) => return Some(Err(error.into())),
            }
        }
        message.map_err(Instead::from).transpose()
    }

    fn block(&mut self, at_most: Duration) {
        self.sleep(self.awaited, at_most);
    }

    fn interruption(&mut self, _: Duration) -> Option<Self::Found> {
        if let Some(instead) = self.notice_instead() {
            return Some(Err(instead));
        }
        if let Some(end) = self.ended.take() {
            return Some(Err(Instead::End(end)));
        }
        self.ended = self.worker.ended();
        None
    }
}

impl Drop for Hosted {
    fn drop(&mut self) {
        if let Worker::Process { child, .. } = &mut self.worker {
            process::kill(child);
            let _ = child.wait();
        }
    }
}
