//! A solver that breaks one clause on purpose, to see what a failing verdict looks like before there is a solver of your own.
//! Without arguments it lists the mutants; the kit starts it as it starts any solver:
//!
//! ```text
//! cargo build --release --examples
//! tandem conformance --dem "target/release/examples/mutant F-7"
//! tandem conformance --mpm "target/release/examples/mutant T-1c/2"     # the second mutant of a clause
//! ```

use std::process::ExitCode;

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    ExitCode::from(mutant::run(&words))
}
