//! One row of the table: what is broken in which clause.

use crate::wrong::Wrong;

/// A row of the table.
pub struct Row {
    /// The id of the clause that is broken.
    pub clause: &'static str,
    /// What is broken.
    pub what: &'static str,
    /// Breaks it, afresh for every run.
    pub wrong: fn() -> Wrong,
}

/// Rows: the id of a clause, below it what breaks it.
macro_rules! rows {
    ($(clause $clause:literal: $(- $what:literal: $wrong:expr;)*)*) => {
        &[$($($crate::table::row::Row {
            clause: $clause,
            what: $what,
            wrong: || $crate::wrong::Wrong::from($wrong),
        },)*)*]
    };
}
pub(super) use rows;
