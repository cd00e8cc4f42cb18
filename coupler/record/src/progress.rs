//! Shows the progress of a run: a bar on a terminal, lines of log elsewhere.

use std::io::{IsTerminal, stderr};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::screen::Screen;

/// Progress of a run towards its end.
#[derive(Debug)]
pub struct Progress {
    /// Hidden if there is no terminal; it also estimates the remaining time.
    bar: ProgressBar,
    /// Where the bar is drawn, if there is one.
    screen: Option<Screen>,
    /// Time at which this process did its first step, and the number of that step.
    begun: Option<(Instant, u64)>,
    end: f64,
    shown: Instant,
}

/// Number of parts into which the bar divides simulated time.
const PARTS: f64 = 1e6;
/// Time between two states of the bar.
const DRAW_EVERY: Duration = Duration::from_millis(125);
/// Time between lines of log where there is no bar.
const LOG_EVERY: Duration = Duration::from_secs(5);

impl Progress {
    /// A bar on the screen if it is `wanted` and standard error is a terminal.
    pub fn new(end: f64, wanted: bool, screen: Option<Screen>) -> Self {
        let screen = screen.filter(|_| wanted && stderr().is_terminal());
        let now = Instant::now();
        Self {
            bar: bar(match screen {
                Some(_) => ProgressDrawTarget::stderr_with_hz(8),
                None => ProgressDrawTarget::hidden(),
            }),
            screen,
            begun: None,
            end,
            shown: now,
        }
    }

    /// Shows the progress of the run: steps done, simulated time in s, the step in s and the limit that determines it.
    pub fn show(&mut self, step: u64, time: f64, dt: f64, bound: &'static str) {
        let every = if self.screen.is_some() {
            DRAW_EVERY
        } else {
            LOG_EVERY
        };
        let now = Instant::now();
        let position = (PARTS * time / self.end) as u64;
        let (begun, first) = self.begun.unwrap_or_else(|| {
            // A continued run has steps that this process has not computed.
            self.at_bar(move |bar| {
                bar.set_position(position);
                bar.reset_eta();
            });
            (now, step)
        });
        self.begun = Some((begun, first));
        if now.duration_since(self.shown) < every {
            return;
        }
        self.shown = now;
        let took = now.duration_since(begun).as_secs_f64();
        let rate = step.saturating_sub(first) as f64 / took.max(f64::MIN_POSITIVE);
        if self.screen.is_none() {
            self.bar.set_position(position);
            tracing::info!(
                step,
                time,
                dt,
                bound,
                end = self.end,
                steps_per_s = rate.round(),
                left_s = self.bar.eta().as_secs(),
                "progress"
            );
            return;
        }
        let message =
            format!("step {step}  t {time:.4e} s  dt {dt:.2e} s ({bound})  {rate:.0} steps/s");
        self.at_bar(move |bar| {
            bar.set_position(position);
            bar.set_message(message);
        });
    }

    /// Calls `act` with the bar, on the screen's thread if the bar is drawn there, because the run must not wait for a
    /// terminal. If the queue is full, the call is left out: the next one shows a newer state.
    fn at_bar(&self, act: impl FnOnce(&ProgressBar) + Send + 'static) {
        let bar = self.bar.clone();
        match &self.screen {
            Some(screen) => drop(screen.draw(Box::new(move |_| act(&bar)))),
            None => act(&bar),
        }
    }

    /// Removes the bar.
    pub fn finish(&mut self) {
        let bar = self.bar.clone();
        if let Some(screen) = self.screen.take()
            && let Some(unseen) = screen.draw(Box::new(move |_| bar.finish_and_clear()))
        {
            // A bar draws when it is dropped, and this thread must not wait for a terminal.
            std::mem::forget(unseen);
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.finish();
    }
}

fn bar(target: ProgressDrawTarget) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(PARTS as u64), target);
    let style = "{bar:30.cyan/dim} {percent:>3} %  {msg}  left {eta}";
    bar.set_style(ProgressStyle::with_template(style).expect("a valid template"));
    bar
}
