//! Drucker-Prager plasticity with tension cut-off and dilation (Jiang 2020 eqs. 31 to 35 and its reference 24).

use interface::config::friction::{cone_root, cone_slope};
use interface::config::material::Frictional;

use super::elastic::Moduli;
use super::perfect_plasticity::YieldSurface;
use super::point::Stress;
use crate::kernel::lanes::{Lanes, ZERO, splat};

/// Drucker-Prager material: shear surface `tau + q_phi sigma_m = k_phi`, potential with `q_psi`, and
/// `sigma_m <= sigma_t`.
#[derive(Debug, Clone, Copy)]
pub struct DruckerPrager {
    /// Elastic part.
    pub moduli: Moduli,
    q_phi: f64,
    q_psi: f64,
    k_phi: f64,
    /// The smaller of the tensile strength and the apex of the shear surface, in Pa.
    sigma_t: f64,
}

impl DruckerPrager {
    /// Initial density in kg/m^3. `q` and `k` are those of plane strain (eq. 35).
    pub fn new(density: f64, material: &Frictional) -> Self {
        let phi = material.friction_angle.to_radians();
        let psi = material.dilation_angle.to_radians();
        let (q_phi, q_psi) = (cone_slope(phi), cone_slope(psi));
        let k_phi = 3.0 * material.cohesion / cone_root(phi);
        let apex = if q_phi > 0.0 {
            k_phi / q_phi
        } else {
            f64::INFINITY
        };
        Self {
            moduli: Moduli::of(density, material),
            q_phi,
            q_psi,
            k_phi,
            sigma_t: material.tensile_strength.min(apex),
        }
    }
}

impl DruckerPrager {
    /// `K q_psi/(G + K q_phi q_psi)`: decrease of the mean stress for each unit beyond the surface.
    fn mean_by_flow(&self) -> f64 {
        let Moduli { bulk, shear, .. } = self.moduli;
        bulk * self.q_psi / (shear + bulk * self.q_phi * self.q_psi)
    }

    /// Returns a trial stress with this [`Self::mean_by_flow`]. The line that halves the corner between the two
    /// surfaces decides to which of them the stress returns. If the return would end beyond the other surface, it ends
    /// on the corner. For a cohesionless material the corner is the apex, so `tau` never changes its sign.
    #[inline(always)]
    fn return_by(&self, trial: &Stress, flow: Lanes) -> (Stress, Lanes) {
        let Moduli { bulk, shear, .. } = self.moduli;
        let sigma_t = splat(self.sigma_t.min(f64::MAX));
        let (mean, deviator) = trial.split();
        let tau = deviator.shear();

        let over = splat(self.q_phi).mul_add(mean, tau - splat(self.k_phi));
        let tau_t = splat(self.k_phi) - splat(self.q_phi) * sigma_t;
        let slope = (1.0 + self.q_phi * self.q_phi).sqrt() - self.q_phi;
        let towards_shear = (mean - sigma_t).mul_neg_add(splat(slope), tau - tau_t);
        let sheared = mean - flow * over.fast_max(ZERO);
        let by_shear = mean.simd_le(sigma_t) | towards_shear.simd_gt(ZERO);
        let new_mean = by_shear.select(sheared, mean).fast_min(sigma_t);
        let new_tau = tau.fast_min(new_mean.mul_neg_add(splat(self.q_phi), splat(self.k_phi)));
        // A deviator of zero stays zero for any ratio.
        let ratio = new_tau / tau.fast_max(splat(f64::MIN_POSITIVE));

        let work = new_tau * (tau - new_tau) * splat(1.0 / shear)
            + new_mean * (mean - new_mean) * splat(1.0 / bulk);
        (deviator.scaled_about(new_mean, ratio), work)
    }
}

impl YieldSurface for DruckerPrager {
    fn moduli(&self) -> &Moduli {
        &self.moduli
    }

    #[inline(always)]
    fn flow(
        &self,
        trial: &Stress,
        _volume: Lanes,
        share: Option<Lanes>,
        _per_dt: f64,
    ) -> (Stress, Lanes) {
        let Moduli { bulk, shear, .. } = self.moduli;
        let Some(share) = share else {
            return self.return_by(trial, splat(self.mean_by_flow()));
        };
        let stiffness = splat(bulk * self.q_psi) * share;
        let flow = stiffness / stiffness.mul_add(splat(self.q_phi), splat(shear));
        self.return_by(trial, flow)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::model::Material;

    /// `2 K + 2 G/3` at rest, whatever the surface.
    #[test]
    fn at_rest_the_stiffness_is_that_of_the_elastic_part() {
        let model = DruckerPrager::new(
            1500.0,
            &Frictional {
                bulk_modulus: 5.0e5,
                shear_modulus: 3.2e5,
                friction_angle: 35.0,
                dilation_angle: 10.0,
                cohesion: 100.0,
                tensile_strength: 10.0,
                critical_state: None,
                separates: false,
            },
        );
        let stiffness = model.stiffness_over_density(&model.initial()).to_array()[0];
        let expected = (2.0 * 5.0e5 + 2.0 / 3.0 * 3.2e5) / 1500.0;
        assert!((stiffness / expected - 1.0).abs() < 1e-12, "{stiffness}");
    }
}
