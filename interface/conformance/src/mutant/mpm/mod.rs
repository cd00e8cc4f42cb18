//! Broken continua, one for each clause.

mod books;
mod exchange;
mod motion;
mod session;
mod spoil;

use super::Mutant;

/// All of them.
pub fn mutants() -> impl Iterator<Item = &'static Mutant> {
    [
        session::MUTANTS,
        exchange::MUTANTS,
        motion::MUTANTS,
        books::MUTANTS,
    ]
    .into_iter()
    .flatten()
}
