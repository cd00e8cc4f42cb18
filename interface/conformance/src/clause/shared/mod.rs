//! What both sides are asked in the same way: the session, grants, endings, and what a run takes of the machine.

mod endings;
mod grants;
mod halt;
mod handshake;
mod machine;
mod run;
mod saved;

pub use halt::below_the_sum;
pub use run::{names, refuses, rejects};

use super::row::Clause;

/// All of them, in order.
pub const CLAUSES: &[&[Clause]] = &[
    handshake::CLAUSES,
    grants::CLAUSES,
    endings::CLAUSES,
    machine::CLAUSES,
    saved::CLAUSES,
    halt::CLAUSES,
];
