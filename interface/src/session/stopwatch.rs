//! Measures a party's time: computing, copying to and from the channels, waiting.

use std::time::Instant;

use rustix::time::{ClockId, clock_gettime};

/// What the time since the last lap was spent on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Activity {
    Compute,
    Exchange,
    Wait,
}

#[derive(Debug)]
pub(crate) struct Stopwatch {
    /// When the present lap began; `None` if somebody else measures.
    mark: Option<Instant>,
    pub(crate) compute_ns: u64,
    pub(crate) exchange_ns: u64,
    pub(crate) wait_ns: u64,
}

impl Stopwatch {
    /// Starts. With `runs` it measures by itself.
    pub(crate) fn start(runs: bool) -> Self {
        Self {
            mark: runs.then(Instant::now),
            compute_ns: 0,
            exchange_ns: 0,
            wait_ns: 0,
        }
    }

    /// Adds the time since the last lap to `activity`.
    pub(crate) fn lap(&mut self, activity: Activity) {
        let Some(mark) = &mut self.mark else {
            return;
        };
        let now = Instant::now();
        let spent = now.duration_since(*mark).as_nanos() as u64;
        *mark = now;
        match activity {
            Activity::Compute => self.compute_ns += spent,
            Activity::Exchange => self.exchange_ns += spent,
            Activity::Wait => self.wait_ns += spent,
        }
    }
}

/// CPU time of the calling thread, which is the coupler's.
pub fn cpu_time() -> std::time::Duration {
    std::time::Duration::from_nanos(cpu_ns(false))
}

/// CPU time in ns of this party: that of its process, or that of its thread, which leaves out the threads of a solver's
/// pool.
pub(crate) fn cpu_ns(whole_process: bool) -> u64 {
    let clock = if whole_process {
        ClockId::ProcessCPUTime
    } else {
        ClockId::ThreadCPUTime
    };
    let t = clock_gettime(clock);
    t.tv_sec as u64 * 1_000_000_000 + t.tv_nsec as u64
}
