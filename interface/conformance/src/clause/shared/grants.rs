//! Section 5, grants: what is out of order or no number is refused.

use crate::clause::{Clause, clauses};
use crate::mutant::{Flaw, change};

pub const CLAUSES: &[Clause] = clauses! {
    Must "G-1a" "refuses two grants in a message"
        refuses Flaw::grants(|header, grants| { grants.push(grants[0]); header.count = 2; });
        - "uses the first of two grants": Flaw::grants(|header, grants| { grants.truncate(1); header.count = 1; });
    Must "G-2a" "refuses a grant with a NaN" refuses Flaw::grant(|grant| grant.epoch_start = f64::NAN);
        - "uses 0 instead of a NaN":
            Flaw::grant(|g| g.epoch_start = if g.epoch_start.is_nan() { 0.0 } else { g.epoch_start });
    Must "G-3a" "refuses a step that it has done" refuses Flaw::grant(|grant| grant.first -= 1);
        - "accepts an old grant as the next one": change::grant(|g, now| g.first = g.first.max(now.step));
    Must "G-3b" "refuses a grant that skips a step" refuses Flaw::grant(|grant| grant.first += 1);
        - "accepts a grant that skips a step": change::grant(|g, now| g.first = g.first.min(now.step));
    Must "G-3c" "refuses a grant of no steps" refuses Flaw::grant(|grant| grant.steps = 0);
        - "takes a grant of no steps as one step": Flaw::grant(|grant| grant.steps = grant.steps.max(1));
};
