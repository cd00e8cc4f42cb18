//! What is said on a terminal, or into a pipe whose other end may have gone (`| head`): then nobody listens, which is no
//! error, and the exit status still tells how it went. `println!` would panic.

#![allow(
    clippy::needless_pass_by_value,
    reason = "what is said is made to be said"
)]

use std::fmt::Display;
use std::io::{Write, stderr, stdout};

/// A line on standard output.
pub fn say(line: impl Display) {
    writeln!(stdout(), "{line}").ok();
}

/// A line on standard error.
pub fn complain(line: impl Display) {
    writeln!(stderr(), "{line}").ok();
}
