//! Exit statuses of `tandem` besides 0 (README.md has the table).

use std::fmt::Display;
use std::process::ExitCode;

use crate::terminal::complain;

/// Bad input: arguments, a scene, a file that cannot be read.
pub const BAD_INPUT: u8 = 2;
/// A solver, or this program itself, has failed.
pub const FAILED: u8 = 3;

/// Says why a command fails, and with which status.
pub fn fail(error: impl Display, status: u8) -> ExitCode {
    complain(format_args!("error: {error}"));
    ExitCode::from(status)
}
