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

/// Something of a law of any kind: of grains (`linear` or `granular`), of spheres (`hertz_mindlin`), or of areas (`area`).
#[derive(Debug, Clone, Copy)]
pub enum Kind<G, S, A> {
    /// Of `linear` or `granular`.
    Grains(G),
    /// Of `hertz_mindlin`.
    Spheres(S),
    /// Of `area`.
    Areas(A),
}

/// A law of any kind.
pub type AnyLaw = Kind<OfGrains, OfSpheres, OfAreas>;

/// A law and its constants for a pair.
type Of<L> = (L, <L as Law>::Pair);
/// The same of any kind.
pub type AnyPair = Kind<Of<OfGrains>, Of<OfSpheres>, Of<OfAreas>>;

/// What each kind of law makes of its own.
macro_rules! by_kind {
    ($any:expr, |$own:pat_param| $value:expr) => {
        match $any {
            Kind::Grains($own) => $value,
            Kind::Spheres($own) => $value,
            Kind::Areas($own) => $value,
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
            Kind::Grains(law) => Kind::Grains((law, law.pair(properties))),
            Kind::Spheres(law) => Kind::Spheres((law, law.pair(properties))),
            Kind::Areas(law) => Kind::Areas((law, law.pair(properties))),
        }
    }
    #[inline]
    fn stiffness(&self, pair: &AnyPair, overlap: f64) -> Stiffness {
        by_kind!(pair, |(law, pair)| law.stiffness(pair, overlap))
    }
    fn dashpots(&self, pair: &AnyPair) -> [[f64; 2]; 2] {
        by_kind!(pair, |(law, pair)| law.dashpots(pair))
    }
    #[inline]
    fn normal(&self, pair: &AnyPair, overlap: f64) -> [f64; 2] {
        by_kind!(pair, |(law, pair)| law.normal(pair, overlap))
    }
    #[inline]
    fn response_to_spring(
        &self,
        pair: &AnyPair,
        spring: f64,
        kinematics: &Kinematics,
        before: &All,
    ) -> Response<All> {
        by_kind!(pair, |(law, pair)| {
            remembering(law.response_to_spring(pair, spring, kinematics, &Numbers::of(before)))
        })
    }
    #[inline]
    fn separate(&self, pair: &AnyPair, kinematics: &Kinematics, before: &All) -> Loss {
        by_kind!(pair, |(law, pair)| {
            law.separate(pair, kinematics, &Numbers::of(before))
        })
    }
    fn energy(&self, pair: &AnyPair, overlap: f64, history: &All) -> f64 {
        by_kind!(pair, |(law, pair)| {
            law.energy(pair, overlap, &Numbers::of(history))
        })
    }
}
