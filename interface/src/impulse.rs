//! Sums an impulse over a run without losing digits. A block at rest gets a million small kicks of gravity and of the
//! floor that cancel, and the remainder must still show whether momentum is conserved.

use core::ops::AddAssign;

use serde::{Deserialize, Serialize};

use crate::Vec2;

/// Sum of impulses in N s/m, compensated (Neumaier 1974): its error does not grow with the number of terms.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Impulse {
    sum: [f64; 2],
    lost: [f64; 2],
}

impl Impulse {
    /// The sum in N s/m.
    pub fn value(&self) -> [f64; 2] {
        [self.sum[0] + self.lost[0], self.sum[1] + self.lost[1]]
    }
}

impl AddAssign<[f64; 2]> for Impulse {
    fn add_assign(&mut self, term: [f64; 2]) {
        for (i, x) in term.into_iter().enumerate() {
            let sum = self.sum[i] + x;
            let (large, small) = if self.sum[i].abs() >= x.abs() {
                (self.sum[i], x)
            } else {
                (x, self.sum[i])
            };
            self.lost[i] += (large - sum) + small;
            self.sum[i] = sum;
        }
    }
}

impl AddAssign<Vec2> for Impulse {
    fn add_assign(&mut self, term: Vec2) {
        *self += [term.x, term.y];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_million_small_terms_keep_their_digits() {
        let (mut impulse, mut plain) = (Impulse::default(), 0.0);
        impulse += [1e3, 0.0];
        plain += 1e3;
        for _ in 0..1_000_000 {
            impulse += [1e-4 / 3.0, 1.0];
            plain += 1e-4 / 3.0;
        }
        let exact = 1e3 + 1e2 / 3.0;
        assert!(
            (impulse.value()[0] - exact).abs() <= 2e-13,
            "{}",
            impulse.value()[0] - exact
        );
        assert!(
            (plain - exact).abs() > 1e-12,
            "the plain sum would have done"
        );
        assert_eq!(impulse.value()[1], 1e6);
    }
}
