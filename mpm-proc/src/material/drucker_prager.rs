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
    use interface::config::MaterialModel;
    use interface::config::friction::FrictionTest;

    use super::*;
    use crate::material::model::Material;
    use crate::material::point::Point;
    use crate::material::single_point::{Path, cayley, stress};

    const MODULI: Moduli = Moduli {
        bulk: 5.0e5,
        shear: 3.2e5,
        density: 1500.0,
    };

    fn invariants(point: &Point<()>) -> (f64, f64) {
        let [xx, yy, zz, xy] = stress(point);
        let mean = (xx + yy + zz) / 3.0;
        let j2 = 0.5 * ((xx - mean).powi(2) + (yy - mean).powi(2) + (zz - mean).powi(2)) + xy * xy;
        (mean, j2.sqrt())
    }

    fn numbers(phi: f64, psi: f64, cohesion: f64, tension: f64) -> Frictional {
        Frictional {
            bulk_modulus: MODULI.bulk,
            shear_modulus: MODULI.shear,
            friction_angle: phi,
            dilation_angle: psi,
            cohesion,
            tensile_strength: tension,
            critical_state: None,
            separates: false,
        }
    }

    fn material(phi: f64, psi: f64, cohesion: f64, tension: f64) -> DruckerPrager {
        DruckerPrager::new(MODULI.density, &numbers(phi, psi, cohesion, tension))
    }

    /// In one-dimensional compression of an elastic material tau/sigma_m is fixed by the moduli; below q_phi nothing
    /// yields.
    #[test]
    fn within_the_surfaces_it_is_elastic() {
        let mut path = Path::new(material(60.0, 0.0, 0.0, 0.0));
        path.stretch([0.0, -0.01], 100);
        let [_, yy, _, _] = stress(&path.point);
        let modulus = MODULI.bulk + 4.0 / 3.0 * MODULI.shear;
        let (volume, ln) = (path.point.volume.to_array()[0], cayley(-0.01, 100).ln());
        assert!((yy * volume / (ln * modulus) - 1.0).abs() < 1e-12);
        assert!(path.plastic.abs() < 1e-16);
    }

    /// `2 K + 2 G/3` at rest, whatever the surface.
    #[test]
    fn at_rest_the_stiffness_is_that_of_the_elastic_part() {
        let model = material(35.0, 10.0, 100.0, 10.0);
        let stiffness = model.stiffness_over_density(&model.initial()).to_array()[0];
        let expected = (2.0 * MODULI.bulk + 2.0 / 3.0 * MODULI.shear) / MODULI.density;
        assert!((stiffness / expected - 1.0).abs() < 1e-12, "{stiffness}");
    }

    /// Compress evenly to a mean stress, then shear: tau levels at k - q sigma_m, with psi = 0 at constant sigma_m;
    /// the work of further shear is all plastic.
    #[test]
    fn shear_levels_at_the_yield_stress() {
        let model = material(30.0, 0.0, 1.0e3, 0.0);
        let mut path = Path::new(model);
        path.stretch([-0.01, -0.01], 100);
        let (mean, _) = invariants(&path.point);
        path.shear(0.5, 5000);
        let (after, tau) = invariants(&path.point);
        let tan = 30.0_f64.to_radians().tan();
        let root = (9.0 + 12.0 * tan * tan).sqrt();
        let expected = 3.0e3 / root - 3.0 * tan / root * mean;
        assert!((after / mean - 1.0).abs() < 1e-12);
        assert!((tau / expected - 1.0).abs() < 1e-12, "{tau} {expected}");
        let work = path.plastic;
        path.shear(0.1, 1000);
        let volume = path.point.volume.to_array()[0];
        let rate = (path.plastic - work) / (0.1 * tau * volume);
        // The deviator follows the strain rate, but for the out-of-plane part left from compression and the spin.
        assert!((rate - 1.0).abs() < 0.01, "{rate}");
    }

    /// The material that a test gives 30 degrees.
    fn measured(test: FrictionTest, psi: f64) -> DruckerPrager {
        let model = MaterialModel::DruckerPrager(numbers(30.0, psi, 0.0, 0.0));
        match model.measured(test).unwrap() {
            MaterialModel::DruckerPrager(numbers) => DruckerPrager::new(MODULI.density, &numbers),
            other => unreachable!("{other:?}"),
        }
    }

    /// Stress of a layer that flows: sheared under the weight above it, without a strain along it, until nothing changes.
    fn flowing(model: DruckerPrager) -> [f64; 4] {
        let mut path = Path::new(model);
        // So small that stresses are small compared with G: the spin rotates the stress in proportion to their ratio.
        path.stretch([-1e-4, -1e-4], 100);
        let load = stress(&path.point)[1];
        let modulus = MODULI.bulk + 4.0 / 3.0 * MODULI.shear;
        for _ in 0..3000 {
            let rise = (load - stress(&path.point)[1]) / modulus;
            path.apply([[0.0, 1e-6], [0.0, rise]], 1);
        }
        stress(&path.point)
    }

    #[test]
    fn flow_in_plane_strain_has_the_angle_measured_there() {
        for psi in [0.0, 10.0] {
            let [xx, yy, _, xy] = flowing(measured(FrictionTest::PlaneStrain, psi));
            let (middle, radius) = (0.5 * (xx + yy), (0.5 * (xx - yy)).hypot(xy));
            let sine = radius / -middle;
            assert!((sine / 0.5 - 1.0).abs() < 1e-3, "{psi}: {sine}");
        }
    }

    #[test]
    fn a_layer_under_load_flows_at_the_angle_of_repose() {
        for psi in [0.0, 10.0] {
            let [_, yy, _, xy] = flowing(measured(FrictionTest::Repose, psi));
            let slope = xy / -yy;
            let expected = 30.0_f64.to_radians().tan();
            assert!((slope / expected - 1.0).abs() < 1e-3, "{psi}: {slope}");
        }
    }

    /// Ratio of the largest to the smallest stress at failure `(1 + sin phi)/(1 - sin phi)` = 3, with the stress in between
    /// as small in compression and as large in extension.
    #[test]
    fn a_cylinder_fails_at_the_angle_measured_in_its_test() {
        for (test, sides) in [
            (FrictionTest::TriaxialCompression, [3.0, 1.0, 1.0]),
            (FrictionTest::TriaxialExtension, [1.0, 3.0, 3.0]),
        ] {
            let model = measured(test, 0.0);
            let yields = |ratio: f64| {
                let [xx, yy, zz] = sides.map(|s| splat(if s > 1.0 { -1e3 * ratio } else { -1e3 }));
                let xy = ZERO;
                let (_, work) = model.flow(&Stress { xx, yy, zz, xy }, splat(1.0), None, 0.0);
                work.to_array()[0] > 0.0
            };
            assert!(!yields(3.0 - 1e-9) && yields(3.0 + 1e-9), "{test:?}");
        }
    }

    /// At constant volume dilation drives the mean stress down the surface: d sigma_m / d tau = -1/q_phi.
    #[test]
    fn confined_dilation_climbs_the_surface() {
        let model = material(35.0, 25.0, 0.0, 0.0);
        let mut path = Path::new(model);
        path.stretch([-0.01, -0.01], 100);
        let (before, _) = invariants(&path.point);
        path.shear(0.02, 2000);
        let (mean, tau) = invariants(&path.point);
        assert!(mean < before);
        assert!((tau / (-model.q_phi * mean) - 1.0).abs() < 1e-12);
        // Plastic flow: d eps_v^p = q_psi d gamma^p with tau = G (gamma - gamma^p): all of it in closed form.
        let gamma_p = (before - mean) / (MODULI.bulk * model.q_psi);
        assert!(gamma_p > 0.0 && gamma_p < 0.02);
    }

    #[test]
    fn tension_of_sand_ends_at_the_apex() {
        for (psi, lateral) in [(0.0, 0.0), (25.0, 0.0), (0.0, -0.004), (25.0, 0.009)] {
            let mut path = Path::new(material(35.0, psi, 0.0, 0.0));
            path.stretch([0.01, lateral], 7);
            let s = stress(&path.point);
            assert!(
                s.iter().all(|s| s.abs() < 1e-9) || invariants(&path.point).0 <= 1e-9,
                "{psi} {s:?}"
            );
            // Pulled apart and sheared: no stress is possible.
            path.stretch([0.02, 0.02], 1);
            assert!(stress(&path.point).iter().all(|s| s.abs() < 1e-9));
        }
    }

    #[test]
    fn the_tension_cut_off_leaves_small_shear_alone() {
        let model = material(30.0, 10.0, 5.0e3, 1.0e3);
        let mut path = Path::new(model);
        path.shear(0.002, 10);
        let (_, tau) = invariants(&path.point);
        path.stretch([0.005, 0.005], 1);
        let (mean, after) = invariants(&path.point);
        assert!((mean - 1.0e3).abs() < 1e-9, "{mean}");
        // Equal stretch in the plane adds to the deviator out of plane; the shear before it has turned the stress a
        // little, by its angle of 1e-3, and is by now that of a larger area.
        let [xx, _, zz, _] = stress(&path.point);
        let tau = tau / path.point.volume.to_array()[0];
        let expected = (tau * tau + (xx - zz).powi(2) / 3.0).sqrt();
        assert!((after / expected - 1.0).abs() < 1e-3, "{after} {expected}");
        assert!(after <= model.k_phi - model.q_phi * mean + 1e-9);
    }
}
