//! Flags that signals set.

use std::io;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use coupler::record::summary::Status;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXCPU};
use signal_hook::flag;

/// A flag that ends a run in order: set by Ctrl-C and SIGTERM, of which the second does not wait for that, by the end of
/// the terminal (SIGHUP), and by a queue's warning (SIGXCPU).
pub fn interrupt() -> Result<Arc<AtomicBool>, String> {
    let interrupt = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        let code = i32::from(Status::Interrupted.exit_code());
        flag::register_conditional_shutdown(signal, code, interrupt.clone()).map_err(no_signals)?;
    }
    for signal in [SIGINT, SIGTERM, SIGHUP, SIGXCPU] {
        flag::register(signal, interrupt.clone()).map_err(no_signals)?;
    }
    Ok(interrupt)
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
