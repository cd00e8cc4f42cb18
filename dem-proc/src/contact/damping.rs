//! What the dashpots of contacts add to the step limit.
//!
//! Leapfrog with the forces of dashpots at the velocity of the last half step is stable if `L dt^2/4 + G dt/2 <= 1`, with `L` and
//! `G` the largest eigenvalues of `M^-1 K` and `M^-1 C`. With `zeta = G / (2 sqrt(L))` that is the limit of one oscillator.
//! Dashpots add up as springs do: `N` equal contacts on a body have `zeta sqrt(N)`, and one far from the centre of mass of
//! a light body has more than its law's ratio, which refers to the reduced mass. Two bounds of `G` hold:
//!
//! - `G <= sqrt(S L)` by Cauchy and Schwarz, with `S` the same sum as `L` of `c^2 / k` in place of `k`;
//! - `G <= a L` with `c <= a k` for every contact, where springs are constant.

use crate::contact::engine::Listing;
use crate::law::Law;
use crate::lists::now::Among;

/// Constants of the dashpots of a list's pairs; all 0 without dashpots.
#[derive(Debug, Clone, Copy, Default)]
pub struct Damping {
    /// `S` of pairs of bodies, over all pairs in the list; of pairs with points the part of the
    /// points.
    pub own: f64,
    /// Largest `c^2 / k` in kg/m.
    pub square: f64,
    /// The same over the reduced mass of its pair: `4 zeta^2` of a contact alone.
    pub alone: f64,
    /// `a` in s, infinite where stiffnesses change; between bodies, or of the part of the bodies.
    pub delay: f64,
}

impl Damping {
    /// Of `pairs` with these constants and mobilities (1/kg).
    pub fn of<K: Listing, L: Law>(
        law: &L,
        among: &Among,
        pairs: &[K::Pair],
        (constants, mobility): (&[L::Pair], &[f64]),
    ) -> Self {
        let state = &among.bodies.state;
        let mut all = Self::default();
        let mut shares = vec![0.0; if K::POINTS == 0 { state.len() } else { 0 }];
        for ((&pair, constants), mobility) in pairs.iter().zip(constants).zip(mobility) {
            let [c, squares] = law.dashpots(constants);
            let square = squares[0].max(squares[1]);
            if square == 0.0 {
                continue;
            }
            let k = law.stiffness(constants, 0.0);
            all.square = all.square.max(square);
            all.alone = all.alone.max(square * mobility);
            let mut of_points = *mobility;
            for b in K::bodies(pair).into_iter().flatten() {
                // Whatever the lever arm r of the contact, along N and along T it has a part each of r^2 / I.
                let body = &state[b as usize];
                let flat = body.inverse_mass;
                of_points -= flat;
                let turning = body.inverse_inertia * body.extent * body.extent;
                for [n, t] in [[flat, flat + turning], [flat + turning, flat]] {
                    let delay = (c[0] * n + c[1] * t) / (k.normal * n + k.tangential * t);
                    all.delay = all.delay.max(delay); // not a number for a body that forces do not move
                }
                if let Some(share) = shares.get_mut(b as usize) {
                    *share += (squares[0] + squares[1]) * flat + square * turning;
                }
            }
            if K::POINTS > 0 {
                all.own = all.own.max(square * of_points);
            }
        }
        for &pair in pairs.iter().filter(|_| all.square > 0.0 && K::POINTS == 0) {
            let bodies = K::bodies(pair).into_iter().flatten();
            all.own = all.own.max(bodies.map(|b| shares[b as usize]).sum());
        }
        all
    }
}
