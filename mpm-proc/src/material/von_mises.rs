//! Von Mises plasticity with linear isotropic hardening (Bardenhagen 2000) on Hencky's elasticity: radial return of the Cauchy
//! stress, whose moduli are those of small strains over the volume.

use super::elastic::Moduli;
use super::model::Material;
use super::point::{Deformation, Dissipated, Point};
use crate::kernel::lanes::{Lanes, ZERO, splat};

/// Von Mises material: `sqrt(3 J_2) = sigma_0 + H alpha` with the equivalent plastic strain `alpha`.
#[derive(Debug, Clone, Copy)]
pub struct VonMises {
    /// Elastic part.
    pub moduli: Moduli,
    /// `sigma_0` in Pa.
    pub yield_stress: f64,
    /// H in Pa.
    pub hardening: f64,
}

impl Material for VonMises {
    /// Equivalent plastic strain.
    type State = Lanes;
    const DISSIPATES: bool = true;

    #[inline(always)]
    fn update(&self, point: &mut Point<Lanes>, by: &Deformation, _per_dt: f64) -> Dissipated {
        let (trial, volume) = self.moduli.trial(&point.stress, point.volume, by);
        let (mean, deviator) = trial.split();
        let twice_j2 = deviator.squared();
        let q = (splat(1.5) * twice_j2).sqrt();
        let three_g = splat(3.0 * self.moduli.shear) / volume;
        let strength = splat(self.hardening).mul_add(point.state, splat(self.yield_stress));
        let flow = (q - strength).fast_max(ZERO) / (three_g + splat(self.hardening));
        let new_q = q - three_g * flow;
        let ratio = new_q / q.fast_max(splat(f64::MIN_POSITIVE));
        point.stress = deviator.scaled_about(mean, ratio);
        point.state += flow;
        point.volume = volume;
        Dissipated {
            plastic: new_q * flow * volume,
            viscous: ZERO,
        }
    }

    #[inline(always)]
    fn stiffness_over_density(&self, point: &Point<Lanes>) -> Lanes {
        let moduli = &self.moduli;
        moduli.stiffness(&point.stress, point.volume) * splat(1.0 / moduli.density)
    }

    fn plastic_strain(&self, point: &Point<Lanes>) -> Lanes {
        point.state
    }

    fn elastic_energy(&self, point: &Point<Lanes>) -> Lanes {
        self.moduli.stored(&point.stress, point.volume)
    }

    fn sound_speed(&self) -> f64 {
        self.moduli.sound_speed()
    }
}
