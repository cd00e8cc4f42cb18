//! The clauses of a continuum.

mod end;
mod exchange;
mod force;
mod halt;
mod handshake;
mod imps;
mod ledger;
mod limits;
mod machine;
mod order;
mod scene;
mod time;

use super::Clause;

/// All of them, in order.
pub fn clauses() -> impl Iterator<Item = &'static Clause> {
    [
        handshake::CLAUSES,
        order::CLAUSES,
        exchange::CLAUSES,
        imps::CLAUSES,
        time::CLAUSES,
        force::CLAUSES,
        limits::CLAUSES,
        halt::CLAUSES,
        ledger::CLAUSES,
        machine::CLAUSES,
        end::CLAUSES,
    ]
    .into_iter()
    .flatten()
}
