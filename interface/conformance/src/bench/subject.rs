//! The solver under test: a command, or a function of this program.

use std::process::{Child, Stdio};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use interface::message::control::Party;
use interface::session::process;
use interface::transport::domain::Domain;

/// Longest wait for a thread to end once its coupler is gone; one that is stuck ends with the program.
const GRACE: Duration = Duration::from_secs(2);

/// A function that joins a run as a process does, and returns its exit status.
pub type Solve = Arc<dyn Fn(&Domain) -> u8 + Send + Sync>;

/// How the solver under test is started.
#[derive(Clone)]
pub enum Start {
    /// A program and its arguments, to which `--join RUN` is added.
    Command(Vec<String>),
    /// A function, in a thread.
    Thread(Solve),
}

/// The solver under test.
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

    /// Starts it in a run.
    pub(crate) fn start(&self, domain: &Domain) -> std::io::Result<Worker> {
        match &self.start {
            Start::Command(command) => {
                process::start(command, self.party, domain, Stdio::inherit()).map(Worker::Process)
            }
            Start::Thread(solve) => {
                let (solve, domain) = (solve.clone(), domain.clone());
                std::thread::Builder::new()
                    .name(self.party.name().to_string())
                    .spawn(move || solve(&domain))
                    .map(|handle| Worker::Thread(Some(handle)))
            }
        }
    }
}

/// The solver under test at work.
pub enum Worker {
    /// In a process.
    Process(Child),
    /// In a thread, until its end is seen.
    Thread(Option<JoinHandle<u8>>),
}

impl Worker {
    /// How it ended, if it has.
    pub fn ended(&mut self) -> Option<String> {
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

    /// Process id, of a process.
    pub fn pid(&self) -> Option<u32> {
        match self {
            Self::Process(child) => Some(child.id()),
            Self::Thread(_) => None,
        }
    }

    /// Ends it: a process at once, a thread by itself.
    pub fn dismiss(&mut self) {
        match self {
            Self::Process(child) => {
                process::kill(child);
                let _ = child.wait();
            }
            Self::Thread(handle) => {
                let start = Instant::now();
                while handle.as_ref().is_some_and(|h| !h.is_finished()) && start.elapsed() < GRACE {
                    interface::transport::wait::nap(Duration::from_micros(100));
                }
                if let Some(handle) = handle.take_if(|h| h.is_finished()) {
                    let _ = handle.join();
                }
            }
        }
    }
}
