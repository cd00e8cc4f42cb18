//! Starts solvers as processes, watches them, and sees them off.

use std::io;
use std::process::Child;
use std::time::{Duration, Instant};

use interface::message::control::Party;
use interface::session::process;
use interface::transport::domain::Domain;
use thiserror::Error;

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
pub struct Processes {
    all: Vec<Process>,
}

#[derive(Debug)]
struct Process {
    party: Party,
    child: Child,
    /// Its end has been seen once: its last words, sent before, get one more chance to be read.
    seen_ended: bool,
}

impl Processes {
    /// Starts the solver of one side: a program and its arguments, to which `--join RUN` is added.
    ///
    /// # Errors
    /// [`StartError`].
    pub fn start(
        &mut self,
        party: Party,
        command: &[String],
        domain: &Domain,
    ) -> Result<(), StartError> {
        let child = process::start(command, party, domain).map_err(|source| StartError {
            party,
            command: command.join(" "),
            source,
        })?;
        self.all.push(Process {
            party,
            child,
            seen_ended: false,
        });
        Ok(())
    }

    /// Process id of a solver.
    pub fn pid(&self, party: Party) -> Option<u32> {
        let mut all = self.all.iter();
        all.find(|m| m.party == party)
            .map(|process| process.child.id())
    }

    /// Tells of a solver that has ended, and how, when it is looked at for the second time.
    pub fn ended(&mut self) -> Option<(Party, String)> {
        for process in &mut self.all {
            let how = match process.child.try_wait() {
                Ok(Some(status)) => process::describe(status),
                Ok(None) => continue,
                Err(e) => format!("cannot be watched ({e})"),
            };
            if process.seen_ended {
                return Some((process.party, how));
            }
            process.seen_ended = true;
        }
        None
    }

    /// Waits for all solvers to end, for [`GRACE`] at most; those that have not are killed.
    pub fn end_all(&mut self) {
        let deadline = Instant::now() + GRACE;
        for Process { party, child, .. } in &mut self.all {
            while matches!(child.try_wait(), Ok(None)) && Instant::now() < deadline {
                std::thread::sleep(Duration::from_millis(1));
            }
            if matches!(child.try_wait(), Ok(None)) {
                tracing::warn!(party = %party, pid = child.id(), "did not end and is killed");
                process::kill(child);
                let _ = child.wait();
            }
        }
        self.all.clear();
    }
}

impl Drop for Processes {
    fn drop(&mut self) {
        self.end_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use interface::transport::domain::OwnedDomain;

    #[test]
    fn an_end_is_told_at_the_second_look_with_how() {
        let owned = OwnedDomain::create().unwrap();
        let mut processes = Processes::default();
        let command = ["sh", "-c", "exit 7"].map(String::from).to_vec();
        processes
            .start(Party::Dem, &command, owned.domain())
            .unwrap();
        let start = Instant::now();
        let told = loop {
            if let Some(told) = processes.ended() {
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
        let mut processes = Processes::default();
        let command = ["sh", "-c", "sleep 60"].map(String::from).to_vec();
        processes
            .start(Party::Mpm, &command, owned.domain())
            .unwrap();
        let pid = processes.pid(Party::Mpm).unwrap();
        processes.end_all();
        assert!(!std::path::Path::new(&format!("/proc/{pid}/status")).exists());
    }

    #[test]
    fn what_a_solver_has_started_ends_with_it() {
        let owned = OwnedDomain::create().unwrap();
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("pid");
        let script = format!("sleep 61 & echo $! > {}; wait", file.display());
        let mut processes = Processes::default();
        let command = ["sh", "-c", &script].map(String::from).to_vec();
        processes
            .start(Party::Dem, &command, owned.domain())
            .unwrap();
        let pid = loop {
            match std::fs::read_to_string(&file) {
                Ok(pid) if pid.ends_with('\n') => break pid.trim().to_string(),
                _ => std::thread::sleep(Duration::from_millis(2)),
            }
        };
        processes.end_all();
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
        let command = ["/no/such/solver".to_string()];
        let error = Processes::default()
            .start(Party::Dem, &command, owned.domain())
            .unwrap_err();
        assert!(
            error
                .to_string()
                .starts_with("cannot start the dem solver `/no/such/solver`"),
            "{error}"
        );
    }
}
