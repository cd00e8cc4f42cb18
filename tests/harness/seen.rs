//! What processes take, without what other programs take from them: so that no test fails on a machine that does much else.

use std::collections::BTreeMap;
use std::fs;
use std::time::{Duration, Instant};

use super::children;

/// Time between two looks.
const LOOK: Duration = Duration::from_millis(10);

/// What was seen of processes and of those that they have started.
pub struct Seen {
    /// The largest memory of each in KiB.
    memory: BTreeMap<u32, u64>,
    /// The CPU time of each thread.
    used: BTreeMap<String, Duration>,
    looked: Instant,
    took: Duration,
}

impl Seen {
    /// Nothing yet.
    pub fn begin() -> Self {
        Self {
            memory: BTreeMap::new(),
            used: BTreeMap::new(),
            looked: Instant::now(),
            took: Duration::ZERO,
        }
    }

    /// Time in which every thread waited, but not for a processor, and CPU time of the busiest.
    pub fn took(&self) -> Duration {
        self.took
    }

    /// The same since an earlier look.
    pub fn since(&self, earlier: Duration) -> Duration {
        self.took.saturating_sub(earlier)
    }

    /// The largest memory of all in KiB.
    pub fn memory(&self) -> u64 {
        self.memory.values().sum()
    }

    /// Looks at these processes, if it is time to.
    pub fn look(&mut self, pids: impl IntoIterator<Item = u32>) {
        let since = self.looked.elapsed();
        if since < LOOK {
            return;
        }
        self.looked += since;
        let (mut waits, mut used) = (true, Duration::ZERO);
        for pid in pids {
            let (this_waits, this_used) = self.look_at(pid);
            (waits, used) = (waits && this_waits, used.max(this_used));
        }
        self.took += if waits { since.max(used) } else { used };
    }

    /// Whether every thread waits, and the most CPU time of one since the last look.
    fn look_at(&mut self, pid: u32) -> (bool, Duration) {
        let read = |path: String| fs::read_to_string(path).unwrap_or_default();
        let status = read(format!("/proc/{pid}/status"));
        let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let most = line.and_then(|line| line.split_whitespace().next()?.parse().ok());
        let known = self.memory.entry(pid).or_default();
        *known = most.unwrap_or(0).max(*known);
        let mut seen = (true, Duration::ZERO);
        let threads = fs::read_dir(format!("/proc/{pid}/task"));
        for thread in threads.into_iter().flatten().flatten() {
            let thread = thread.path().display().to_string();
            seen.0 &= !read(format!("{thread}/stat")).contains(") R ");
            let times = read(format!("{thread}/schedstat"));
            let used = times.split_whitespace().next().map(str::parse);
            if let Some(Ok(used)) = used {
                let used = Duration::from_nanos(used);
                let before = self.used.insert(thread, used).unwrap_or_default();
                seen.1 = seen.1.max(used.saturating_sub(before));
            }
        }
        for child in children(pid) {
            let (waits, used) = self.look_at(child);
            seen = (seen.0 && waits, seen.1.max(used));
        }
        seen
    }
}
