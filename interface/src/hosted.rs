//! One solver that is started alone, while all other ends of its run are in the hands of the caller: the conformance kit
//! judges it, a replay compares what it answers ([`crate::recording::replay`]).

use std::io;
use std::process::{Child, Stdio};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

use thiserror::Error;

use crate::message::control::{Failure, Notice, Order, Party};
use crate::session::process;
use crate::transport::domain::Domain;
use crate::transport::raw::{ChannelError, Kind, Message, RawRun};
use crate::transport::wait::{Awaited, Spin, until, wait};

/// Longest wait for a thread to end once its coupler is gone; one that is stuck ends with the program.
const GRACE: Duration = Duration::from_secs(2);

/// A function that joins a run as a process does, and returns its exit status.
pub type Solve = Arc<dyn Fn(&Domain) -> u8 + Send + Sync>;

/// How a solver is started.
#[derive(Clone)]
pub enum Start {
    /// A program and its arguments, to which `--join RUN` is added.
    Command(Vec<String>),
    /// A function, in a thread.
    Thread(Solve),
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
    /// A solver that this program serves in a thread.
    pub fn in_thread<E>(
        party: Party,
        serve: impl Fn(&Domain) -> Result<(), E> + Send + Sync + 'static,
    ) -> Self {
        let solve = move |domain: &Domain| if serve(domain).is_ok() { 0 } else { 3 };
        let start = Start::Thread(Arc::new(solve));
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
        let run = RawRun::open(self.party).map_err(io::Error::other)?;
        let domain = run.domain().clone();
        let worker = match &self.start {
            Start::Command(command) => {
                let child = process::start(command, self.party, &domain, Stdio::inherit());
                Worker::Process(child?)
            }
            Start::Thread(solve) => {
                let solve = solve.clone();
                let thread = std::thread::Builder::new().name(self.party.name().to_string());
                Worker::Thread(Some(thread.spawn(move || solve(&domain))?))
            }
        };
        Ok(Hosted {
            run,
            worker,
            failed: None,
            awaited: Kind::Notice,
            ended: None,
        })
    }
}

/// A solver at work.
enum Worker {
    /// In a process.
    Process(Child),
    /// In a thread, until its end is seen.
    Thread(Option<JoinHandle<u8>>),
}

impl Worker {
    /// How it ended, if it has.
    fn ended(&mut self) -> Option<String> {
        match self {
            Self::Process(child) => child.try_wait().ok().flatten().map(process::describe),
            Self::Thread(handle) => {
                let handle = handle.take_if(|h| h.is_finished())?;
                Some(match handle.join() {
                    Ok(status) => format!("ended with exit status {status}"),
                    Err(_) => "panicked".to_string(),
                })
            }
        }
    }
}

/// What there is instead of a message.
#[derive(Debug, Error)]
pub enum Instead {
    /// The channels do not work.
    #[error(transparent)]
    Channel(#[from] ChannelError),
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

/// A solver in a run of its own. Dropping it ends the solver.
pub struct Hosted {
    /// The coupler's and the peer's ends.
    pub run: RawRun,
    worker: Worker,
    /// The last words of the solver, if they came instead of a message.
    pub failed: Option<Failure>,
    /// What is awaited.
    awaited: Kind,
    /// The solver's end. It is reported at the second look, because what was sent before it is looked for in between.
    ended: Option<String>,
}

impl Hosted {
    /// Waits for a message of this kind.
    ///
    /// # Errors
    /// What there is instead.
    pub fn expect(&mut self, kind: Kind, deadline: Duration) -> Result<Message, Instead> {
        (self.awaited, self.ended) = (kind, None);
        wait(self, &mut Spin::default(), deadline).map_err(Instead::Nothing)?
    }

    /// Waits for the end of the solver for `within` at most; returns how it ended.
    pub fn end(&mut self, within: Duration) -> Option<String> {
        until(within, Duration::from_micros(200), || self.worker.ended())
    }

    /// Process id of the solver, if it is a process.
    pub fn pid(&self) -> Option<u32> {
        match &self.worker {
            Worker::Process(child) => Some(child.id()),
            Worker::Thread(_) => None,
        }
    }
}

impl Awaited for Hosted {
    type Found = Result<Message, Instead>;

    /// Short, because the kit often waits for the end of a solver.
    const NAP: Duration = Duration::from_micros(500);

    fn look(&mut self) -> Option<Self::Found> {
        let message = self.run.receive(self.awaited);
        message.map_err(Instead::from).transpose()
    }

    fn block(&mut self, at_most: Duration) {
        self.run.sleep(self.awaited, at_most);
    }

    fn interruption(&mut self, _: Duration) -> Option<Self::Found> {
        if self.awaited != Kind::Notice {
            match self.run.receive(Kind::Notice) {
                Ok(None) => {}
                Ok(Some(notice)) => {
                    let words = match notice.as_notice() {
                        Ok(Notice::Failed(failure)) => {
                            let words = format!("Failed: {}", failure.message);
                            self.failed = Some(failure);
                            words
                        }
                        Ok(notice) => format!("{notice:?}"),
                        Err(why) => why,
                    };
                    return Some(Err(Instead::Notice(words)));
                }
                Err(error) => return Some(Err(error.into())),
            }
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
        match &mut self.worker {
            Worker::Process(child) => {
                process::kill(child);
                let _ = child.wait();
            }
            Worker::Thread(handle) => {
                // A thread cannot be killed: it is told, and sees that the coupler is gone.
                let over = Order::Abort("nothing more is asked".into());
                let _ = self.run.send(&Message::order(&over));
                self.run.release();
                let gone = || {
                    handle
                        .as_ref()
                        .is_none_or(JoinHandle::is_finished)
                        .then_some(())
                };
                until(GRACE, Duration::from_micros(100), gone);
            }
        }
    }
}
