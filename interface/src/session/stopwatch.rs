//! Measures a party's time: computing, copying to and from the channels, waiting.

use std::time::{Duration, Instant};

use rustix::time::{ClockId, clock_gettime};

use crate::message::wire::Report;
use crate::trace::Trace;

/// Whose CPU time a report has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Clocked {
    /// The process: it runs only the solver.
    Process,
    /// Nobody's: all parties share a thread, and the caller that lets them take turns measures their time.
    Shared,
}

/// What the time since the last lap was spent on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Activity {
    Compute,
    Exchange,
    Wait,
}

#[derive(Debug)]
pub(crate) struct Stopwatch {
    clocked: Clocked,
    /// When the present lap began; `None` if somebody else measures.
    mark: Option<Instant>,
    compute_ns: u64,
    exchange_ns: u64,
    wait_ns: u64,
    /// Of the computing time that somebody else has measured, what the thread did not run in.
    idle_ns: u64,
    pub(crate) trace: Option<Trace>,
}

impl Stopwatch {
    /// Starts.
    pub(crate) fn start(clocked: Clocked) -> Self {
        Self {
            clocked,
            mark: (clocked != Clocked::Shared).then(Instant::now),
            compute_ns: 0,
            exchange_ns: 0,
            wait_ns: 0,
            idle_ns: 0,
            trace: None,
        }
    }

    /// From now on every lap is an event of a timeline.
    pub(crate) fn trace(&mut self, trace: Trace) {
        self.mark = Some(Instant::now());
        self.trace = Some(trace);
    }

    /// Adds the time since the last lap to `activity`, in this step.
    pub(crate) fn lap(&mut self, activity: Activity, step: u64) {
        let Some(mark) = &mut self.mark else {
            return;
        };
        let now = Instant::now();
        let spent = now.duration_since(*mark).as_nanos() as u64;
        let from = std::mem::replace(mark, now);
        let (sum, name) = match activity {
            Activity::Compute => (&mut self.compute_ns, "compute"),
            Activity::Exchange => (&mut self.exchange_ns, "exchange"),
            Activity::Wait => (&mut self.wait_ns, "wait"),
        };
        *sum += spent;
        if let Some(trace) = &mut self.trace {
            trace.span(name, step, [from, now]);
        }
    }

    /// Adds computing time that somebody else has measured.
    pub(crate) fn book(&mut self, computed: Duration) {
        self.compute_ns += computed.as_nanos() as u64;
    }

    /// The thread did not run in this much of the computing time: the processor had other programs to run.
    pub(crate) fn idle(&mut self, idle: Duration) {
        self.idle_ns += idle.as_nanos() as u64;
    }

    /// Writes the times so far into a report.
    pub(crate) fn write(&self, report: &mut Report) {
        report.compute_ns = self.compute_ns;
        report.exchange_ns = self.exchange_ns;
        report.wait_ns = self.wait_ns;
        report.cpu_ns = match self.clocked {
            Clocked::Process => cpu_ns(ClockId::ProcessCPUTime),
            Clocked::Shared => self.compute_ns.saturating_sub(self.idle_ns),
        };
    }
}

/// CPU time of the calling thread, which is the coupler's.
pub fn cpu_time() -> std::time::Duration {
    std::time::Duration::from_nanos(cpu_ns(ClockId::ThreadCPUTime))
}

/// CPU time in ns of this process or thread.
fn cpu_ns(of: ClockId) -> u64 {
    let t = clock_gettime(of);
    t.tv_sec as u64 * 1_000_000_000 + t.tv_nsec as u64
}
