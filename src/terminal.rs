//! Output to a terminal, or into a pipe whose other end may have gone (`| head`): then nobody listens, which is no
//! error, and the exit status is that of the command. `println!` would panic. What cannot be written for another reason,
//! such as a full disk, is one: [`settled`].

#![allow(
    clippy::needless_pass_by_value,
    reason = "all output of the program goes through here"
)]

use std::fmt::Display;
use std::io::{self, ErrorKind, Write, stderr, stdout};
use std::process::ExitCode;
use std::sync::OnceLock;
use std::time::Duration;

use console::AnsiCodeIterator;
use coupler::record::screen::Screen;
use coupler::record::summary::Status;
use interface::text;

/// Why a text did not get to standard output.
static UNSAID: OnceLock<io::Error> = OnceLock::new();

/// A line on standard output.
pub fn say(line: impl Display) {
    let mut stdout = stdout().lock();
    let written = writeln!(stdout, "{}", shown(&line.to_string())).and_then(|()| stdout.flush());
    if let Err(error) = written
        && error.kind() != ErrorKind::BrokenPipe
    {
        let _ = UNSAID.set(error);
    }
}

/// A text without what a terminal would obey, but for the colours that we give it.
fn shown(text: &str) -> String {
    let is_colour = |code: &str| {
        let numbers = code
            .strip_prefix("\u{1b}[")
            .and_then(|code| code.strip_suffix('m'));
        numbers.is_some_and(|numbers| numbers.bytes().all(|b| b.is_ascii_digit() || b == b';'))
    };
    let parts = AnsiCodeIterator::new(text);
    let shown = parts.map(|(part, is_code)| match part {
        colour if is_code && is_colour(colour) => colour.into(),
        other => text::lines(other),
    });
    shown.collect()
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
    let line = format!("{}\n", shown(&line.to_string()));
    match SCREEN.get() {
        Some(screen) => screen.text(line.as_bytes()),
        None => drop(stderr().write_all(line.as_bytes())),
    }
}

/// The exit status of a command that has ended with `code`: its output may not have been written.
pub fn settled(code: ExitCode) -> ExitCode {
    let code = or_write_error(code);
    if let Some(screen) = SCREEN.get() {
        screen.finish(UNREAD);
    }
    code
}

fn or_write_error(code: ExitCode) -> ExitCode {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_terminal_obeys_nothing_but_colours() {
        let painted = "\u{1b}[1;31mFAIL\u{1b}[0m a\tb\nc";
        assert_eq!(shown(painted), painted);
        assert_eq!(
            shown("\u{1b}[2J\u{1b}]0;x\u{7}"),
            "\\u{1b}[2J\\u{1b}]0;x\\u{7}"
        );
        assert_eq!(shown("\u{1b}["), "\\u{1b}[");
    }
}
