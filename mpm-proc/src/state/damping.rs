//! Damping over a kick ([`crate::pass::damping`]).

use crate::kernel::transfer::share;

/// Damping over one kick.
#[derive(Debug, Clone, Copy)]
pub struct Damping {
    /// `E = exp(-c k)`.
    pub kept: f64,
    /// `(1 - E)/(c k)`.
    pub gained: f64,
}

impl Damping {
    /// At rate `rate` (1/s) over `kick` (s); nothing if either is zero.
    pub fn over(rate: f64, kick: f64) -> Option<Self> {
        let lost = rate * kick;
        (lost > 0.0).then(|| Self {
            kept: (-lost).exp(),
            gained: share(rate, kick) / lost,
        })
    }
}
