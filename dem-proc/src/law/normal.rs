//! Normal springs: a force that depends on the overlap alone, so that it has a potential.

use super::PairProperties;
use super::history::Plain;

/// A normal spring.
pub trait Normal: Plain {
    /// The constants of a pair.
    type Pair: Plain;
    /// The constants of a pair.
    fn pair(&self, properties: &PairProperties) -> Self::Pair;
    /// Pressing force in N/m at a positive overlap (m).
    fn force(&self, pair: &Self::Pair, overlap: f64) -> f64;
    /// Pulling force in N/m at a positive overlap: adhesion.
    #[inline]
    fn pull(&self, _: &Self::Pair, _: f64) -> f64 {
        0.0
    }
    /// Bound of the stiffness in N/m up to this overlap (m), which may be negative.
    fn stiffness(&self, pair: &Self::Pair, overlap: f64) -> f64;
    /// Potential in J/m at a positive overlap.
    fn energy(&self, pair: &Self::Pair, overlap: f64) -> f64;
}

/// `F = k xi` (Jiang 2020 eq. 43).
#[derive(Debug, Clone, Copy)]
pub struct Linear {
    /// `k_n` in N/m.
    pub stiffness: f64,
}

impl Normal for Linear {
    type Pair = ();
    fn pair(&self, _: &PairProperties) {}
    #[inline]
    fn force(&self, (): &(), overlap: f64) -> f64 {
        self.stiffness * overlap
    }
    #[inline]
    fn stiffness(&self, (): &(), _: f64) -> f64 {
        self.stiffness
    }
    fn energy(&self, (): &(), overlap: f64) -> f64 {
        0.5 * self.stiffness * overlap * overlap
    }
}

/// `F = K xi^1.5` (Hertz; Singer 2022). For spheres `K = 4/3 E* sqrt(R*)`.
#[derive(Debug, Clone, Copy)]
pub struct Hertz {
    /// `K` in N/m^1.5.
    pub constant: f64,
}

impl Normal for Hertz {
    type Pair = ();
    fn pair(&self, _: &PairProperties) {}
    #[inline]
    fn force(&self, (): &(), overlap: f64) -> f64 {
        self.constant * overlap * overlap.sqrt()
    }
    /// `dF/dxi = 1.5 K sqrt(xi)`: it grows with the overlap, and so does the step limit's stiffness.
    #[inline]
    fn stiffness(&self, (): &(), overlap: f64) -> f64 {
        1.5 * self.constant * overlap.max(0.0).sqrt()
    }
    fn energy(&self, (): &(), overlap: f64) -> f64 {
        0.4 * self.constant * overlap * overlap * overlap.sqrt()
    }
}

/// `F = k_A A`, with `A` the area that the overlap cuts off a disc of the reduced radius (Chen 2023 eq. 18, area
/// measure): a circular segment of height `xi`.
///
/// The area is computed in closed form and not as the intersection of two polygons. As a function of one distance it
/// has a potential, and it costs only one arc tangent.
#[derive(Debug, Clone, Copy)]
pub struct Area {
    /// `k_A` in N/m^2 per m.
    pub stiffness: f64,
}

impl Normal for Area {
    /// `R*` in m.
    type Pair = f64;
    fn pair(&self, properties: &PairProperties) -> f64 {
        properties.radius
    }
    #[inline]
    fn force(&self, radius: &f64, overlap: f64) -> f64 {
        let r = *radius;
        let xi = overlap.min(2.0 * r);
        let chord = (xi * (2.0 * r - xi)).sqrt();
        // acos(1 - xi/r) as an arc tangent, which keeps its digits at small overlaps.
        self.stiffness * (r * r * chord.atan2(r - xi) - (r - xi) * chord)
    }
    /// `dA/dxi` is the chord, at most the diameter.
    #[inline]
    fn stiffness(&self, radius: &f64, overlap: f64) -> f64 {
        let r = *radius;
        let xi = overlap.max(0.0).min(r);
        2.0 * self.stiffness * (xi * (2.0 * r - xi)).sqrt()
    }
    /// The integral of the area over the overlap: `2/3 c^3 + (xi - r) A`, with half the chord `c`.
    fn energy(&self, radius: &f64, overlap: f64) -> f64 {
        let r = *radius;
        let xi = overlap.min(2.0 * r);
        let chord = (xi * (2.0 * r - xi)).sqrt();
        let area = self.force(radius, xi);
        let beyond = area * (overlap - xi); // a whole disc is inside: the area grows no more
        self.stiffness * 2.0 / 3.0 * chord.powi(3) + (xi - r) * area + beyond
    }
}

/// Any spring, with a constant pulling stress over the contact's width `2 sqrt(2 R* xi)` (Singer 2022: blocks of wood
/// with an adhesion of 30 and 60 Pa).
///
/// A function of the overlap alone, so it has a potential, and is zero where a contact opens or closes.
#[derive(Debug, Clone, Copy)]
pub struct Adhesive<N> {
    /// The pressing part.
    pub spring: N,
    /// Adhesion in Pa.
    pub stress: f64,
}

impl<N: Normal> Normal for Adhesive<N> {
    /// Constants of the pressing part, and `2 sqrt(2 R*)` times the stress.
    type Pair = (N::Pair, f64);
    fn pair(&self, properties: &PairProperties) -> Self::Pair {
        (
            self.spring.pair(properties),
            2.0 * self.stress * (2.0 * properties.radius).sqrt(),
        )
    }
    #[inline]
    fn force(&self, pair: &Self::Pair, overlap: f64) -> f64 {
        self.spring.force(&pair.0, overlap)
    }
    #[inline]
    fn pull(&self, pair: &Self::Pair, overlap: f64) -> f64 {
        pair.1 * overlap.sqrt()
    }
    /// Adhesion only reduces the stiffness.
    #[inline]
    fn stiffness(&self, pair: &Self::Pair, overlap: f64) -> f64 {
        self.spring.stiffness(&pair.0, overlap)
    }
    fn energy(&self, pair: &Self::Pair, overlap: f64) -> f64 {
        self.spring.energy(&pair.0, overlap) - pair.1 * 2.0 / 3.0 * overlap * overlap.sqrt()
    }
}
