//! The clauses of a continuum, besides those of both sides.

mod end;
mod exchange;
mod force;
mod halt;
mod handshake;
mod imps;
mod layers;
mod ledger;
mod limits;
mod plastic;
pub(super) mod scene;
mod time;

use super::row::Clause;
use super::shared::{looked_at, naps, resumed};

/// All of them, in order.
pub const CLAUSES: &[&[Clause]] = &[
    handshake::CLAUSES,
    exchange::CLAUSES,
    &[naps(&["S-7a", "G-10a", "E-2b"])],
    imps::CLAUSES,
    time::CLAUSES,
    layers::CLAUSES,
    force::CLAUSES,
    limits::CLAUSES,
    halt::CLAUSES,
    ledger::CLAUSES,
    end::CLAUSES,
    plastic::CLAUSES,
    &[
        resumed(&["K-3a", "F-1a", "F-1b", "G-3b", "T-6a"]),
        looked_at(&["K-3a", "F-1a", "F-1b", "G-3b", "T-6a", "K-4a"]),
    ],
];
