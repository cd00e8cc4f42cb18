//! Elasticity with an energy: Hencky's, which is linear in the logarithmic strain ([`super::hencky`]; `docs/decisions/0017-hencky.md`).

use interface::config::material::Frictional;

use super::hencky::strain;
use super::model::Material;
use super::point::{Deformation, Dissipated, Point, Stress};
use crate::kernel::lanes::{Lanes, ZERO, splat};

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

    /// `lambda = K - 2G/3` in Pa.
    pub fn lame(&self) -> f64 {
        self.bulk - 2.0 / 3.0 * self.shear
    }

    /// Stress, and volume over the initial one, after an interval in plane strain without plastic flow.
    #[inline(always)]
    pub fn trial(&self, stress: &Stress, volume: Lanes, by: &Deformation) -> (Stress, Lanes) {
        let strained = strain(self.shear, in_plane(stress, volume), volume, by);
        let centre = splat(self.bulk + 1.0 / 3.0 * self.shear) * strained.trace;
        let centre = (splat(0.5) * (stress.xx + stress.yy)).mul_add(volume, centre);
        let out = stress
            .zz
            .mul_add(volume, splat(self.lame()) * strained.trace);
        let stress = cauchy(centre, strained.deviator, out, strained.per_volume);
        (stress, strained.volume)
    }

    /// Energy per volume in Pa: `p^2 / 2K + s:s / 4G`. Of Kirchhoff stress it is Hencky's, per initial volume.
    #[inline(always)]
    pub fn energy(&self, stress: &Stress) -> Lanes {
        let (mean, deviator) = stress.split();
        mean * mean * splat(0.5 / self.bulk) + deviator.squared() * splat(0.25 / self.shear)
    }

    /// Energy stored per initial volume in Pa, of Cauchy stress and volume over the initial one.
    #[inline(always)]
    pub fn stored(&self, stress: &Stress, volume: Lanes) -> Lanes {
        self.energy(stress) * volume * volume
    }

    /// Stiffness that counts for the step in plane strain, per initial volume in Pa ([`Material::stiffness_over_density`]).
    #[inline(always)]
    pub fn stiffness(&self, stress: &Stress, volume: Lanes) -> Lanes {
        under_stress(self.plane_stiffness(), stress, volume)
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

/// `sigma : D dt` in Pa.
#[inline(always)]
pub fn power(s: &Stress, by: &Deformation) -> Lanes {
    s.xx * by.xx + s.yy * by.yy + s.xy * (by.xy + by.yx)
}

/// Half the difference of the normal Kirchhoff stresses, and the shear, in Pa.
#[inline(always)]
fn in_plane(stress: &Stress, volume: Lanes) -> [Lanes; 2] {
    [
        splat(0.5) * (stress.xx - stress.yy) * volume,
        stress.xy * volume,
    ]
}

/// Cauchy stress of a Kirchhoff stress; `per` is one over the volume.
#[inline(always)]
fn cauchy(centre: Lanes, [half, xy]: [Lanes; 2], out: Lanes, per: Lanes) -> Stress {
    Stress {
        xx: (centre + half) * per,
        yy: (centre - half) * per,
        zz: out * per,
        xy: xy * per,
    }
}

/// Upper bound of the stiffness of [`Material::stiffness_over_density`] in Pa, per initial volume, for a law whose
/// stiffness without stress is `unstressed`.
///
/// In principal axes the tangent of the Kirchhoff stress is that of small strains less `2 tau_i` for stretch, and `G x coth x -
/// (tau_1 + tau_2)/2` for shear, `x` the difference of the strains; `x coth x <= 1 + x` and `G x` is half the difference of
/// the stresses. Tension stiffens motion across it besides.
#[inline(always)]
fn under_stress(unstressed: f64, stress: &Stress, volume: Lanes) -> Lanes {
    // This counts radius and centre twice, which gives an upper bound without a root.
    let radius = (stress.xx - stress.yy).abs() + (stress.xy + stress.xy).abs();
    let centre = stress.xx + stress.yy;
    let tension = (centre + radius).fast_max(ZERO);
    let more = splat(0.5).mul_add(tension, radius - centre);
    volume.mul_add(more, splat(unstressed))
}

/// No strain out of plane.
#[derive(Debug, Clone, Copy)]
pub struct PlaneStrain(pub Moduli);

impl Material for PlaneStrain {
    type State = ();
    const DISSIPATES: bool = false;

    #[inline(always)]
    fn update(&self, point: &mut Point<()>, by: &Deformation, _per_dt: f64) -> Dissipated {
        (point.stress, point.volume) = self.0.trial(&point.stress, point.volume, by);
        Dissipated::NOTHING
    }

    #[inline(always)]
    fn stiffness_over_density(&self, point: &Point<()>) -> Lanes {
        self.0.stiffness(&point.stress, point.volume) * splat(1.0 / self.0.density)
    }

    fn elastic_energy(&self, point: &Point<()>) -> Lanes {
        self.0.stored(&point.stress, point.volume)
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
    pub fn thinning(&self) -> f64 {
        self.0.lame() / (self.0.lame() + 2.0 * self.0.shear)
    }

    /// Largest eigenvalue of the stiffness in the plane at small strains in Pa. Equal stretch: `2 G (1 + 2 thinning)`;
    /// shear: 2 G.
    pub fn plane_stiffness(&self) -> f64 {
        2.0 * self.0.shear * (1.0 + 2.0 * self.thinning()).max(1.0)
    }
}

impl Material for PlaneStress {
    type State = ();
    const DISSIPATES: bool = false;

    #[inline(always)]
    fn update(&self, point: &mut Point<()>, by: &Deformation, _per_dt: f64) -> Dissipated {
        let Point { stress, volume, .. } = *point;
        let strained = strain(self.0.shear, in_plane(&stress, volume), volume, by);
        let new = volume * (splat(1.0 - self.thinning()) * strained.trace).exp();
        let centre = splat(self.0.shear * (1.0 + 2.0 * self.thinning())) * strained.trace;
        let centre = (splat(0.5) * (stress.xx + stress.yy)).mul_add(volume, centre);
        let per = splat(1.0) / new;
        point.stress = cauchy(centre, strained.deviator, ZERO, per);
        point.volume = new;
        Dissipated::NOTHING
    }

    #[inline(always)]
    fn stiffness_over_density(&self, point: &Point<()>) -> Lanes {
        let stiffness = under_stress(self.plane_stiffness(), &point.stress, point.volume);
        stiffness * splat(1.0 / self.0.density)
    }

    fn elastic_energy(&self, point: &Point<()>) -> Lanes {
        self.0.stored(&point.stress, point.volume)
    }

    fn sound_speed(&self) -> f64 {
        (2.0 * self.0.shear * (1.0 + self.thinning()) / self.0.density).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::single_point::{Path, cayley, stress};

    const MODULI: Moduli = Moduli {
        bulk: 5.0e5,
        shear: 3.0e5,
        density: 1000.0,
    };

    /// `rho c^2 = K + 4G/3` without strain out of plane, `E / (1 - nu^2)` without stress there.
    #[test]
    fn pressure_waves_have_the_speed_of_their_plane() {
        let (k, g) = (MODULI.bulk, MODULI.shear);
        let young = 9.0 * k * g / (3.0 * k + g);
        let nu = (3.0 * k - 2.0 * g) / (2.0 * (3.0 * k + g));
        let strain = PlaneStrain(MODULI).sound_speed();
        assert!((1000.0 * strain * strain / 9.0e5 - 1.0).abs() < 1e-12);
        let stress = PlaneStress(MODULI).sound_speed();
        assert!((1000.0 * stress * stress / (young / (1.0 - nu * nu)) - 1.0).abs() < 1e-12);
    }

    /// `tau_xx = E eps_xx` where y is free: eps_yy = -nu eps_xx by definition of E and nu, at any strain.
    #[test]
    fn plane_stress_is_youngs_modulus() {
        let (k, g) = (MODULI.bulk, MODULI.shear);
        let young = 9.0 * k * g / (3.0 * k + g);
        let nu = (3.0 * k - 2.0 * g) / (2.0 * (3.0 * k + g));
        for strain in [1e-3, 0.3] {
            let mut path = Path::new(PlaneStress(MODULI));
            path.stretch([strain, -nu * strain], 1000);
            let ln = cayley(strain, 1000).ln();
            let [xx, yy, zz, _] = stress(&path.point);
            let volume = path.point.volume.to_array()[0];
            assert!((xx * volume / (young * ln) - 1.0).abs() < 1e-8, "{xx}");
            assert!(yy.abs() < 1e-7 * xx && zz == 0.0);
            assert!((volume.ln() / ((1.0 - 2.0 * nu) * ln) - 1.0).abs() < 1e-7);
            assert!((path.energy() / (0.5 * young * ln * ln) - 1.0).abs() < 1e-7);
        }
    }

    /// The tangent in principal axes, from derivatives of `tau_i = lambda tr + 2 G ln(l_i)`, and the tension beside it.
    #[test]
    fn the_stiffness_is_not_below_that_of_the_strained_material() {
        let mut random = fastrand::Rng::with_seed(11);
        let (m, l) = (9.0e5, 3.0e5);
        for _ in 0..5000 {
            let [a, b] = [(); 2].map(|()| random.f64() - 0.5);
            let [p, q] = [m * a + l * b, l * a + m * b];
            let (sin, cos) = (3.2 * random.f64()).sin_cos();
            let volume = (a + b).exp();
            let [xx, yy, xy] = [
                p * cos * cos + q * sin * sin,
                p * sin * sin + q * cos * cos,
                (p - q) * sin * cos,
            ]
            .map(|tau| splat(tau / volume));
            let stress = Stress {
                xx,
                yy,
                zz: splat(l * (a + b) / volume),
                xy,
            };
            let stretch = nalgebra::Matrix2::new(m - 2.0 * p, l, l, m - 2.0 * q);
            let shear = 3.0e5 * (a - b) / (a - b).tanh() - 0.5 * (p + q);
            let exact = stretch.symmetric_eigenvalues().max().max(2.0 * shear);
            let exact = exact + p.max(q).max(0.0);
            let bound = MODULI.stiffness(&stress, splat(volume)).to_array()[0];
            assert!(bound >= exact * (1.0 - 1e-12), "{a} {b}: {bound} {exact}");
            assert!(bound < 1.6 * exact.max(5e5), "{a} {b}: {bound} {exact}");
        }
    }

    #[test]
    fn turned_inside_out_is_not_a_number() {
        let mut path = Path::new(PlaneStrain(MODULI));
        path.stretch([-2.5, 0.0], 1); // beyond -2 the end is on the other side of the start
        assert!(path.point.stress.xx.to_array()[0].is_nan());
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
