//! What the dashpots of contacts add to the step limit.
//!
//! Leapfrog with the forces of dashpots at the velocity of the last half step is stable if `L dt^2/4 + G dt/2 <= 1`, with `L` and
//! `G` the largest eigenvalues of `M^-1 K` and `M^-1 C`. With `zeta = G / (2 sqrt(L))` that is the limit of one oscillator.
//! Dashpots add up as springs do: `N` equal contacts on a body have `zeta sqrt(N)`, and one far from the centre of mass of
//! a light body has more than its law's ratio, which refers to the reduced mass. Two bounds of `G` hold:
//!
//! - `G <= sqrt(S L)` by Cauchy and Schwarz, with `S` the same sum as `L` of `c^2 / k` in place of `k`;
//! - `G <= a L` with `c <= a k` for every contact, where springs are constant.

use nalgebra::{Matrix3, Vector3};

use interface::Vec2;
use mechanics::mass::cross;

use crate::body::bodies::Bodies;
use crate::contact::approach::Near;
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

/// `M^-1/2 S M^-1/2` of each body for the pairs in reach, and the bodies of these.
#[derive(Debug, Default)]
pub struct Shares {
    of_bodies: Vec<Matrix3<f64>>,
    largest: Vec<f64>,
    pairs: Vec<[u32; 2]>,
}

impl Shares {
    /// Forgets all pairs.
    pub fn clear(&mut self, bodies: &Bodies) {
        self.of_bodies.clear();
        self.of_bodies.resize(bodies.len(), Matrix3::zeros());
        self.pairs.clear();
    }

    /// Adds a pair with dashpots of these `c^2 / k` (kg/m) along N and T.
    pub fn add(&mut self, bodies: &Bodies, near: &Near, squares: [f64; 2]) {
        for b in near.bodies {
            let body = &bodies.state[b as usize];
            let roots = [body.inverse_mass, body.inverse_inertia].map(f64::sqrt);
            let arm = near.point - body.center;
            let along = Vec2::new(-near.normal.y, near.normal.x);
            for (way, square) in [near.normal, along].into_iter().zip(squares) {
                let row = Vector3::new(
                    way.x * roots[0],
                    way.y * roots[0],
                    cross(arm, way) * roots[1],
                );
                self.of_bodies[b as usize] += row * row.transpose() * square;
            }
        }
        self.pairs.push(near.bodies);
    }

    /// `S`: the largest sum for a pair of the largest eigenvalues of both.
    pub fn largest(&mut self) -> f64 {
        let of_bodies = self.of_bodies.iter();
        let eigenvalues = of_bodies.map(|share| share.symmetric_eigenvalues().max());
        self.largest.clear();
        self.largest.extend(eigenvalues);
        let of_pair = |[a, b]: &[u32; 2]| self.largest[*a as usize] + self.largest[*b as usize];
        self.pairs.iter().map(of_pair).fold(0.0, f64::max)
    }
}
