//! Linear elasticity with the Jaumann rate (Jiang 2020 eqs. 25, 36; PHYSICS.md section 1).

use interface::material::Frictional;

use super::{Deformation, Dissipated, Material, Point, Stress};
use crate::lanes::{Lanes, ZERO, splat};

/// Isotropic elastic moduli and density.
#[derive(Debug, Clone, Copy)]
pub struct Moduli {
    /// K in Pa.
    pub bulk: f64,
    /// G in Pa.
    pub shear: f64,
    /// Initial density in kg/m^3.
    pub density: f64,
}

impl Moduli {
    /// The elastic part of a material of this initial density in kg/m^3.
    pub fn of(density: f64, material: &Frictional) -> Self {
        Self {
            bulk: material.bulk_modulus,
            shear: material.shear_modulus,
            density,
        }
    }

    /// The stress that was there, turned with the material, plus what the strain increment adds, in plane strain.
    ///
    /// The rotation is that of Hughes and Winget (1980): the exact rotation by the midpoint rule's angle, so that
    /// turning alone changes no invariant. It agrees with the Jaumann rate `C:D + W sigma - sigma W` to second order.
    #[inline(always)]
    pub fn trial(&self, old: &Stress, by: &Deformation) -> Stress {
        let turned = rotate(old, by);
        let lame = splat(self.bulk - 2.0 / 3.0 * self.shear) * (by.xx + by.yy);
        let two_g = splat(2.0 * self.shear);
        Stress {
            xx: two_g.mul_add(by.xx, turned.xx + lame),
            yy: two_g.mul_add(by.yy, turned.yy + lame),
            zz: turned.zz + lame,
            xy: splat(self.shear).mul_add(by.xy + by.yx, turned.xy),
        }
    }

    /// Elastic energy per current volume in Pa: `p^2 / 2K + s:s / 4G`.
    pub fn energy(&self, stress: &Stress) -> Lanes {
        let mean = (stress.xx + stress.yy + stress.zz) * splat(1.0 / 3.0);
        let [x, y, z] = [stress.xx, stress.yy, stress.zz].map(|s| s - mean);
        let deviator = x * x + y * y + z * z + splat(2.0) * stress.xy * stress.xy;
        mean * mean * splat(0.5 / self.bulk) + deviator * splat(0.25 / self.shear)
    }

    /// Largest eigenvalue of `C diag(1, 1, 2)` in plane strain in Pa: equal stretch, or shear.
    pub fn plane_stiffness(&self) -> f64 {
        (2.0 * self.bulk + 2.0 / 3.0 * self.shear).max(2.0 * self.shear)
    }

    /// Speed of pressure waves in m/s.
    pub fn sound_speed(&self) -> f64 {
        ((self.bulk + 4.0 / 3.0 * self.shear) / self.density).sqrt()
    }
}

/// `Q sigma Q^T` with the rotation over the interval.
#[inline(always)]
fn rotate(s: &Stress, by: &Deformation) -> Stress {
    // Half of the angle that the interval turns the material by, W_yx dt / 2; tan(angle/2) in the midpoint rule.
    let h = splat(0.25) * (by.yx - by.xy);
    let hh = h * h;
    let scale = splat(1.0) / (splat(1.0) + hh);
    let (cos, sin) = ((splat(1.0) - hh) * scale, splat(2.0) * h * scale);
    let (cos2, sin2) = (cos * cos - sin * sin, splat(2.0) * sin * cos);
    let centre = splat(0.5) * (s.xx + s.yy);
    let half = splat(0.5) * (s.xx - s.yy);
    let turned = half * cos2 - s.xy * sin2;
    Stress {
        xx: centre + turned,
        yy: centre - turned,
        zz: s.zz,
        xy: half * sin2 + s.xy * cos2,
    }
}

/// `sigma : D dt` in Pa.
#[inline(always)]
pub fn power(s: &Stress, by: &Deformation) -> Lanes {
    s.xx * by.xx + s.yy * by.yy + s.xy * (by.xy + by.yx)
}

/// Volume after the interval over volume before in plane strain.
#[inline(always)]
pub fn volume_ratio(by: &Deformation) -> Lanes {
    swelling(by.xx + by.yy)
}

/// `exp(trace)` to second order, positive whatever the step.
#[inline(always)]
fn swelling(trace: Lanes) -> Lanes {
    trace.mul_add(trace.mul_add(splat(0.5), splat(1.0)), splat(1.0))
}

