//! Broken bodies' sides, one for each clause.

mod books;
mod force;
mod order;
mod session;
mod spoil;
mod time;

use super::Mutant;

/// All of them.
pub fn mutants() -> impl Iterator<Item = &'static Mutant> {
    [
        session::MUTANTS,
        order::MUTANTS,
        time::MUTANTS,
        force::MUTANTS,
        books::MUTANTS,
    ]
    .into_iter()
    .flatten()
}
