//! Sums an impulse over a run without losing digits. A block at rest gets a million small kicks of gravity and of the
//! floor that cancel, and the remainder must still show whether momentum is conserved.

use core::ops::AddAssign;

use serde::{Deserialize, Serialize};

use crate::Vec2;

/// Sum of impulses in N s/m with their moments about the origin in N s, compensated (Neumaier 1974): its error does not grow with
/// the number of terms.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Impulse {
    sum: [f64; 3],
    lost: [f64; 3],
}

impl Impulse {
    /// The sum in N s/m.
    pub fn value(&self) -> [f64; 2] {
        [self.sum[0] + self.lost[0], self.sum[1] + self.lost[1]]
    }

    /// The moment in N s.
    pub fn moment(&self) -> f64 {
        self.sum[2] + self.lost[2]
    }
}

impl AddAssign<[f64; 3]> for Impulse {
    fn add_assign(&mut self, term: [f64; 3]) {
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

/// An impulse (N s/m), or a force, at a place (m), with its moment about the origin.
pub fn at(place: impl Into<Vec2>, impulse: impl Into<Vec2>) -> [f64; 3] {
    let (place, impulse) = (place.into(), impulse.into());
    [impulse.x, impulse.y, place.perp(&impulse)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_million_small_terms_keep_their_digits() {
        let (mut impulse, mut plain) = (Impulse::default(), 0.0);
        impulse += [1e3, 0.0, 0.0];
        plain += 1e3;
        for _ in 0..1_000_000 {
            impulse += [1e-4 / 3.0, 1.0, -1.0];
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
        assert_eq!((impulse.value()[1], impulse.moment()), (1e6, -1e6));
    }
}
