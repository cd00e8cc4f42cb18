//! Rolling resistance: a moment on top of any law.

use super::history::{Numbers, Part, ROLLING};
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

/// History of [`Rolling`].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Rolled<H> {
    /// History of the law for the forces.
    pub law: H,
    /// Moment at the last step in N.
    pub moment: f64,
    /// `k_r` at the last step in N.
    pub stiffness: f64,
}

impl<H> Rolled<H> {
    fn energy(&self) -> f64 {
        if self.stiffness > 0.0 {
            0.5 * self.moment * self.moment / self.stiffness
        } else {
            0.0
        }
    }
}

impl<H: Numbers> Numbers for Rolled<H> {
    const COUNT: usize = H::COUNT + 2;
    fn parts(which: u32) -> Vec<Part> {
        [H::parts(which), <[f64; 2]>::parts(ROLLING)].concat()
    }
    fn put(&self, numbers: &mut Vec<f64>) {
        let Self {
            law,
            moment,
            stiffness,
        } = self;
        law.put(numbers);
        [*moment, *stiffness].put(numbers);
    }
    fn take(numbers: &mut impl Iterator<Item = f64>) -> Self {
        let law = H::take(numbers);
        let [moment, stiffness] = Numbers::take(numbers);
        Self {
            law,
            moment,
            stiffness,
        }
    }
}

impl<L: Law> Law for Rolling<L> {
    type History = Rolled<L::History>;
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
        before: &Self::History,
    ) -> Response<Self::History> {
        let response = (self.law).response_to_spring(&pair.0, spring, kinematics, &before.law);
        let stiffness = self.stiffness(pair, kinematics.overlap).rolling;
        let kept = if stiffness < before.stiffness {
            stiffness / before.stiffness
        } else {
            1.0
        };
        let cap = pair.1 * response.normal.max(0.0);
        let moment = within(before.moment * kept - stiffness * kinematics.rolled, cap);
        let history = Rolled {
            law: response.history,
            moment,
            stiffness,
        };
        let work = -0.5 * (before.moment + moment) * kinematics.rolled;
        let loss = Loss {
            friction: response.loss.friction + work - (history.energy() - before.energy()),
            ..response.loss
        };
        Response {
            normal: response.normal,
            tangential: response.tangential,
            moment,
            history,
            loss,
        }
    }
    #[inline]
    fn separate(&self, pair: &Self::Pair, kinematics: &Kinematics, before: &Self::History) -> Loss {
        let loss = self.law.separate(&pair.0, kinematics, &before.law);
        Loss {
            friction: loss.friction + before.energy() - 0.5 * before.moment * kinematics.rolled,
            ..loss
        }
    }
    fn energy(&self, pair: &Self::Pair, overlap: f64, history: &Self::History) -> f64 {
        self.law.energy(&pair.0, overlap, &history.law) + history.energy()
    }
}
