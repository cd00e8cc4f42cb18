//! Starts solvers as processes, watches them, keeps their output, and makes sure that they end.

use std::collections::VecDeque;
use std::fs::File;
use std::io::{self, Read, Write};
use std::os::unix::process::ExitStatusExt;
use std::process::{Child, ChildStderr, ExitStatus, Stdio};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use interface::files::How;
use interface::message::control::Party;
use interface::session::process;
use interface::transport::domain::Domain;
use interface::transport::liveness::{Hold, hold_of};
use interface::transport::wait::until;
use rustix::process::{Pid, WaitId, WaitIdOptions, waitid};
use thiserror::Error;

use crate::record::rundir::RunDir;
use crate::record::screen::Screen;

/// A solver could not be started.
#[derive(Debug, Error)]
#[error("cannot start the {party} solver `{command}`: {source}")]
pub struct StartError {
    /// Which side.
    pub party: Party,
    /// What was to be started.
    pub command: String,
    /// Why it did not start.
    pub source: io::Error,
}

/// Time for a solver to end by itself once the session is over.
const GRACE: Duration = Duration::from_secs(2);
/// Longest wait for the last output of a solver that has ended.
const READING: Duration = Duration::from_millis(500);
/// Time between two looks at a solver that ends.
const LOOK: Duration = Duration::from_millis(1);
/// Bytes of a solver's output that are kept in memory.
const KEPT: usize = 8 << 10;
/// Bytes of a solver's output from which its file is bounded: the head, and as much of the end again.
const HEAD: u64 = 8 << 20;
/// Number of its last lines that are quoted when a run fails.
const LAST_LINES: usize = 20;

/// The solvers of a run. Dropping it ends those that still run.
#[derive(Debug, Default)]
pub struct Processes {
    all: Vec<Process>,
    /// Directory for the output of the solvers, besides standard error.
    dir: Option<RunDir>,
    /// The screen that shows standard error.
    screen: Option<Screen>,
    /// The last output of solvers that have ended.
    last_words: Vec<(Party, String)>,
}

#[derive(Debug)]
struct Process {
    party: Party,
    child: Child,
    stderr: CapturedStderr,
    /// Whether its end has been seen once. Its last message was sent before, so it gets one more chance to be read.
    seen_ended: bool,
}

impl Process {
    /// How it ended, if it has. It remains a zombie, so that the number of its group stays reserved until the group is
    /// killed.
    fn ended(&self) -> io::Result<Option<ExitStatus>> {
        let pid = i32::try_from(self.child.id()).ok().and_then(Pid::from_raw);
        let pid = pid.ok_or_else(|| io::Error::other("no such process id"))?;
        let options = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
        let status = waitid(WaitId::Pid(pid), options)?;
        Ok(status.map(|status| {
            let raw = match (status.exit_status(), status.terminating_signal()) {
                (Some(code), _) => code << 8,
                (None, Some(signal)) => signal,
                (None, None) => 0,
            };
            ExitStatus::from_raw(raw)
        }))
    }
}

