//! Contact laws as a scene and a configuration write them; [`super::laws`] has what follows from their numbers.

use std::f64::consts::FRAC_PI_2;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Contact law. Stiffness in N/m per metre of thickness.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum ContactLaw {
    /// Linear spring (Jiang 2020 eq. 43), Coulomb friction with a tangential spring, optional viscous damping.
    Linear {
        /// k_n in N/m.
        normal_stiffness: f64,
        /// k_t in N/m; needed where there is friction.
        #[serde(default)]
        tangential_stiffness: f64,
        /// mu.
        #[serde(default)]
        friction: f64,
        /// zeta of the contact, a fraction of critical damping of the pair: 0 elastic. The contact never pulls, so the
        /// restitution is `e = exp(-2 t / tan t)` with `t = acos(zeta)`: zeta of 0.49724, 0.18086, 0.03427 for e of 0.3,
        /// 0.6, 0.9.
        #[serde(default)]
        damping_ratio: f64,
        /// Mass in kg/m that the dashpots of one point are to damp, in place of the mass of the pair: for a block of mass M
        /// that stands on N points M/N, so that `damping_ratio` is that of the block on its contact. 0: the pair's own.
        /// Between points and bodies only.
        #[serde(default)]
        damped_mass: f64,
    },
    /// Linear spring with adhesion and rolling resistance, both optional.
    Granular {
        /// k_n in N/m.
        normal_stiffness: f64,
        /// k_t in N/m; needed where there is friction.
        #[serde(default)]
        tangential_stiffness: f64,
        /// mu.
        #[serde(default)]
        friction: f64,
        /// zeta of the contact, as for `linear`.
        #[serde(default)]
        damping_ratio: f64,
        /// Mass in kg/m that the dashpots of one point are to damp, in place of the mass of the pair: as for `linear`.
        #[serde(default)]
        damped_mass: f64,
        /// Pulling stress in Pa over the width `2 sqrt(2 R* xi)` of the contact.
        #[serde(default)]
        adhesion: f64,
        /// mu_r: the moment that resists rolling is at most `mu_r R* F_n`. Between bodies only.
        #[serde(default)]
        rolling_friction: f64,
    },
    /// Hertz-Mindlin with dashpot (Singer 2022): `F_n = K xi^1.5`, `k_t = k_n 2 (1 - nu) / (2 - nu)`.
    HertzMindlin {
        /// K in N/m^1.5 (per m); for spheres `4/3 E* sqrt(R*)`.
        hertz_constant: f64,
        /// nu, for the tangential stiffness.
        #[serde(default)]
        poisson_ratio: f64,
        /// mu.
        #[serde(default)]
        friction: f64,
        /// Coefficient of restitution e that a free impact has; 1: elastic.
        #[serde(default = "one")]
        restitution: f64,
        /// Pulling stress in Pa over the width `2 sqrt(2 R* xi)` of the contact.
        #[serde(default)]
        adhesion: f64,
    },
    /// Force in proportion to the area of the overlap (Chen 2023 eq. 18): `F_n = k_A A`, A the circular segment of
    /// height xi of a disc of the reduced radius.
    Area {
        /// k_A in N/m^2 (per m).
        area_stiffness: f64,
        /// k_t in N/m; needed where there is friction.
        #[serde(default)]
        tangential_stiffness: f64,
        /// mu.
        #[serde(default)]
        friction: f64,
    },
}

/// 1.0, the default of `restitution`.
fn one() -> f64 {
    1.0
}

impl ContactLaw {
    /// `linear` with k_n and k_t in N/m, mu and zeta.
    pub const fn linear(
        normal_stiffness: f64,
        tangential_stiffness: f64,
        friction: f64,
        damping_ratio: f64,
    ) -> Self {
        Self::Linear {
            normal_stiffness,
            tangential_stiffness,
            friction,
            damping_ratio,
            damped_mass: 0.0,
        }
    }
}

impl Default for ContactLaw {
    /// No stiffness: nothing is in contact.
    fn default() -> Self {
        Self::linear(0.0, 0.0, 0.0, 0.0)
    }
}

/// Fraction of critical damping `zeta` with which a contact that never pulls has the restitution `e`. It is 0 for e = 1
/// (elastic) and above 1, more than critical, for e below `exp(-2) = 0.135`.
///
/// Such a contact ends when dashpot and spring cancel, before the overlap is zero (Schwager and Poeschel 2007,
/// "Coefficient of restitution and linear-dashpot model revisited", eqs. 15 to 21), with
///
/// ```text
/// e = exp(-zeta / s [pi - atan2(2 zeta s, 1 - 2 zeta^2)]),   s = sqrt(1 - zeta^2)
///   = exp(-2 t / tan t)       with zeta = cos t   up to 1:  the angle in brackets is 2 t
///   = exp(-2 t / tanh t)      with zeta = cosh t  beyond
/// ```
///
/// This decreases monotonically with zeta, so it is inverted by bisection. A Hertz contact whose dashpot is
/// proportional to the root of the stiffness has the same restitution: with `y = xi^(5/4)` and `dtau = xi^(1/4) dt` its
/// equation is the linear one, including the force (Antypov and Elliott 2011).
pub fn ratio_of_restitution(e: f64) -> f64 {
    let half = -0.5 * e.ln();
    if half <= 0.0 {
        0.0
    } else if half < 1.0 {
        // t / tan t falls from 1 to 0.
        bisect([0.0, FRAC_PI_2], |t| t / t.tan() > half).cos()
    } else {
        // t / tanh t grows from 1, and is at least t.
        bisect([0.0, half], |t| t / t.tanh() < half).cosh()
    }
}

/// The end of the part of an interval in which `before` holds, to the last bit. It must hold at the beginning, where it
/// is not evaluated.
fn bisect([mut low, mut high]: [f64; 2], before: impl Fn(f64) -> bool) -> f64 {
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return middle;
        }
        if before(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    /// Schwager and Poeschel's formula as printed, up to critical damping. Beyond, the arc tangent becomes a logarithm.
    fn restitution(zeta: f64) -> f64 {
        if zeta < 1.0 {
            let s = (1.0 - zeta * zeta).sqrt();
            (-zeta / s * (PI - (2.0 * zeta * s).atan2(1.0 - 2.0 * zeta * zeta))).exp()
        } else {
            let s = (zeta * zeta - 1.0).sqrt();
            (-zeta / s * ((zeta + s) / (zeta - s)).ln()).exp()
        }
    }

    #[test]
    fn the_ratio_gives_back_the_restitution_of_a_contact_that_never_pulls() {
        assert_eq!(ratio_of_restitution(1.0), 0.0);
        for (e, zeta) in [(0.3, 0.49724), (0.6, 0.18086), (0.9, 0.03427)] {
            assert!((ratio_of_restitution(e) - zeta).abs() < 5e-6, "{e}");
        }
        for e in (1..1000).map(|i| f64::from(i) * 1e-3) {
            let given = restitution(ratio_of_restitution(e));
            assert!((given / e - 1.0).abs() < 1e-8, "{e}: {given}");
        }
        // Critical damping, from both sides, and no overflow at the far end.
        let critical = (-2.0_f64).exp();
        for e in [critical, critical * 1.000_001, critical * 0.999_999] {
            assert!((ratio_of_restitution(e) - 1.0).abs() < 1e-5);
        }
        assert!(ratio_of_restitution(f64::MIN_POSITIVE).is_finite());
        assert_eq!(ratio_of_restitution(1.0 - f64::EPSILON / 2.0).signum(), 1.0);
    }
}
