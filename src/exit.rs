//! Exit statuses of `tandem` besides 0 (README.md has the table).

use std::fmt::Display;
use std::process::ExitCode;

use study::StudyError;

use crate::terminal::complain;

/// Bad input: arguments, a scene, a file that cannot be read.
pub const BAD_INPUT: u8 = 2;
/// A solver, or this program itself, has failed.
pub const FAILED: u8 = 3;

/// Why a command has failed, in words for people, and its exit status.
#[derive(Debug)]
pub struct Failed(String, u8);

impl Failed {
    /// An error that ends the command with this status.
    pub fn new(error: impl Display, status: u8) -> Self {
        Self(format!("error: {error}"), status)
    }

    /// Says it; returns the exit status.
    pub fn say(&self) -> ExitCode {
        complain(&self.0);
        ExitCode::from(self.1)
    }
}

/// Bad input, in words that are whole.
impl From<String> for Failed {
    fn from(words: String) -> Self {
        Self(words, BAD_INPUT)
    }
}

impl From<StudyError> for Failed {
    fn from(error: StudyError) -> Self {
        Self(error.to_string().trim_end().to_owned(), error.exit_code())
    }
}

/// The error of bad input.
pub fn bad_input(error: impl Display) -> Failed {
    Failed::new(error, BAD_INPUT)
}
