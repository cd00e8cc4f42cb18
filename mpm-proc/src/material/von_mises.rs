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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::single_point::{Path, cayley, stress};

    const MODEL: VonMises = VonMises {
        moduli: Moduli {
            bulk: 5.0e9,
            shear: 3.0e9,
            density: 2000.0,
        },
        yield_stress: 3.0e7,
        hardening: 4.0e8,
    };

    /// Pure shear by stretching one way and shortening the other: elastic until `tau = sigma_0/sqrt 3`, then
    /// `d tau/d gamma = G h/(1 + h)` with `h = H/3G`.
    #[test]
    fn pure_shear_hardens_by_its_closed_form() {
        let mut path = Path::new(MODEL);
        let strain = 0.02; // gamma = 2 strain
        path.stretch([strain, -strain], 400);
        let [xx, yy, zz, _] = stress(&path.point);
        let (g, h) = (3.0e9, 4.0e8 / 9.0e9);
        let yields = 3.0e7 / 3.0_f64.sqrt();
        let expected = yields + g * h / (1.0 + h) * (2.0 * cayley(strain, 400).ln() - yields / g);
        assert!((xx / expected - 1.0).abs() < 1e-12, "{xx} {expected}");
        assert!((xx + yy).abs() < 1e-3 && zz.abs() < 1e-3);
        // alpha = gamma_p / sqrt 3, and the work is the area under the yield stress.
        let alpha = path.point.state.to_array()[0];
        let gamma = 2.0 * cayley(strain, 400).ln();
        assert!((alpha - (gamma - xx / g) / 3.0_f64.sqrt()).abs() < 1e-12);
        let work = 3.0e7 * alpha + 0.5 * 4.0e8 * alpha * alpha;
        assert!(
            (path.plastic / work - 1.0).abs() < 2e-3,
            "{} {work}",
            path.plastic
        );
    }
}
