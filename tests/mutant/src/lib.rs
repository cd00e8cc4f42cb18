//! Mutants: solvers that are right but for one rule, to prove that each clause of the conformance kit can fail. They are
//! for tests: `tests/mutants.rs` asks that the kit finds the clause of each broken and no other.
//!
//! A mutant is the built-in solver that talks through a transport of its own. That passes every message on as it is, but
//! for what is [`Wrong`].
//!
//! # How to add a mutant
//!
//! Add a row to the table of its side (`table/`), below the id of its clause:
//! `- "does not report ...": Flaw::report(|report| report.halted = 0);`. [`conformance::Flaw`] and [`change`] have one
//! constructor for each thing that can be changed, [`Wrong::process`] what a process does besides its messages. Then
//! `tandem conformance --dem "target/release/examples/mutant H-1c"` shows it. A second mutant of a clause is called `H-1c/2`.
#![forbid(unsafe_code)]
#![expect(
    clippy::needless_for_each,
    reason = "what a mutant does wrong stands in one line"
)]

pub mod change;
mod process;
mod table;
mod transport;
mod wrong;

pub use process::{built_in, run, serve};
pub use table::{Mutant, of};
pub use transport::Flawed;
pub use wrong::{ProcessFlaws, Wrong, nothing};
