//! Checks for every part of a saved state: counts, and finite numbers.

use interface::solver::Refusal;

pub use interface::saved::refusal;

/// Refuses a wrong count.
///
/// # Errors
/// A refusal with both numbers.
pub fn count(what: &str, found: usize, expected: usize) -> Result<(), Refusal> {
    if found == expected {
        return Ok(());
    }
    let text = format!("the saved state has {found} {what}, expected {expected}");
    Err(refusal(text))
}

/// Refuses numbers that are not finite.
///
/// # Errors
/// A refusal that names what they are.
pub fn finite(what: impl Fn() -> String, numbers: &[f64]) -> Result<(), Refusal> {
    if numbers.iter().all(|x| x.is_finite()) {
        return Ok(());
    }
    let text = format!("{}: a number that is not finite", what());
    Err(refusal(text))
}