impl Processes {
    /// No processes yet. Their output on standard error will also go to `mpm.log` and `dem.log` in `dir`.
    pub fn new(dir: RunDir, screen: Option<Screen>) -> Self {
        let mut none = Self::default();
        none.dir = Some(dir);
        none.screen = screen;
        none
    }

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
        let mut child =
            process::start(command, party, domain, Stdio::piped()).map_err(|source| {
                StartError {
                    party,
                    command: command.join(" "),
                    source,
                }
            })?;
        let stderr = child.stderr.take().expect("it was asked for");
        self.all.push(Process {
            party,
            child,
            stderr: CapturedStderr::read(stderr, party, self.dir.clone(), self.screen.clone()),
            seen_ended: false,
        });
        Ok(())
    }

    /// A solver that has ended, and how. It is reported the second time that its end is seen.
    pub fn ended(&mut self) -> Option<(Party, String)> {
        for process in &mut self.all {
            let how = match process.ended() {
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

    /// A solver that is alive and does not run, and why.
    pub fn held(&self) -> Option<(Party, Hold)> {
        let mut all = self.all.iter();
        all.find_map(|process| Some((process.party, hold_of(process.child.id())?)))
    }

    /// Waits for all solvers to end, for at most [`GRACE`]. Then kills those that have not ended, or that a signal has
    /// stopped, and every process that a solver has started and left.
    pub fn end_all(&mut self) {
        let deadline = Instant::now() + GRACE;
        for mut process in self.all.drain(..) {
            let is_stopped = || hold_of(process.child.id()) == Some(Hold::Stopped);
            let left = deadline.saturating_duration_since(Instant::now());
            until(left, LOOK, || {
                (!matches!(process.ended(), Ok(None)) || is_stopped()).then_some(())
            });
            if matches!(process.ended(), Ok(None)) {
                let (party, pid) = (process.party, process.child.id());
                tracing::warn!(%party, pid, "did not end and is killed");
            }
            process::kill(&mut process.child);
            let _ = process.child.wait();
            self.last_words.push((process.party, process.stderr.last()));
        }
    }

    /// The last lines of output of this side's solver, after all have ended.
    pub fn last_words(&self, party: Party) -> Option<&str> {
        let mut all = self.last_words.iter();
        let words = all.find(|(of, _)| *of == party).map(|(_, words)| words)?;
        (!words.is_empty()).then_some(words)
    }
}

impl Drop for Processes {
    fn drop(&mut self) {
        self.end_all();
    }
}

/// The standard error of a solver. It is passed on and written to a file, and its end is kept in memory.
#[derive(Debug)]
struct CapturedStderr {
    tail: Arc<Mutex<Vec<u8>>>,
    reader: JoinHandle<()>,
}

impl CapturedStderr {
    fn read(
        mut stderr: ChildStderr,
        party: Party,
        dir: Option<RunDir>,
        screen: Option<Screen>,
    ) -> Self {
        let tail = Arc::new(Mutex::new(Vec::new()));
        let kept = tail.clone();
        let reader = thread::spawn(move || {
            // The file is created at the first output.
            let mut file: Option<HeadAndTail<File>> = None;
            let mut bytes = vec![0; 4096];
            loop {
                let output = match stderr.read(&mut bytes) {
                    Ok(0) => break,
                    Ok(read) => &bytes[..read],
                    Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                    Err(_) => break,
                };
                match &screen {
                    Some(screen) => screen.text(output),
                    None => drop(io::stderr().write_all(output)),
                }
                keep(&mut kept.lock().expect("no thread panics"), output);
                if file.is_none() {
                    let name = format!("{}.log", party.name());
                    let opened = dir
                        .as_ref()
                        .and_then(|dir| dir.open(&name, How::Append).ok());
                    file = opened.map(|(file, _)| HeadAndTail::new(file, HEAD));
                }
                // If the file cannot be written, standard error still shows the output.
                if let Some(file) = &mut file {
                    let _ = file.write(output);
                }
            }
            if let Some(file) = file {
                let _ = file.finish();
            }
        });
        Self { tail, reader }
    }

    /// The last lines, after the process has ended. A process that has left its group may still hold the other end of
    /// the pipe, so the wait is limited.
    fn last(&self) -> String {
        until(READING, LOOK, || self.reader.is_finished().then_some(()));
        last_lines(&self.tail.lock().expect("no thread panics"))
    }
}

/// Appends to the output in memory, of which only the end is kept.
fn keep(tail: &mut Vec<u8>, bytes: &[u8]) {
    tail.extend(bytes);
    let over = tail.len().saturating_sub(KEPT);
    tail.drain(..over);
}

/// A log of which the head and the tail are kept, however long it is.
struct HeadAndTail<W> {
    file: W,
    /// Bytes of the head that are still to come, and most bytes of the tail.
    left: usize,
    most: usize,
    tail: VecDeque<u8>,
    left_out: u64,
}

impl<W: Write> HeadAndTail<W> {
    fn new(file: W, most: u64) -> Self {
        let most = usize::try_from(most).unwrap_or(usize::MAX);
        Self {
            file,
            left: most,
            most,
            tail: VecDeque::new(),
            left_out: 0,
        }
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        let (head, rest) = bytes.split_at(bytes.len().min(self.left));
        self.left -= head.len();
        self.tail.extend(rest);
        let over = self.tail.len().saturating_sub(self.most);
        self.tail.drain(..over);
        self.left_out += over as u64;
        self.file.write_all(head)
    }

    /// Nothing more comes.
    fn finish(mut self) -> io::Result<()> {
        if self.left_out > 0 {
            writeln!(self.file, "\n[{} bytes are left out here]", self.left_out)?;
        }
        self.file.write_all(self.tail.make_contiguous())
    }
}

fn last_lines(tail: &[u8]) -> String {
    let text = String::from_utf8_lossy(tail);
    let lines: Vec<&str> = text.trim_end().lines().collect();
    lines[lines.len().saturating_sub(LAST_LINES)..].join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use interface::transport::domain::OwnedDomain;

    /// Starts a script as a solver.
    fn start(processes: &mut Processes, party: Party, script: &str) -> OwnedDomain {
        let owned = OwnedDomain::create().unwrap();
        let command = ["sh", "-c", script].map(String::from).to_vec();
        processes.start(party, &command, owned.domain()).unwrap();
        owned
    }

    /// A signal takes effect a little later. A process that has not been reaped is a zombie, which does not run either.
    #[track_caller]
    fn assert_ends(pid: &str) {
        let start = Instant::now();
        loop {
            let state = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
            if state.is_empty() || state.contains(") Z ") {
                break;
            }
            assert!(start.elapsed() < Duration::from_secs(10), "{state}");
            thread::sleep(Duration::from_millis(2));
        }
    }

    /// D15: the leader of the group may have ended long before the solvers are removed.
    #[test]
    fn what_a_solver_has_started_ends_with_it_also_if_it_has_exited() {
        for then in ["wait", "exit"] {
            let dir = tempfile::tempdir().unwrap();
            let file = dir.path().join("pid");
            let script = format!("sleep 61 & echo $! > {}; {then}", file.display());
            let mut processes = Processes::default();
            let _domain = start(&mut processes, Party::Dem, &script);
            let written = || std::fs::read_to_string(&file).is_ok_and(|pid| pid.ends_with('\n'));
            while !written() || (then == "exit" && processes.ended().is_none()) {
                thread::sleep(Duration::from_millis(2));
            }
            processes.end_all();
            assert_ends(std::fs::read_to_string(&file).unwrap().trim());
        }
    }

    /// A solver that wrote all the time filled the disk.
    #[test]
    fn of_a_long_log_head_and_tail_are_kept() {
        let written = |pieces: &[&[u8]]| {
            let mut file = Vec::new();
            let mut log = HeadAndTail::new(&mut file, 4);
            for piece in pieces {
                log.write(piece).unwrap();
            }
            log.finish().unwrap();
            String::from_utf8(file).unwrap()
        };
        assert_eq!(written(&[b"ab", b"cdef", b"gh"]), "abcdefgh");
        let long = written(&[b"abc", b"defghijk", b"l", b"mn"]);
        assert_eq!(long, "abcd\n[6 bytes are left out here]\nklmn");
    }
}
