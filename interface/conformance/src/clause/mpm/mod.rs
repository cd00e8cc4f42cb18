//! The clauses of a continuum, besides those of both sides.

mod exchange;
mod halt;
mod imps;
mod limits;
mod physics;
pub(crate) mod scene;

use super::row::Clause;

/// All of them, in order.
pub const CLAUSES: &[&[Clause]] = &[
    exchange::CLAUSES,
    imps::CLAUSES,
    limits::CLAUSES,
    halt::CLAUSES,
    physics::CLAUSES,
];
