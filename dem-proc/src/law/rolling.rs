//! Rolling resistance: a moment on top of any law.

use super::history::{Part, ROLLING};
use super::tangent::within;
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

/// Energy of the rolling spring in J/m.
fn energy(&Part([moment, stiffness]): &Rolled) -> f64 {
    if stiffness > 0.0 {
        0.5 * moment * moment / stiffness
    } else {
        0.0
    }
}

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
    fn damping_ratio(&self, mass: f64) -> f64 {
        self.law.damping_ratio(mass)
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
        let Part([moment_before, stiffness_before]) = *rolled;
        let stiffness = self.stiffness(pair, kinematics.overlap).rolling;
        let kept = if stiffness < stiffness_before {
            stiffness / stiffness_before
        } else {
            1.0
        };
        let rolled_by = kinematics.rolled();
        let cap = pair.1 * response.normal.max(0.0);
        let moment = within(moment_before * kept - stiffness * rolled_by, cap);
        let after = Part([moment, stiffness]);
        let work = -0.5 * (moment_before + moment) * rolled_by;
        let loss = Loss {
            friction: response.loss.friction + work - (energy(&after) - energy(rolled)),
            ..response.loss
        };
        Response {
            normal: response.normal,
            tangential: response.tangential,
            moment,
            history: (response.history, after),
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
            friction: loss.friction + energy(rolled) - 0.5 * rolled.0[0] * kinematics.rolled(),
            ..loss
        }
    }
    fn energy(&self, pair: &Self::Pair, overlap: f64, history: &Self::History) -> f64 {
        self.law.energy(&pair.0, overlap, &history.0) + energy(&history.1)
    }
}
