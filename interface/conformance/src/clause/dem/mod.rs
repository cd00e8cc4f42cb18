//! The clauses of a bodies' side.

mod bodies;
mod books;
mod endings;
mod force;
mod friction;
mod handshake;
mod limits;
mod machine;
mod motion;
mod order;
mod scene;
mod time;

use super::Clause;

/// All of them, in order.
pub fn clauses() -> impl Iterator<Item = &'static Clause> {
    [
        handshake::CLAUSES,
        endings::CLAUSES,
        order::CLAUSES,
        time::CLAUSES,
        bodies::CLAUSES,
        force::CLAUSES,
        friction::CLAUSES,
        motion::CLAUSES,
        limits::CLAUSES,
        books::CLAUSES,
        machine::CLAUSES,
        time::OPENING,
    ]
    .into_iter()
    .flatten()
}
