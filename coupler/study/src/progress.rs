//! How many runs have ended: one line on a terminal, a line of log now and then elsewhere.

use std::io::{IsTerminal, stderr};
use std::time::{Duration, Instant};

use coupler::record::Summary;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Time between lines of log where there is no terminal.
const LOG_EVERY: Duration = Duration::from_secs(10);

/// The progress of a list of runs.
pub(crate) struct Progress {
    /// Hidden if there is no terminal.
    bar: ProgressBar,
    shown: Instant,
}

impl Progress {
    pub fn new(runs: usize) -> Self {
        let target = if stderr().is_terminal() {
            ProgressDrawTarget::stderr_with_hz(4)
        } else {
            ProgressDrawTarget::hidden()
        };
        let style = ProgressStyle::with_template("{bar:30} {pos} of {len} runs{msg}, {eta} to go");
        Self {
            bar: ProgressBar::with_draw_target(Some(runs as u64), target)
                .with_style(style.expect("a template")),
            shown: Instant::now(),
        }
    }

    pub fn show(&mut self, found: &[Option<Summary>]) {
        let ended = found.iter().flatten();
        let failed = ended.clone().filter(|run| !run.settled()).count();
        let failed = match failed {
            0 => String::new(),
            some => format!(", {some} failed"),
        };
        let ended = ended.count();
        if !self.bar.is_hidden() {
            self.bar.set_message(failed);
            self.bar.set_position(ended as u64);
        } else if self.shown.elapsed() > LOG_EVERY {
            tracing::info!("{ended} of {} runs{failed}", found.len());
            self.shown = Instant::now();
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
