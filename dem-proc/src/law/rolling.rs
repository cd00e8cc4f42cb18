//! Rolling resistance: a moment on top of any law.

use super::history::{Part, ROLLING};
use super::tangent::{follow, stored};
use super::{Kinematics, Law, Loss, PairProperties, Response, Stiffness};

/// Elastic-plastic rolling spring (Ai, Chen, Rotter, Ooi 2011, model C without its dashpot): moment `-k_r` times the
/// relative rotation, at most `mu_r R* F_n`, with `k_r = 2.25 k_n (mu_r R*)^2` (Iwashita and Oda 1998).
#[derive(Debug, Clone, Copy)]
pub struct Rolling<L> {
    /// The law for the forces.
    pub law: L,
    /// `mu_r`.
    pub friction: f64,
}

/// Moment and `k_r` at the last step, both in N.
pub type Rolled = Part<ROLLING, 2>;

impl<L: Law> Law for Rolling<L> {
    type History = (L::History, Rolled);
    /// Constants of the law for the forces, and `mu_r R*`.
    type Pair = (L::Pair, f64);

    fn pair(&self, properties: &PairProperties) -> Self::Pair {
        (self.law.pair(properties), self.friction * properties.radius)
    }
    #[inline]
    fn stiffness(&self, pair: &Self::Pair, overlap: f64) -> Stiffness {
        let stiffness = self.law.stiffness(&pair.0, overlap);
        Stiffness {
            rolling: 2.25 * stiffness.normal * pair.1 * pair.1,
            ..stiffness
        }
    }
    fn dashpots(&self, pair: &Self::Pair) -> [[f64; 2]; 2] {
        self.law.dashpots(&pair.0)
    }
    #[inline]
    fn normal(&self, pair: &Self::Pair, overlap: f64) -> [f64; 2] {
        self.law.normal(&pair.0, overlap)
    }
    #[inline]
    fn response_to_spring(
        &self,
        pair: &Self::Pair,
        spring: f64,
        kinematics: &Kinematics,
        (before, rolled): &Self::History,
    ) -> Response<Self::History> {
        let response = (self.law).response_to_spring(&pair.0, spring, kinematics, before);
        let stiffness = self.stiffness(pair, kinematics.overlap).rolling;
        let cap = pair.1 * response.normal.max(0.0);
        let (after, work) = follow(rolled.0, stiffness, kinematics.rolled(), cap);
        let loss = Loss {
            friction: response.loss.friction + work - (stored(after) - stored(rolled.0)),
            ..response.loss
        };
        Response {
            normal: response.normal,
            tangential: response.tangential,
            moment: after[0],
            history: (response.history, Part(after)),
            loss,
        }
    }
    #[inline]
    fn separate(
        &self,
        pair: &Self::Pair,
        kinematics: &Kinematics,
        (before, rolled): &Self::History,
    ) -> Loss {
        let loss = self.law.separate(&pair.0, kinematics, before);
        Loss {
            friction: loss.friction + stored(rolled.0) - 0.5 * rolled.0[0] * kinematics.rolled(),
            ..loss
        }
    }
    fn energy(&self, pair: &Self::Pair, overlap: f64, history: &Self::History) -> f64 {
        self.law.energy(&pair.0, overlap, &history.0) + stored(history.1.0)
    }
}
