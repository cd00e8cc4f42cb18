//! Clauses as rows: an id, a level, what it says, what it needs, and the function that judges it.

pub mod dem;
pub mod mpm;
mod row;
mod shared;

use interface::message::control::Party;

pub use row::{Clause, Level};
pub(crate) use row::{clauses, judged};
pub(crate) use shared::{below_the_sum, names, refuses, rejects};

/// The clauses by which the solver of one side is judged, in order; what a clause is `after` comes before it.
pub fn of(party: Party) -> Vec<&'static Clause> {
    match party {
        Party::Coupler => Vec::new(),
        side => common().chain(own(side)).collect(),
    }
}

/// Those that both sides are judged by in the same way.
pub fn common() -> impl Iterator<Item = &'static Clause> {
    shared::CLAUSES.iter().copied().flatten()
}

/// Those that only one side is judged by, or each in its own way.
pub fn own(party: Party) -> impl Iterator<Item = &'static Clause> {
    let own: &[&[Clause]] = match party {
        Party::Dem => dem::CLAUSES,
        Party::Mpm => mpm::CLAUSES,
        Party::Coupler => &[],
    };
    own.iter().copied().flatten()
}

/// What nobody can see from outside, or what this kit does not look at, with the reason: a line each.
const NOT_CHECKED: &str = "\
C-5: whether a solver copies before it checks: only a sender that writes to a segment in use would show it
C-7: that a sender gives up on a full channel after 10 s: too long for a kit
S-11: the waits of 30 s and 120 s: too long for a kit; those that come from `Configure.deadline` are judged
S-8: that a solver has done nothing that outlasts it before Ready: nobody sees all that it may have done
G-4 to G-8: rules of the coupler; the kit keeps them
J-1: every value of every field; the fields that forces and motion show are judged
V-4: the version of the transport: another one cannot join
X-4: the exit status of `tandem run`";

/// Each clause that is not checked, and why.
pub fn not_checked() -> impl Iterator<Item = (&'static str, &'static str)> {
    NOT_CHECKED.lines().filter_map(|line| line.split_once(": "))
}
