//! Starts solvers, as processes or as threads of this one, watches them, and sees them off.

use std::io;
use std::process::Child;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use interface::control::Party;
use interface::domain::Domain;
use interface::process;
use interface::session::SessionError;
use thiserror::Error;

/// How a solver is started.
#[derive(Clone, Debug)]
pub enum Start {
    /// A program and its arguments, to which `--join RUN` is added.
    Process(Vec<String>),
    /// A function of this program, in a thread.
    Thread(fn(&Domain) -> Result<(), SessionError>),
}

/// A solver could not be started.
#[derive(Debug, Error)]
#[error("cannot start the {party} solver `{command}`: {source}")]
pub struct StartError {
    /// Which side.
    pub party: Party,
    /// What was to be started.
    pub command: String,
    /// Why it did not.
    pub source: io::Error,
}

/// Time for a solver to end by itself once the session is over.
const GRACE: Duration = Duration::from_secs(2);

/// The solvers of a run. Dropping it ends those that still run.
#[derive(Debug, Default)]
pub struct Crew {
    members: Vec<Member>,
}

#[derive(Debug)]
struct Member {
    party: Party,
    work: Work,
    /// Its end has been seen once: its last words, sent before, get one more chance to be read.
    ended: bool,
}

#[derive(Debug)]
enum Work {
    Process(Child),
    Thread(Option<JoinHandle<Result<(), SessionError>>>),
}

impl Crew {
    /// Starts the solver of one side.
    ///
    /// # Errors
    /// [`StartError`].
    pub fn start(
        &mut self,
        party: Party,
        start: &Start,
        domain: &Domain,
    ) -> Result<(), StartError> {
        let work = match start {
            Start::Process(command) => process::start(command, party, domain)
                .map(Work::Process)
                .map_err(|source| StartError {
                    party,
                    command: command.join(" "),
                    source,
                })?,
            Start::Thread(solve) => {
                let (solve, domain) = (*solve, domain.clone());
                std::thread::Builder::new()
                    .name(party.name().to_string())
                    .spawn(move || solve(&domain))
                    .map(|handle| Work::Thread(Some(handle)))
                    .map_err(|source| StartError {
                        party,
                        command: "a thread".into(),
                        source,
                    })?
            }
        };
        self.members.push(Member {
            party,
            work,
            ended: false,
        });
        Ok(())
    }

    /// Process id of a solver that is a process.
    pub fn pid(&self, party: Party) -> Option<u32> {
        self.members
            .iter()
            .find(|m| m.party == party)
            .and_then(|m| match &m.work {
                Work::Process(child) => Some(child.id()),
                Work::Thread(_) => None,
            })
    }

    /// Tells of a solver that has ended, and how, when it is looked at for the second time.
    pub fn casualty(&mut self) -> Option<(Party, String)> {
        for member in &mut self.members {
            let how = match &mut member.work {
                Work::Process(child) => match child.try_wait() {
                    Ok(Some(status)) => process::describe(status),
                    Ok(None) => continue,
                    Err(e) => format!("cannot be watched ({e})"),
                },
                Work::Thread(handle) if handle.as_ref().is_some_and(|h| !h.is_finished()) => {
                    continue;
                }
                Work::Thread(_) => "ended before the session did".to_string(),
            };
            if member.ended {
                return Some((member.party, how));
            }
            member.ended = true;
        }
        None
    }

    /// Waits for all solvers to end, for [`GRACE`] at most; processes that have not are killed.
    pub fn dismiss(&mut self) {
        let deadline = Instant::now() + GRACE;
        for member in &mut self.members {
            match &mut member.work {
                Work::Process(child) => {
                    while matches!(child.try_wait(), Ok(None)) && Instant::now() < deadline {
                        std::thread::sleep(Duration::from_millis(1));
                    }
                    if matches!(child.try_wait(), Ok(None)) {
                        tracing::warn!(party = %member.party, pid = child.id(), "did not end and is killed");
                        process::kill(child);
                        let _ = child.wait();
                    }
                }
                Work::Thread(handle) => {
                    while handle.as_ref().is_some_and(|h| !h.is_finished())
                        && Instant::now() < deadline
                    {
                        std::thread::sleep(Duration::from_millis(1));
                    }
                    // A thread cannot be killed; one that is stuck in a computation ends with the process.
                    if let Some(handle) = handle.take_if(|h| h.is_finished())
                        && let Err(panic) = handle.join()
                    {
                        let words = panic.downcast_ref::<String>().cloned().unwrap_or_default();
                        tracing::error!(party = %member.party, "panicked: {words}");
                    }
                }
            }
        }
        self.members.clear();
    }
}

impl Drop for Crew {
    fn drop(&mut self) {
        self.dismiss();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use interface::domain::OwnedDomain;

    #[test]
    fn an_end_is_told_at_the_second_look_with_how() {
        let owned = OwnedDomain::create().unwrap();
        let mut crew = Crew::default();
        let command = ["sh", "-c", "exit 7"].map(String::from).to_vec();
        crew.start(Party::Dem, &Start::Process(command), owned.domain())
            .unwrap();
        let start = Instant::now();
        let told = loop {
            if let Some(told) = crew.casualty() {
                break told;
            }
            assert!(start.elapsed() < Duration::from_secs(10));
            std::thread::sleep(Duration::from_millis(2));
        };
        assert_eq!(told, (Party::Dem, "ended with exit status 7".to_string()));
    }

    #[test]
    fn a_solver_that_does_not_end_is_killed() {
        let owned = OwnedDomain::create().unwrap();
        let mut crew = Crew::default();
        let command = ["sh", "-c", "sleep 60"].map(String::from).to_vec();
        crew.start(Party::Mpm, &Start::Process(command), owned.domain())
            .unwrap();
        let pid = crew.pid(Party::Mpm).unwrap();
        crew.dismiss();
        assert!(!std::path::Path::new(&format!("/proc/{pid}/status")).exists());
    }

    #[test]
    fn what_a_solver_has_started_ends_with_it() {
        let owned = OwnedDomain::create().unwrap();
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("pid");
        let script = format!("sleep 61 & echo $! > {}; wait", file.display());
        let mut crew = Crew::default();
        let command = ["sh", "-c", &script].map(String::from).to_vec();
        crew.start(Party::Dem, &Start::Process(command), owned.domain())
            .unwrap();
        let pid = loop {
            match std::fs::read_to_string(&file) {
                Ok(pid) if pid.ends_with('\n') => break pid.trim().to_string(),
                _ => std::thread::sleep(Duration::from_millis(2)),
            }
        };
        crew.dismiss();
        // A signal takes effect a little later; one that nobody has reaped yet is a zombie, which does not run either.
        let start = Instant::now();
        loop {
            let state = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
            if state.is_empty() || state.contains(") Z ") {
                break;
            }
            assert!(start.elapsed() < Duration::from_secs(10), "{state}");
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    #[test]
    fn a_program_that_does_not_exist_is_named() {
        let owned = OwnedDomain::create().unwrap();
        let start = Start::Process(vec!["/no/such/solver".into()]);
        let error = Crew::default()
            .start(Party::Dem, &start, owned.domain())
            .unwrap_err();
        assert!(
            error
                .to_string()
                .starts_with("cannot start the dem solver `/no/such/solver`"),
            "{error}"
        );
    }
}