/// How stress follows strain in a linear elastic solid.
///
/// The rate form of Cauchy stress is not integrable at finite strain: no function of stress and volume is its energy
/// (one that pretends to be, `p^2 / 2K + s:s / 4G`, is off by a share of the order of the strain and would show up as
/// energy from nowhere). So the work of the stress itself is kept, and is the elastic energy of the ledger.
pub trait ElasticLaw: Copy + Send + Sync + 'static {
    /// The moduli of the solid.
    fn moduli(&self) -> &Moduli;

    /// Stress after the interval, and volume after it over volume before.
    fn advance(&self, stress: &Stress, by: &Deformation) -> (Stress, Lanes);

    /// Largest eigenvalue of the law's stiffness in the plane, in Pa.
    fn plane_stiffness(&self) -> f64;

    /// Speed of pressure waves in m/s.
    fn sound_speed(&self) -> f64;
}

/// A linear elastic solid.
#[derive(Debug, Clone, Copy)]
pub struct Elastic<L>(pub L);

impl<L: ElasticLaw> Material for Elastic<L> {
    /// Work of the stress per initial volume in Pa.
    type State = Lanes;
    const DISSIPATES: bool = false;

    fn initial(&self) -> Point<Lanes> {
        Point::unstressed(ZERO)
    }

    fn prestressed(&self, stress: Stress) -> Result<Point<Lanes>, String> {
        let mut point = Point::unstressed(self.0.moduli().energy(&stress));
        point.stress = stress;
        Ok(point)
    }

    #[inline(always)]
    fn update(&self, point: &mut Point<Lanes>, by: &Deformation, _per_dt: f64) -> Dissipated {
        let before = point.volume * power(&point.stress, by);
        let (stress, ratio) = self.0.advance(&point.stress, by);
        point.stress = stress;
        point.volume *= ratio;
        // The trapezoidal rule is what the leapfrog of nodes and points does to the same force: the force of t_n acts
        // over half of the interval behind and half of the one ahead.
        point.state += splat(0.5) * (before + point.volume * power(&point.stress, by));
        Dissipated::NOTHING
    }

    #[inline(always)]
    fn stiffness_over_density(&self, point: &Point<Lanes>) -> Lanes {
        point.volume * splat(self.0.plane_stiffness() / self.0.moduli().density)
    }

    fn elastic_energy(&self, point: &Point<Lanes>) -> Lanes {
        point.state
    }

    fn sound_speed(&self) -> f64 {
        self.0.sound_speed()
    }
}

/// No strain out of plane.
#[derive(Debug, Clone, Copy)]
pub struct PlaneStrain(pub Moduli);

impl ElasticLaw for PlaneStrain {
    fn moduli(&self) -> &Moduli {
        &self.0
    }

    #[inline(always)]
    fn advance(&self, stress: &Stress, by: &Deformation) -> (Stress, Lanes) {
        (self.0.trial(stress, by), volume_ratio(by))
    }

    fn plane_stiffness(&self) -> f64 {
        self.0.plane_stiffness()
    }

    fn sound_speed(&self) -> f64 {
        self.0.sound_speed()
    }
}

/// No stress out of plane; the thickness follows.
#[derive(Debug, Clone, Copy)]
pub struct PlaneStress(pub Moduli);

impl PlaneStress {
    /// Strain out of plane over the sum of those in it, negated: `lambda / (lambda + 2G)`.
    fn thinning(&self) -> f64 {
        let lame = self.0.bulk - 2.0 / 3.0 * self.0.shear;
        lame / (lame + 2.0 * self.0.shear)
    }
}

impl ElasticLaw for PlaneStress {
    fn moduli(&self) -> &Moduli {
        &self.0
    }

    #[inline(always)]
    fn advance(&self, stress: &Stress, by: &Deformation) -> (Stress, Lanes) {
        let turned = rotate(stress, by);
        let two_g = splat(2.0 * self.0.shear);
        let mean = two_g * splat(self.thinning()) * (by.xx + by.yy);
        let stress = Stress {
            xx: two_g.mul_add(by.xx, turned.xx + mean),
            yy: two_g.mul_add(by.yy, turned.yy + mean),
            zz: ZERO,
            xy: splat(self.0.shear).mul_add(by.xy + by.yx, turned.xy),
        };
        let trace = (by.xx + by.yy) * splat(1.0 - self.thinning());
        (stress, swelling(trace))
    }

    fn plane_stiffness(&self) -> f64 {
        // Equal stretch: 2 G (1 + 2 thinning); shear: 2 G.
        2.0 * self.0.shear * (1.0 + 2.0 * self.thinning()).max(1.0)
    }

