//! What signals ask for.

#![allow(clippy::disallowed_methods, reason = "/proc")]

use std::fs;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use coupler::record::summary::Status;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXCPU};
use signal_hook::iterator::Signals;
use signal_hook::{flag, low_level};

/// Time for a run that was asked to end at once to remove what is its own.
const REMOVING: Duration = Duration::from_secs(5);

/// What signals have asked of this process.
#[derive(Debug, Default, Clone)]
pub struct Asked {
    /// To end in order: by Ctrl-C and SIGTERM, by the end of the terminal (SIGHUP), and by a queue's warning (SIGXCPU).
    pub to_end: Arc<AtomicBool>,
    /// Not to wait for anybody any more: by a second Ctrl-C or SIGTERM.
    pub at_once: Arc<AtomicBool>,
}

/// Listens for signals. A second Ctrl-C or SIGTERM ends the process, unless it `cleans_up`: then it has some seconds for that, and
/// one after that ends it.
pub fn interrupt(cleans_up: bool) -> Result<Asked, String> {
    let asked = Asked::default();
    // What is ignored stays so: `nohup` wants no SIGHUP, and a shell's job in the background no Ctrl-C.
    let ignored = ignored();
    let listened = [SIGINT, SIGTERM, SIGHUP, SIGXCPU].into_iter();
    let listened = listened.filter(|signal| ignored >> (signal - 1) & 1 == 0);
    let mut signals = Signals::new(listened).map_err(no_signals)?;
    let heard = asked.clone();
    thread::spawn(move || {
        let mut hurried: Option<Instant> = None;
        for signal in signals.forever() {
            let again = heard.to_end.swap(true, Ordering::Relaxed);
            if !again || ![SIGINT, SIGTERM].contains(&signal) {
                continue;
            }
            match hurried {
                None if cleans_up => {
                    heard.at_once.store(true, Ordering::Relaxed);
                    hurried = Some(Instant::now());
                }
                Some(since) if since.elapsed() < REMOVING => {}
                _ => low_level::exit(Status::Interrupted.exit_code().into()),
            }
        }
    });
    Ok(asked)
}

/// The signals that this process ignores, a bit for each from signal 1 on.
fn ignored() -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok())
        .unwrap_or(0)
}

/// A flag that this signal sets.
pub fn on_signal(signal: i32) -> Result<Arc<AtomicBool>, String> {
    let set = Arc::new(AtomicBool::new(false));
    flag::register(signal, set.clone()).map_err(no_signals)?;
    Ok(set)
}

/// From now on this signal ends nothing.
pub fn ignore(signal: i32) -> Result<(), String> {
    on_signal(signal).map(drop)
}

#[expect(clippy::needless_pass_by_value, reason = "the shape of `map_err`")]
fn no_signals(error: io::Error) -> String {
    format!("cannot handle signals: {error}")
}
