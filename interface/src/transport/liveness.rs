//! Tests whether a process that is alive can also run. If it is stopped or blocked by the system, the time does not
//! count towards a deadline (clause S-11).

#![allow(clippy::disallowed_methods, reason = "/proc")]

use std::fmt::{self, Display};
use std::fs;
use std::path::Path;

/// Why a process that is alive does not run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hold {
    /// A signal (Ctrl-Z, SIGSTOP) or a debugger has stopped it.
    Stopped,
    /// It waits within the system and cannot be interrupted, as for a disk that does not answer.
    Blocked,
    /// Its control group is frozen: a container that is paused.
    Frozen,
    /// It waits until a disk has taken what it writes, and has announced that (clause O-7).
    WaitsForDisk,
}

impl Display for Hold {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Stopped => "stopped by a signal or a debugger",
            Self::Blocked => "blocked within the system, as by a disk that does not answer",
            Self::WaitsForDisk => "waiting for its disk",
            Self::Frozen => "frozen with its control group, as in a paused container",
        })
    }
}

/// Why the process `pid` does not run although it lives. Only Linux reports it; elsewhere every process counts as running.
pub fn hold_of(pid: u32) -> Option<Hold> {
    let process = Path::new("/proc").join(pid.to_string());
    match state(&fs::read_to_string(process.join("stat")).ok()?)? {
        'T' | 't' => Some(Hold::Stopped),
        'D' => Some(Hold::Blocked),
        _ => group_is_frozen(&process).then_some(Hold::Frozen),
    }
}

/// The state in a line of `/proc/PID/stat`: the letter after the name. The name stands in parentheses and may contain
/// anything.
fn state(stat: &str) -> Option<char> {
    stat.rsplit_once(')')?.1.trim_start().chars().next()
}

/// Whether the process's control group (version 2) is frozen.
fn group_is_frozen(process: &Path) -> bool {
    let events = || {
        let groups = fs::read_to_string(process.join("cgroup")).ok()?;
        let path = groups.lines().find_map(|line| line.strip_prefix("0::/"))?;
        let group = Path::new("/sys/fs/cgroup").join(path);
        fs::read_to_string(group.join("cgroup.events")).ok()
    };
    events().is_some_and(|events| events.lines().any(|line| line == "frozen 1"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::{Child, Command};
    use std::time::{Duration, Instant};

    use rustix::process::{Pid, Signal, kill_process};

    #[test]
    fn the_state_is_behind_a_name_with_parentheses() {
        assert_eq!(state("12 (a) b (c) T 1 12 12"), Some('T'));
        assert_eq!(state("12 (sleep) S 1"), Some('S'));
        assert_eq!(state("no process"), None);
    }

    fn signal(child: &Child, signal: Signal) {
        let pid = i32::try_from(child.id()).ok().and_then(Pid::from_raw);
        kill_process(pid.expect("a process"), signal).expect("a signal");
    }

    fn becomes(child: &Child, hold: Option<Hold>) {
        let start = Instant::now();
        while hold_of(child.id()) != hold {
            assert!(start.elapsed() < Duration::from_secs(10), "{hold:?}");
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    #[test]
    fn a_stopped_process_is_seen_until_it_goes_on() {
        let mut child = Command::new("sleep").arg("60").spawn().expect("sleep");
        becomes(&child, None);
        signal(&child, Signal::STOP);
        becomes(&child, Some(Hold::Stopped));
        signal(&child, Signal::CONT);
        becomes(&child, None);
        child.kill().expect("it ends");
        child.wait().expect("it has ended");
        assert_eq!(hold_of(child.id()), None);
    }
}