    fn sound_speed(&self) -> f64 {
        (2.0 * self.0.shear * (1.0 + self.thinning()) / self.0.density).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::single_point::{Path, stress};

    const MODULI: Moduli = Moduli {
        bulk: 5.0e5,
        shear: 3.0e5,
        density: 1000.0,
    };

    /// `sigma_yy = (K + 4G/3) ln(h/h_0)` for a rate form: increments of true strain.
    #[test]
    fn uniaxial_strain() {
        let mut path = Path::new(Elastic(PlaneStrain(MODULI)));
        path.stretch([0.0, -0.05], 1000);
        let [xx, yy, zz, xy] = stress(&path.point);
        assert!((yy / ((5.0e5 + 4.0e5) * -0.05) - 1.0).abs() < 1e-12);
        assert!((xx / ((5.0e5 - 2.0e5) * -0.05) - 1.0).abs() < 1e-12);
        assert!((zz / xx - 1.0).abs() < 1e-12 && xy == 0.0);
        let volume = path.point.volume.to_array()[0];
        assert!((volume - (-0.05_f64).exp()).abs() < 1e-8);
        // sigma:eps/2 of the same state.
        let energy = MODULI.energy(&path.point.stress).to_array()[0];
        assert!((energy / (0.5 * yy * -0.05) - 1.0).abs() < 1e-12);
    }

    /// The Jaumann rate in simple shear: `sigma_xy = G sin(gamma)`, `sigma_xx = G (1 - cos(gamma))` (Dienes 1979).
    #[test]
    fn simple_shear() {
        let mut path = Path::new(Elastic(PlaneStrain(MODULI)));
        let steps = 20_000;
        path.shear(2.0, steps);
        let [xx, yy, zz, xy] = stress(&path.point);
        // The increment is added to the stress turned over the whole step: first order in gamma per step.
        let tolerance = 2.0 / steps as f64 * 3.0e5;
        assert!((xy - 3.0e5 * 2.0_f64.sin()).abs() < tolerance);
        assert!((xx - 3.0e5 * (1.0 - 2.0_f64.cos())).abs() < tolerance);
        assert!((yy + xx).abs() < 1e-8 * 3.0e5 && zz.abs() < 1e-8 * 3.0e5);
        assert_eq!(path.point.volume.to_array()[0], 1.0);
    }

    #[test]
    fn stress_turns_with_the_material_and_nothing_else_changes() {
        let mut path = Path::new(Elastic(PlaneStrain(MODULI)));
        path.stretch([0.02, -0.01], 10);
        let [xx, yy, zz, _] = stress(&path.point);
        let energy = MODULI.energy(&path.point.stress).to_array()[0];
        let turns = 3.0 * core::f64::consts::TAU + 0.7;
        path.turn(turns, 40_000);
        let [txx, tyy, tzz, txy] = stress(&path.point);
        let (centre, half) = (0.5 * (xx + yy), 0.5 * (xx - yy));
        // The midpoint rule's angle falls short by (angle per step)^3 / 12 a step.
        assert!((txx - centre - half * 1.4_f64.cos()).abs() < 1e-6 * half);
        assert!((txy - half * 1.4_f64.sin()).abs() < 1e-6 * half);
        assert!((txx + tyy - xx - yy).abs() < 1e-9 * half && tzz == zz);
        assert!((MODULI.energy(&path.point.stress).to_array()[0] / energy - 1.0).abs() < 1e-10);
        assert!((path.point.volume.to_array()[0] - (0.01_f64).exp()).abs() < 1e-6);
    }

    /// `sigma_xx = E eps_xx` where y is free: eps_yy = -nu eps_xx by definition of E and nu.
    #[test]
    fn plane_stress_is_youngs_modulus() {
        let (k, g) = (MODULI.bulk, MODULI.shear);
        let young = 9.0 * k * g / (3.0 * k + g);
        let nu = (3.0 * k - 2.0 * g) / (2.0 * (3.0 * k + g));
        let mut path = Path::new(Elastic(PlaneStress(MODULI)));
        path.stretch([1e-3, -nu * 1e-3], 10);
        let [xx, yy, zz, _] = stress(&path.point);
        assert!((xx / (young * 1e-3) - 1.0).abs() < 1e-12, "{xx}");
        assert!(yy.abs() < 1e-9 * xx && zz == 0.0);
        let volume = path.point.volume.to_array()[0];
        assert!((volume - ((1.0 - 2.0 * nu) * 1e-3).exp()).abs() < 1e-11);
    }

    #[test]
    fn the_plane_stiffness_is_the_largest_eigenvalue() {
        for (bulk, shear) in [(5e5, 3e5), (1e5, 9e5), (1e7, 1e3)] {
            let moduli = Moduli {
                bulk,
                shear,
                density: 1.0,
            };
            let (m, l) = (bulk + 4.0 / 3.0 * shear, bulk - 2.0 / 3.0 * shear);
            let c = nalgebra::Matrix3::new(m, l, 0.0, l, m, 0.0, 0.0, 0.0, 2.0 * shear);
            let exact = c.symmetric_eigenvalues().max();
            assert!((moduli.plane_stiffness() / exact - 1.0).abs() < 1e-12);
        }
    }
}
