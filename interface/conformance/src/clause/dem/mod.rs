//! The clauses of a bodies' side, besides those of both sides.

mod bodies;
mod force;
mod ledger;
mod limits;
mod order;
mod physics;
pub(super) mod scene;
mod segments;
mod time;

use super::row::Clause;
use super::shared::{looked_at, naps, resumed};

/// All of them, in order.
pub const CLAUSES: &[&[Clause]] = &[
    order::CLAUSES,
    &[naps(&["S-7a", "B-2a", "G-10a"])],
    time::CLAUSES,
    bodies::CLAUSES,
    force::CLAUSES,
    segments::CLAUSES,
    limits::CLAUSES,
    ledger::CLAUSES,
    &[
        resumed(&["K-3a", "B-3a", "G-3b", "I-3a", "T-6a"]),
        looked_at(&["K-3a", "B-3a", "G-3b", "I-3a", "T-6a", "K-4a"]),
    ],
    physics::CLAUSES,
];
