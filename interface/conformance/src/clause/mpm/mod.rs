//! The clauses of a continuum, besides those of both sides.

mod exchange;
mod halt;
mod imps;
mod limits;
mod physics;
pub(crate) mod scene;

use super::row::Clause;
use super::shared::naps;

/// All of them, in order.
pub const CLAUSES: &[&[Clause]] = &[
    exchange::CLAUSES,
    &[naps(&["S-7a", "G-10a", "E-2b"])],
    imps::CLAUSES,
    limits::CLAUSES,
    halt::CLAUSES,
    physics::CLAUSES,
];
