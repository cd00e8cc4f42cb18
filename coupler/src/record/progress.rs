//! What a user sees of a run while it goes on: a bar on a terminal, lines of log elsewhere.

use std::io::{IsTerminal, stderr};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Where the run stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    /// Steps done.
    pub step: u64,
    /// Simulated time in s.
    pub time: f64,
    /// Step in s.
    pub dt: f64,
    /// What binds it.
    pub bound: &'static str,
}

/// Progress of a run towards its end.
#[derive(Debug)]
pub struct Progress {
    bar: Option<ProgressBar>,
    end: f64,
    started: Instant,
    logged: Instant,
}

/// The bar counts simulated time in this many parts.
const PARTS: f64 = 10_000.0;
/// Time between lines of log where there is no bar.
const LOG_EVERY: Duration = Duration::from_secs(5);

impl Progress {
    /// A bar on standard error if `wanted` and standard error is a terminal.
    pub fn new(end: f64, wanted: bool) -> Self {
        let bar = (wanted && stderr().is_terminal()).then(|| {
            let bar = ProgressBar::with_draw_target(
                Some(PARTS as u64),
                ProgressDrawTarget::stderr_with_hz(8),
            );
            let style =
                ProgressStyle::with_template("{bar:30.cyan/dim} {percent:>3} %  {msg}  left {eta}")
                    .expect("a valid template");
            bar.set_style(style);
            bar
        });
        let now = Instant::now();
        Self {
            bar,
            end,
            started: now,
            logged: now,
        }
    }

    /// Shows where the run stands.
    pub fn show(&mut self, state: &State) {
        let rate = state.step as f64 / self.started.elapsed().as_secs_f64();
        if let Some(bar) = &self.bar {
            bar.set_position((PARTS * state.time / self.end) as u64);
            let State {
                step,
                time,
                dt,
                bound,
            } = state;
            bar.set_message(format!(
                "step {step}  t {time:.4e} s  dt {dt:.2e} s ({bound})  {rate:.0} steps/s"
            ));
        } else if self.logged.elapsed() >= LOG_EVERY {
            self.logged = Instant::now();
            let State {
                step,
                time,
                dt,
                bound,
            } = *state;
            tracing::info!(
                step,
                time,
                dt,
                bound,
                end = self.end,
                steps_per_s = rate.round(),
                "progress"
            );
        }
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
