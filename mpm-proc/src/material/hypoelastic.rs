//! Hypoelasticity: the Jaumann rate of the Cauchy stress is linear in the strain rate (Jiang 2020 eqs. 25, 36; docs/physics.md
//! section 1).
//!
//! It has no energy. Over a closed cycle of volume and shear its work is not zero, so it creates or loses energy, by a
//! share of the order of the strain (Simo and Pister 1984). It is there for comparison with the paper. The energy that
//! counts as stored is that of small strains, `p^2 / 2K + s:s / 4G` times the volume: a function of state, from which
//! the work of the stress departs.

use super::elastic::{PlaneStrain, PlaneStress};
use super::model::Material;
use super::point::{Deformation, Dissipated, Point, Stress, swelling};
use crate::kernel::lanes::{Lanes, ZERO, splat};

/// The rate form with the moduli of a law.
#[derive(Debug, Clone, Copy)]
pub struct Jaumann<L>(pub L);

/// `q sigma q^T` with the rotation `q` over half of the interval.
#[inline(always)]
fn half_turn(s: &Stress, by: &Deformation) -> Stress {
    // Half of the angle that the interval turns the material by, W_yx dt / 2; tan(angle/2) in the midpoint rule. A rotation
    // turns the deviator by twice its angle.
    let h = splat(0.25) * (by.yx - by.xy);
    let hh = h * h;
    let scale = splat(1.0) / (splat(1.0) + hh);
    let (cos, sin) = ((splat(1.0) - hh) * scale, splat(2.0) * h * scale);
    let centre = splat(0.5) * (s.xx + s.yy);
    let half = splat(0.5) * (s.xx - s.yy);
    let turned = half * cos - s.xy * sin;
    Stress {
        xx: centre + turned,
        yy: centre - turned,
        zz: s.zz,
        xy: half * sin + s.xy * cos,
    }
}

impl Material for Jaumann<PlaneStrain> {
    type State = ();
    const DISSIPATES: bool = false;

    /// The stress that was there turns with the material over half of the interval, the strain increment adds to it, and both
    /// turn over the other half: the increment has the axes of the middle.
    ///
    /// The rotation is that of Hughes and Winget (1980): the exact rotation by the midpoint rule's angle, so that
    /// turning alone changes no invariant. It agrees with the Jaumann rate `C:D + W sigma - sigma W` to second order. With
    /// an increment in the axes of the end the deviator lags by half a step's turn, and a body that spins gains energy.
    #[inline(always)]
    fn update(&self, point: &mut Point<()>, by: &Deformation, _per_dt: f64) -> Dissipated {
        let moduli = &self.0.0;
        let turned = half_turn(&point.stress, by);
        let lame = splat(moduli.lame()) * (by.xx + by.yy);
        let two_g = splat(2.0 * moduli.shear);
        let strained = Stress {
            xx: two_g.mul_add(by.xx, turned.xx + lame),
            yy: two_g.mul_add(by.yy, turned.yy + lame),
            zz: turned.zz + lame,
            xy: splat(moduli.shear).mul_add(by.xy + by.yx, turned.xy),
        };
        point.stress = half_turn(&strained, by);
        point.volume *= swelling(by.xx + by.yy);
        Dissipated::NOTHING
    }

    #[inline(always)]
    fn stiffness_over_density(&self, point: &Point<()>) -> Lanes {
        let moduli = &self.0.0;
        point.volume * splat(moduli.plane_stiffness()) * splat(1.0 / moduli.density)
    }

    fn elastic_energy(&self, point: &Point<()>) -> Lanes {
        self.0.0.energy(&point.stress) * point.volume
    }

    fn sound_speed(&self) -> f64 {
        self.0.sound_speed()
    }
}

impl Material for Jaumann<PlaneStress> {
    type State = ();
    const DISSIPATES: bool = false;

    #[inline(always)]
    fn update(&self, point: &mut Point<()>, by: &Deformation, _per_dt: f64) -> Dissipated {
        let shear = self.0.0.shear;
        let turned = half_turn(&point.stress, by);
        let two_g = splat(2.0 * shear);
        let mean = two_g * splat(self.0.thinning()) * (by.xx + by.yy);
        let strained = Stress {
            xx: two_g.mul_add(by.xx, turned.xx + mean),
            yy: two_g.mul_add(by.yy, turned.yy + mean),
            zz: ZERO,
            xy: splat(shear).mul_add(by.xy + by.yx, turned.xy),
        };
        point.stress = half_turn(&strained, by);
        let trace = (by.xx + by.yy) * splat(1.0 - self.0.thinning());
        point.volume *= swelling(trace);
        Dissipated::NOTHING
    }

    #[inline(always)]
    fn stiffness_over_density(&self, point: &Point<()>) -> Lanes {
        point.volume * splat(self.0.plane_stiffness()) * splat(1.0 / self.0.0.density)
    }

    fn elastic_energy(&self, point: &Point<()>) -> Lanes {
        self.0.0.energy(&point.stress) * point.volume
    }

    fn sound_speed(&self) -> f64 {
        self.0.sound_speed()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::elastic::Moduli;
    use crate::material::single_point::{Path, stress};

    const MODULI: Moduli = Moduli {
        bulk: 5.0e5,
        shear: 3.0e5,
        density: 1000.0,
    };

    /// The Jaumann rate in simple shear: `sigma_xy = G sin(gamma)`, `sigma_xx = G (1 - cos(gamma))` (Dienes 1979), to second order.
    #[test]
    fn simple_shear() {
        let errors = [50, 100].map(|steps| {
            let mut path = Path::new(Jaumann(PlaneStrain(MODULI)));
            path.shear(2.0, steps);
            let [xx, yy, zz, xy] = stress(&path.point).map(|s| s / MODULI.shear);
            assert!((yy + xx).abs() < 1e-8 && zz.abs() < 1e-8);
            assert_eq!(path.point.volume.to_array()[0], 1.0);
            let along = (xx - (1.0 - 2.0_f64.cos())).abs();
            along.max((xy - 2.0_f64.sin()).abs())
        });
        assert!(
            errors[0] < 5e-4 && errors[1] < errors[0] / 3.9,
            "{errors:?}"
        );
    }

    /// `sigma_xx = E eps_xx` where y is free: eps_yy = -nu eps_xx by definition of E and nu.
    #[test]
    fn plane_stress_is_youngs_modulus() {
        let (k, g) = (MODULI.bulk, MODULI.shear);
        let young = 9.0 * k * g / (3.0 * k + g);
        let nu = (3.0 * k - 2.0 * g) / (2.0 * (3.0 * k + g));
        let mut path = Path::new(Jaumann(PlaneStress(MODULI)));
        path.stretch([1e-3, -nu * 1e-3], 10);
        let [xx, yy, zz, _] = stress(&path.point);
        assert!((xx / (young * 1e-3) - 1.0).abs() < 1e-12, "{xx}");
        assert!(yy.abs() < 1e-9 * xx && zz == 0.0);
        let volume = path.point.volume.to_array()[0];
        assert!((volume - ((1.0 - 2.0 * nu) * 1e-3).exp()).abs() < 1e-11);
    }
}
