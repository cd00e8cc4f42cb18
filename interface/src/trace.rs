//! A timeline of a run's processes (`tandem run --trace`), as the trace events in JSON that Perfetto and Chrome show.
//!
//! All parties add events to one file. Lines are written whole, so those of several processes may come in any order.

use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, Write as _};
use std::path::Path;
use std::time::{Duration, Instant};

use rustix::time::{ClockId, clock_gettime};

use crate::files;
use crate::message::control::Party;
use crate::transport::domain::Domain;

/// Bytes that are written together.
const TOGETHER: usize = 1 << 16;

/// Makes the file, for a run whose parties then find it by its domain.
///
/// # Errors
/// Those of the system.
pub fn begin(path: &Path) -> io::Result<()> {
    files::write_named(path, "[{}\n")
}

/// Ends it, once all parties have ended.
///
/// # Errors
/// Those of the system.
pub fn end(path: &Path) -> io::Result<()> {
    files::append_named(path)?.write_all(b"]\n")
}

/// The events of one party.
#[derive(Debug)]
pub(crate) struct Trace {
    file: File,
    lines: String,
    /// Number of the party in the file.
    process: usize,
    /// An instant, and what the clock that all processes share had then.
    zero: (Instant, Duration),
}

impl Trace {
    /// For this party of the run, if its coupler wants a timeline.
    pub(crate) fn of(domain: &Domain, party: Party) -> Option<Self> {
        let path = domain.trace()?;
        let file = files::append_named(&path)
            .inspect_err(|e| tracing::warn!("no events of the {party} in {}: {e}", path.display()))
            .ok()?;
        let t = clock_gettime(ClockId::Monotonic);
        let zero = Duration::new(t.tv_sec.cast_unsigned(), t.tv_nsec.cast_unsigned() as u32);
        let mut trace = Self {
            file,
            lines: String::new(),
            process: party as usize,
            zero: (Instant::now(), zero),
        };
        let name = format!(r#""name":"process_name","ph":"M","args":{{"name":"{party}"}}"#);
        trace.add(&name);
        Some(trace)
    }

    /// The party has done this in this step.
    pub(crate) fn span(&mut self, what: &str, step: u64, [from, to]: [Instant; 2]) {
        let length = to.duration_since(from).as_nanos() as f64 * 1e-3;
        let from = self.microseconds(from);
        self.add(&format!(
            r#""name":"{what}","ph":"X","ts":{from:.3},"dur":{length:.3},"args":{{"step":{step}}}"#
        ));
    }

    /// This begins now.
    pub(crate) fn mark(&mut self, what: &str, step: u64) {
        let now = self.microseconds(Instant::now());
        self.add(&format!(
            r#""name":"{what}","ph":"i","s":"t","ts":{now:.3},"args":{{"step":{step}}}"#
        ));
    }

    fn microseconds(&self, at: Instant) -> f64 {
        let (instant, zero) = self.zero;
        (zero + at.saturating_duration_since(instant)).as_nanos() as f64 * 1e-3
    }

    fn add(&mut self, event: &str) {
        let _ = writeln!(
            self.lines,
            r#",{{{event},"pid":{0},"tid":{0}}}"#,
            self.process
        );
        if self.lines.len() >= TOGETHER {
            self.write();
        }
    }

    fn write(&mut self) {
        if let Err(e) = self.file.write_all(self.lines.as_bytes()) {
            tracing::warn!("events of the timeline are lost: {e}");
        }
        self.lines.clear();
    }
}

impl Drop for Trace {
    fn drop(&mut self) {
        self.write();
    }
}
