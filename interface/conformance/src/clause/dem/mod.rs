//! The clauses of a bodies' side, besides those of both sides.

mod bodies;
mod books;
mod force;
mod friction;
mod limits;
mod motion;
mod order;
pub(super) mod scene;
mod time;

use super::Clause;

/// All of them, in order.
pub const CLAUSES: &[&[Clause]] = &[
    order::CLAUSES,
    &[super::shared::naps(&["B-2a", "G-10a"])],
    time::CLAUSES,
    bodies::CLAUSES,
    force::CLAUSES,
    friction::CLAUSES,
    motion::CLAUSES,
    limits::CLAUSES,
    books::CLAUSES,
    friction::TURNING,
    time::OPENING,
];
