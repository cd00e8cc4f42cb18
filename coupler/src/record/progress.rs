//! What a user sees of a run while it goes on: a bar on a terminal, lines of log elsewhere.

use std::io::{IsTerminal, stderr};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::screen::Screen;

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
    /// Hidden where there is no terminal; it also estimates the time left.
    bar: ProgressBar,
    /// Where the bar is drawn, if it is.
    screen: Option<Screen>,
    /// When this process took its first step, and which it was.
    begun: Option<(Instant, u64)>,
    end: f64,
    shown: Instant,
}

/// The bar counts simulated time in this many parts.
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
            bar: bar(screen.is_some()),
            screen,
            begun: None,
            end,
            shown: now,
        }
    }

    /// Shows where the run stands.
    pub fn show(&mut self, state: &State) {
        let every = if self.screen.is_some() {
            DRAW_EVERY
        } else {
            LOG_EVERY
        };
        let now = Instant::now();
        let position = (PARTS * state.time / self.end) as u64;
        let &mut (begun, first) = self.begun.get_or_insert_with(|| {
            // A run that goes on has steps behind it that this process has not taken.
            self.bar.set_position(position);
            self.bar.reset_eta();
            (now, state.step)
        });
        if now.duration_since(self.shown) < every {
            return;
        }
        self.shown = now;
        let took = now.duration_since(begun).as_secs_f64();
        let rate = state.step.saturating_sub(first) as f64 / took.max(f64::MIN_POSITIVE);
        let State {
            step,
            time,
            dt,
            bound,
        } = *state;
        let bar = self.bar.clone();
        let Some(screen) = &self.screen else {
            bar.set_position(position);
            tracing::info!(
                step,
                time,
                dt,
                bound,
                end = self.end,
                steps_per_s = rate.round(),
                left_s = bar.eta().as_secs(),
                "progress"
            );
            return;
        };
        let message =
            format!("step {step}  t {time:.4e} s  dt {dt:.2e} s ({bound})  {rate:.0} steps/s");
        // Where there is no room the next one is newer.
        let _ = screen.draw(Box::new(move || {
            bar.set_position(position);
            bar.set_message(message);
        }));
    }

    /// Takes the bar away.
    pub fn finish(&mut self) {
        let bar = self.bar.clone();
        if let Some(screen) = self.screen.take()
            && let Some(unseen) = screen.draw(Box::new(move || bar.finish_and_clear()))
        {
            // A bar draws when it is dropped, and this thread waits for no terminal.
            std::mem::forget(unseen);
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.finish();
    }
}

fn bar(drawn: bool) -> ProgressBar {
    let target = if drawn {
        ProgressDrawTarget::stderr_with_hz(8)
    } else {
        ProgressDrawTarget::hidden()
    };
    let bar = ProgressBar::with_draw_target(Some(PARTS as u64), target);
    let style = "{bar:30.cyan/dim} {percent:>3} %  {msg}  left {eta}";
    bar.set_style(ProgressStyle::with_template(style).expect("a valid template"));
    bar
}
