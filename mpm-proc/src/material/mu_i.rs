//! The `mu(I)` rheology of dense granular flow (Jop, Forterre and Pouliquen 2006) on Hencky's elasticity.
//!
//! Friction grows with the inertial number `I = gamma' d / sqrt(p/rho_s)`, `gamma'` the rate of plastic shear, `d` the diameter of the
//! grains and `rho_s` their density: `tau = mu(I) p`, `mu(I) = mu_s + (mu_2 - mu_s)/(I_0/I + 1)`, with `tau = sqrt(s:s/2)` and the
//! mean pressure `p`. It flows at constant volume; density opens by separation ([`super::granular`]; Dunatunga and Kamrin 2015).
//!
//! An interval `dt` at the pressure of the trial is solved exactly for the stress at its end: from `tau = tau* - G gamma' dt` and
//! `gamma' = x (tau - mu_s p)/(mu_2 p - tau)`, `x = I_0 sqrt(p/rho_s)/d`,
//!
//! ```text
//! tau^2 - b tau + c = 0,   b = tau* + mu_2 p + G dt x,   c = tau* mu_2 p + G dt x mu_s p
//! ```
//!
//! of which the smaller root is between `mu_s p` and `mu_2 p`. It has no limit of the step of its own: whatever the step, stress is
//! below the elastic one.

use interface::config::material::Inertial;

use super::elastic::Moduli;
use super::perfect_plasticity::YieldSurface;
use super::point::Stress;
use crate::kernel::lanes::{Lanes, ZERO, splat};

/// Grains whose friction grows with the inertial number.
#[derive(Debug, Clone, Copy)]
pub struct MuI {
    /// Elastic part.
    pub moduli: Moduli,
    /// `mu_s` and `mu_2`.
    friction: [f64; 2],
    /// `I_0/(d sqrt(rho_s))`: the rate `x` over the root of the pressure.
    rate: f64,
}

impl MuI {
    /// Initial density in kg/m^3.
    pub fn new(density: f64, material: &Inertial) -> Self {
        Self {
            moduli: Moduli {
                bulk: material.bulk_modulus,
                shear: material.shear_modulus,
                density,
            },
            friction: [material.static_friction, material.limit_friction],
            rate: material.inertial_number
                / (material.grain_diameter * material.grain_density.sqrt()),
        }
    }

    /// Glass beads of a millimetre (Jop, Forterre and Pouliquen 2006).
    #[cfg(test)]
    pub const SAMPLE: Self = Self {
        moduli: Moduli {
            bulk: 5e5,
            shear: 3e5,
            density: 1500.0,
        },
        friction: [0.38, 0.64],
        rate: 0.279 / (1e-3 * 50.0),
    };
}

impl YieldSurface for MuI {
    const SHARES_VOLUMES: bool = true;

    fn moduli(&self) -> &Moduli {
        &self.moduli
    }

    #[inline(always)]
    fn flow(
        &self,
        trial: &Stress,
        volume: Lanes,
        _share: Option<Lanes>,
        per_dt: f64,
    ) -> (Stress, Lanes) {
        let (mean, deviator) = trial.split();
        let tau = deviator.shear();
        let pressure = (-mean).fast_max(ZERO);
        let [least, most] = self.friction.map(|mu| splat(mu) * pressure);
        let dt = if per_dt > 0.0 { 1.0 / per_dt } else { 0.0 };
        let viscous = splat(self.moduli.shear * self.rate * dt) * pressure.sqrt() / volume;
        let b = tau + most + viscous;
        let c = tau.mul_add(most, viscous * least);
        let root = b.mul_sub(b, splat(4.0) * c).fast_max(ZERO).sqrt();
        let slower = splat(2.0) * c / (b + root).fast_max(splat(f64::MIN_POSITIVE));
        let new_tau = tau.simd_gt(least).select(slower, tau);
        // A deviator of zero stays zero whatever the ratio.
        let ratio = new_tau / tau.fast_max(splat(f64::MIN_POSITIVE));
        let work = new_tau * (tau - new_tau) * splat(1.0 / self.moduli.shear);
        (deviator.scaled_about(mean, ratio), work)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::granular::Granular;
    use crate::material::single_point::{DT, Path, stress};

    /// Sheared steadily at each rate it has the friction of its inertial number.
    #[test]
    fn steady_shear_has_the_friction_of_its_rate() {
        for rate in [0.1, 1.0, 10.0, 100.0] {
            let model = Granular {
                grains: MuI::SAMPLE,
                critical: None,
                separates: true,
                volume_rate: 0.0,
            };
            let mut path = Path::new(model);
            path.stretch([-2e-3, -2e-3], 10);
            let steps = (0.3 / (rate * DT)).ceil().max(30.0);
            path.shear(rate * DT * steps, steps as usize);
            let [xx, yy, zz, xy] = stress(&path.point);
            let pressure = -(xx + yy + zz) / 3.0;
            let number = rate / (MuI::SAMPLE.rate / 0.279 * pressure.sqrt());
            let expected = 0.38 + 0.26 / (0.279 / number + 1.0);
            let s = [xx, yy, zz].map(|s| s + pressure);
            let tau = (0.5 * (s[0] * s[0] + s[1] * s[1] + s[2] * s[2]) + xy * xy).sqrt();
            assert!(
                (tau / pressure / expected - 1.0).abs() < 5e-3,
                "{rate}: {} {expected}",
                tau / pressure
            );
            // All work that is not stored has been dissipated.
            let off = path.work - path.energy() - path.plastic;
            assert!(off.abs() < 0.06 * path.work, "{off} {}", path.work);
        }
    }
}
