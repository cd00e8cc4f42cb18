//! The mutants as rows of one table: what is broken, where.

mod dem;
mod mpm;
mod row;
mod shared;

use conformance::clause::{self, Clause};
use interface::message::control::Party;

use crate::wrong::Wrong;

/// A solver that breaks one clause.
#[derive(Clone)]
pub struct Mutant {
    /// The clause's id, for its second mutant with `/2` behind it.
    pub name: String,
    /// What it breaks.
    pub clause: &'static Clause,
    /// What it does wrong, in words.
    pub what: &'static str,
    /// What it does wrong, afresh for every run.
    pub wrong: fn() -> Wrong,
}

/// The mutants of one side, in the order of the table.
///
/// # Panics
/// If a row names a clause that this side does not have.
pub fn of(party: Party) -> Vec<Mutant> {
    let own = match party {
        Party::Dem => dem::ROWS,
        Party::Mpm => mpm::ROWS,
        Party::Coupler => return Vec::new(),
    };
    let clauses = clause::of(party);
    let mut mutants: Vec<Mutant> = Vec::new();
    for row in shared::ROWS.iter().chain(own) {
        let clause = clauses.iter().find(|clause| clause.id == row.clause);
        let clause = clause.unwrap_or_else(|| panic!("a {party} has no clause {}", row.clause));
        let before = mutants.iter().filter(|m| m.clause.id == row.clause).count();
        let name = match before {
            0 => row.clause.to_string(),
            _ => format!("{}/{}", row.clause, before + 1),
        };
        mutants.push(Mutant {
            name,
            clause,
            what: row.what,
            wrong: row.wrong,
        });
    }
    mutants
}
