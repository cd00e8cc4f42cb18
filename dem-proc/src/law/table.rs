//! Laws by pairs of surfaces: one kind of law, with different numbers for each pair.

use interface::config::ContactLaw;
use interface::config::surfaces::ContactPair;

use super::{Kinematics, Law, Loss, PairProperties, Response, Stiffness};
use crate::body::surfaces::Surfaces;

/// A law `L` for every pair of surfaces. Each contact stores its law with the other constants of its pair, so that the
/// loops need no look-up.
#[derive(Debug, Clone)]
pub struct Table<L> {
    /// Row by row, one row for each surface.
    laws: Vec<L>,
    surfaces: usize,
}

impl<L: Copy> Table<L> {
    /// A table in which `pairs` have their own laws and all others `for_all`. `law` builds the type from a configured
    /// law.
    pub fn new(
        surfaces: &Surfaces,
        for_all: &ContactLaw,
        pairs: &[&ContactPair],
        law: impl Fn(&ContactLaw) -> L,
    ) -> Self {
        let n = surfaces.count();
        let mut laws = vec![law(for_all); n * n];
        for pair in pairs {
            let [a, b] = [0, 1].map(|k| surfaces.number(&pair.between[k]) as usize);
            let law = law(&pair.law);
            laws[a * n + b] = law;
            laws[b * n + a] = law;
        }
        Self { laws, surfaces: n }
    }

    /// The same table of what `law` makes of each law, if it makes something of all.
    pub fn of<M>(&self, law: impl Fn(L) -> Option<M>) -> Option<Table<M>> {
        let laws: Option<Vec<M>> = self.laws.iter().copied().map(law).collect();
        Some(Table {
            laws: laws?,
            surfaces: self.surfaces,
        })
    }
}

impl<L: Law + Copy> Law for Table<L> {
    type History = L::History;
    type Pair = (L, L::Pair);

    fn pair(&self, properties: &PairProperties) -> Self::Pair {
        let [a, b] = properties.surfaces.map(|s| s as usize);
        let law = self.laws[a * self.surfaces + b];
        (law, law.pair(properties))
    }
    #[inline]
    fn stiffness(&self, (law, pair): &Self::Pair, overlap: f64) -> Stiffness {
        law.stiffness(pair, overlap)
    }
    fn dashpots(&self, (law, pair): &Self::Pair) -> [[f64; 2]; 2] {
        law.dashpots(pair)
    }
    #[inline]
    fn normal(&self, (law, pair): &Self::Pair, overlap: f64) -> [f64; 2] {
        law.normal(pair, overlap)
    }
    #[inline]
    fn response_to_spring(
        &self,
        (law, pair): &Self::Pair,
        spring: f64,
        kinematics: &Kinematics,
        before: &Self::History,
    ) -> Response<Self::History> {
        law.response_to_spring(pair, spring, kinematics, before)
    }
    #[inline]
    fn separate(
        &self,
        (law, pair): &Self::Pair,
        kinematics: &Kinematics,
        before: &Self::History,
    ) -> Loss {
        law.separate(pair, kinematics, before)
    }
    fn energy(&self, (law, pair): &Self::Pair, overlap: f64, history: &Self::History) -> f64 {
        law.energy(pair, overlap, history)
    }
}
