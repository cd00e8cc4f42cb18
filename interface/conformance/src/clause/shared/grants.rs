//! Section 5, grants: what is out of order or no number is refused.

use crate::clause::{Clause, clauses};
use crate::flaw::Flaw;

pub const CLAUSES: &[Clause] = clauses! {
    Must "G-1a" "refuses two grants in a message"
        refuses Flaw::grants(|header, grants| { grants.push(grants[0]); header.count = 2; });
    Must "G-2a" "refuses a grant with a NaN" refuses Flaw::grant(|grant| grant.epoch_start = f64::NAN);
    Must "G-3a" "refuses a step that it has done" refuses Flaw::grant(|grant| grant.first -= 1);
    Must "G-3b" "refuses a grant that skips a step" refuses Flaw::grant(|grant| grant.first += 1);
    Must "G-3c" "refuses a grant of no steps" refuses Flaw::grant(|grant| grant.steps = 0);
};
