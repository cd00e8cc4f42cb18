//! What is said on a terminal, or into a pipe whose other end may have gone (`| head`): then nobody listens, which is no
//! error, and the exit status still tells how it went. `println!` would panic. What cannot be written for another reason,
//! such as a full disk, is one: [`settled`].

#![allow(
    clippy::needless_pass_by_value,
    reason = "what is said is made to be said"
)]

use std::fmt::Display;
use std::io::{self, ErrorKind, Write, stderr, stdout};
use std::process::ExitCode;
use std::sync::OnceLock;
use std::time::Duration;

use coupler::record::screen::Screen;
use coupler::record::summary::Status;

/// Why something that was said on standard output did not get there.
static UNSAID: OnceLock<io::Error> = OnceLock::new();

/// A line on standard output.
pub fn say(line: impl Display) {
    let mut stdout = stdout().lock();
    let said = writeln!(stdout, "{line}").and_then(|()| stdout.flush());
    if let Err(error) = said
        && error.kind() != ErrorKind::BrokenPipe
    {
        let _ = UNSAID.set(error);
    }
}

/// What shows standard error while a run goes on.
static SCREEN: OnceLock<Screen> = OnceLock::new();
/// Longest time that nothing is read of standard error before the rest is left unsaid.
const UNREAD: Duration = Duration::from_secs(2);

/// From the first call on, standard error is written by a thread of its own.
pub fn screen() -> &'static Screen {
    SCREEN.get_or_init(Screen::begin)
}

/// A line on standard error.
pub fn complain(line: impl Display) {
    match SCREEN.get() {
        Some(screen) => screen.text(format!("{line}\n").as_bytes()),
        None => drop(writeln!(stderr(), "{line}")),
    }
}

/// The exit status of a command that has ended with `code`: what it said may not have been written.
pub fn settled(code: ExitCode) -> ExitCode {
    let code = told(code);
    if let Some(screen) = SCREEN.get() {
        screen.finish(UNREAD);
    }
    code
}

fn told(code: ExitCode) -> ExitCode {
    let Some(error) = UNSAID.get() else {
        return code;
    };
    complain(format_args!(
        "error: cannot write to standard output: {error}"
    ));
    if code == ExitCode::SUCCESS {
        ExitCode::from(Status::Failed.exit_code())
    } else {
        code
    }
}
