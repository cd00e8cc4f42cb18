//! The clauses of a bodies' side, besides those of both sides.

pub(super) mod halt;
mod order;
mod physics;
pub(super) mod scene;
mod segments;

use super::row::Clause;

/// All of them, in order.
pub const CLAUSES: &[&[Clause]] = &[
    order::CLAUSES,
    segments::CLAUSES,
    halt::CLAUSES,
    physics::CLAUSES,
];
