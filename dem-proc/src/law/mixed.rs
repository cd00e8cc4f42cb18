//! Laws by pairs of surfaces, of different kinds: Hertz for a ball, a linear spring for its supports.
//!
//! A contact stores the kind of its pair, and the loops branch on it. A table of one kind ([`super::table`]) does not,
//! so only scenes that mix kinds have this cost.

use super::contact::Contact;
use super::dashpot::{Tsuji, Viscous};
use super::history::{All, Numbers};
use super::normal::{Adhesive, Area, Hertz, Linear};
use super::rolling::Rolling;
use super::tangent::{Coulomb, Mindlin};
use super::{Kinematics, Law, Loss, PairProperties, Response, Stiffness};

/// `linear` and `granular`, with all optional parts.
pub type OfGrains = Rolling<Contact<Adhesive<Linear>, Coulomb, Viscous>>;
/// `hertz_mindlin`, with all optional parts.
pub type OfSpheres = Contact<Adhesive<Hertz>, Mindlin, Tsuji>;
/// `area`.
pub type OfAreas = Contact<Area, Coulomb, Viscous>;

/// A law of any kind.
#[derive(Debug, Clone, Copy)]
pub enum AnyLaw {
    /// `linear` or `granular`.
    Grains(OfGrains),
    /// `hertz_mindlin`.
    Spheres(OfSpheres),
    /// `area`.
    Areas(OfAreas),
}

/// A law and its constants for a pair.
#[derive(Debug, Clone, Copy)]
pub enum AnyPair {
    /// `linear` or `granular`.
    Grains(OfGrains, <OfGrains as Law>::Pair),
    /// `hertz_mindlin`.
    Spheres(OfSpheres, <OfSpheres as Law>::Pair),
    /// `area`.
    Areas(OfAreas, <OfAreas as Law>::Pair),
}

/// What a kind of law makes of its constants for a pair.
macro_rules! by_kind {
    ($any:expr, |$law:ident, $pair:ident| $value:expr) => {
        match $any {
            AnyPair::Grains($law, $pair) => $value,
            AnyPair::Spheres($law, $pair) => $value,
            AnyPair::Areas($law, $pair) => $value,
        }
    };
}

/// Turns the history of a response into the history of any law.
fn remembering<H: Numbers>(response: Response<H>) -> Response<All> {
    Response {
        normal: response.normal,
        tangential: response.tangential,
        moment: response.moment,
        history: All::of(&response.history),
        loss: response.loss,
    }
}

impl Law for AnyLaw {
    type History = All;
    type Pair = AnyPair;

    fn pair(&self, properties: &PairProperties) -> AnyPair {
        match *self {
            Self::Grains(law) => AnyPair::Grains(law, law.pair(properties)),
            Self::Spheres(law) => AnyPair::Spheres(law, law.pair(properties)),
            Self::Areas(law) => AnyPair::Areas(law, law.pair(properties)),
        }
    }
    #[inline]
    fn stiffness(&self, pair: &AnyPair, overlap: f64) -> Stiffness {
        by_kind!(pair, |law, pair| law.stiffness(pair, overlap))
    }
    fn damping_ratio(&self, mass: f64) -> f64 {
        match self {
            Self::Grains(law) => law.damping_ratio(mass),
            Self::Spheres(law) => law.damping_ratio(mass),
            Self::Areas(law) => law.damping_ratio(mass),
        }
    }
    #[inline]
    fn normal(&self, pair: &AnyPair, overlap: f64) -> [f64; 2] {
        by_kind!(pair, |law, pair| law.normal(pair, overlap))
    }
    #[inline]
    fn response_to_spring(
        &self,
        pair: &AnyPair,
        spring: f64,
        kinematics: &Kinematics,
        before: &All,
    ) -> Response<All> {
        by_kind!(pair, |law, pair| {
            remembering(law.response_to_spring(pair, spring, kinematics, &Numbers::of(before)))
        })
    }
    #[inline]
    fn separate(&self, pair: &AnyPair, kinematics: &Kinematics, before: &All) -> Loss {
        by_kind!(pair, |law, pair| law.separate(
            pair,
            kinematics,
            &Numbers::of(before)
        ))
    }
    fn energy(&self, pair: &AnyPair, overlap: f64, history: &All) -> f64 {
        by_kind!(pair, |law, pair| law.energy(
            pair,
            overlap,
            &Numbers::of(history)
        ))
    }
}
