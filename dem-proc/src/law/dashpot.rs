//! Dashpots: the viscous part of a law.

use super::history::{DASHPOT, Part, Plain};

/// Viscous part of a law.
pub trait Dashpot: Plain {
    /// The constants of a pair.
    type Pair: Plain;
    /// The constants of a pair of reduced mass `mass` (kg/m) whose stiffness in either direction is `stiffness` (N/m),
    /// if that is constant.
    fn pair(&self, stiffness: [f64; 2], mass: f64) -> Self::Pair;
    /// As [`Law::dashpots`](super::Law::dashpots), beside springs of this stiffness (N/m).
    fn constants(&self, pair: &Self::Pair, stiffness: [f64; 2]) -> [[f64; 2]; 2];
    /// Force in N/m for a relative velocity in m/s at the present stiffness.
    fn drag(&self, pair: &Self::Pair, stiffness: [f64; 2], velocity: [f64; 2]) -> [f64; 2];
}

/// Forces along `N` and `T` at the last step in N/m.
pub type Drag = Part<DASHPOT, 2>;

/// Dashpots in both directions, each a fraction of the critical damping `2 sqrt(k m)` with the spring of that direction
/// and the mass of the pair, or another mass.
///
/// A block of mass `M` on `N` points is an oscillator of `M` on `N` springs and dashpots, `zeta = N c / (2 sqrt(N k
/// M))`. With `c = 2 zeta sqrt(k M/N)`, which has the mass `M/N`, this is the ratio of the dashpots. With the mass of a
/// point it is smaller by the root of the number of rows of points.
#[derive(Debug, Clone, Copy)]
pub struct Viscous {
    /// `zeta`.
    pub ratio: f64,
    /// Mass that `ratio` refers to, in kg/m; 0: that of the pair.
    pub mass: f64,
}

impl Dashpot for Viscous {
    type Pair = [f64; 2];
    fn pair(&self, stiffness: [f64; 2], mass: f64) -> [f64; 2] {
        let mass = if self.mass > 0.0 { self.mass } else { mass };
        stiffness.map(|k| 2.0 * self.ratio * (k * mass).sqrt())
    }
    fn constants(&self, c: &[f64; 2], k: [f64; 2]) -> [[f64; 2]; 2] {
        let square = |a: usize| if c[a] > 0.0 { c[a] * c[a] / k[a] } else { 0.0 };
        [*c, [square(0), square(1)]]
    }
    #[inline]
    fn drag(&self, c: &[f64; 2], _: [f64; 2], velocity: [f64; 2]) -> [f64; 2] {
        [-c[0] * velocity[0], -c[1] * velocity[1]]
    }
}

/// Dashpots that follow the stiffness of a Hertz contact, `c = 2 sqrt(5/6) beta sqrt(k m)` with `beta` the ratio of
/// [`ratio_of_restitution`](interface::config::ratio_of_restitution), so that the restitution does not depend on the
/// speed (Tsuji 1992; Singer 2022).
#[derive(Debug, Clone, Copy)]
pub struct Tsuji {
    /// `beta`.
    pub ratio: f64,
}

impl Dashpot for Tsuji {
    /// Reduced mass in kg/m.
    type Pair = f64;
    fn pair(&self, _: [f64; 2], mass: f64) -> f64 {
        mass
    }
    fn constants(&self, mass: &f64, k: [f64; 2]) -> [[f64; 2]; 2] {
        let square = 10.0 / 3.0 * self.ratio * self.ratio * mass;
        let some = k.map(|k| square > 0.0 && k > 0.0);
        [
            some.map(|is| if is { f64::INFINITY } else { 0.0 }),
            some.map(|is| if is { square } else { 0.0 }),
        ]
    }
    #[inline]
    fn drag(&self, mass: &f64, stiffness: [f64; 2], velocity: [f64; 2]) -> [f64; 2] {
        let factor = -2.0 * (5.0_f64 / 6.0).sqrt() * self.ratio;
        let drag = |k: f64, v: f64| factor * (k * mass).sqrt() * v;
        [
            drag(stiffness[0], velocity[0]),
            drag(stiffness[1], velocity[1]),
        ]
    }
}

/// Energy dissipated over the last step in J/m, in which the surfaces `moved`, from the forces at its beginning and at
/// its end. Trapezoidal rule: second order, and by summation by parts exactly the work that the leapfrog's kicks remove
/// from the kinetic energy.
#[inline]
pub fn dissipated(moved: [f64; 2], &Part(before): &Drag, &Part(after): &Drag) -> f64 {
    -0.5 * ((after[0] + before[0]) * moved[0] + (after[1] + before[1]) * moved[1])
}
