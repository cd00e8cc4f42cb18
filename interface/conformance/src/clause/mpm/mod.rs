//! The clauses of a continuum, besides those of both sides.

mod end;
mod exchange;
mod force;
mod halt;
mod handshake;
mod imps;
mod ledger;
mod limits;
pub(super) mod scene;
mod time;

use super::Clause;

/// All of them, in order.
pub const CLAUSES: &[&[Clause]] = &[
    handshake::CLAUSES,
    exchange::CLAUSES,
    &[super::shared::naps(&["G-10a"])],
    imps::CLAUSES,
    time::CLAUSES,
    force::CLAUSES,
    limits::CLAUSES,
    halt::CLAUSES,
    ledger::CLAUSES,
    end::CLAUSES,
];
