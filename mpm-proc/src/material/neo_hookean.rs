//! Compressible Neo-Hookean elasticity (Chen 2023): `W = G/2 (tr b - 3 - 2 ln J) + lambda/2 ln^2 J`.

use super::elastic::Moduli;
use super::model::Material;
use super::point::{Deformation, Dissipated, Point, Stress};
use crate::kernel::lanes::{Lanes, ZERO, splat};

/// Neo-Hookean material in plane strain, with `lambda = K - 2G/3`.
#[derive(Debug, Clone, Copy)]
pub struct NeoHookean(pub Moduli);

impl Material for NeoHookean {
    /// Deformation gradient `F` by rows.
    type State = [[Lanes; 2]; 2];
    const DISSIPATES: bool = false;

    fn initial(&self) -> Point<Self::State> {
        let one = splat(1.0);
        Point::unstressed([[one, ZERO], [ZERO, one]])
    }

    fn prestressed(&self, _stress: Stress) -> Result<Point<Self::State>, String> {
        Err("neo_hookean computes its stress from its deformation; leave out the stress, or use linear_elastic".into())
    }

    /// `F <- (1 + du/dx) F`, `sigma = (G (b - 1) + lambda ln J) / J`. Where the determinant is not above zero the
    /// logarithm is not a number, which the step reports.
    #[inline(always)]
    fn update(&self, point: &mut Point<Self::State>, by: &Deformation, _per_dt: f64) -> Dissipated {
        let by = by.in_the_middle(splat(0.5)); // du/dx at the start
        let [[xx, xy], [yx, yy]] = point.state;
        let f = [
            [
                by.xy.mul_add(yx, by.xx.mul_add(xx, xx)),
                by.xy.mul_add(yy, by.xx.mul_add(xy, xy)),
            ],
            [
                by.yx.mul_add(xx, by.yy.mul_add(yx, yx)),
                by.yx.mul_add(xy, by.yy.mul_add(yy, yy)),
            ],
        ];
        let [[xx, xy], [yx, yy]] = f;
        let j = xx * yy - xy * yx;
        let per_j = splat(1.0) / j;
        let pressure = splat(self.0.lame()) * j.ln() * per_j;
        let g = splat(self.0.shear) * per_j;
        let one = splat(1.0);
        point.stress = Stress {
            xx: g * (xx * xx + xy * xy - one) + pressure,
            yy: g * (yx * yx + yy * yy - one) + pressure,
            zz: pressure,
            xy: g * (xx * yx + xy * yy),
        };
        point.state = f;
        point.volume = j;
        Dissipated::NOTHING
    }

    /// Tangent `lambda/J 1 x 1 + 2 (G - lambda ln J)/J` plus the largest stress, which stiffens transverse motion.
    #[inline(always)]
    fn stiffness_over_density(&self, point: &Point<Self::State>) -> Lanes {
        let s = &point.stress;
        let half = splat(0.5) * (s.xx - s.yy);
        let largest = splat(0.5) * (s.xx + s.yy) + (half * half + s.xy * s.xy).sqrt();
        let twice_shear =
            splat(2.0) * (splat(self.0.shear) - splat(self.0.lame()) * point.volume.ln());
        // J of the tangent and of the density cancel.
        let tangent = (twice_shear + splat(2.0 * self.0.lame())).fast_max(twice_shear);
        let stress = point.volume * largest.fast_max(ZERO);
        (tangent + stress) * splat(1.0 / self.0.density)
    }

    fn elastic_energy(&self, point: &Point<Self::State>) -> Lanes {
        let ln = point.volume.ln();
        let trace = point
            .state
            .as_flattened()
            .iter()
            .fold(splat(1.0), |sum, f| sum + *f * *f);
        splat(0.5 * self.0.shear) * (trace - splat(3.0) - splat(2.0) * ln)
            + splat(0.5 * self.0.lame()) * ln * ln
    }

    fn sound_speed(&self) -> f64 {
        self.0.sound_speed()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::single_point::{Path, stress};

    const MODEL: NeoHookean = NeoHookean(Moduli {
        bulk: 5.0e5,
        shear: 3.0e5,
        density: 1000.0,
    });

    /// `sigma_yy = (G (l^2 - 1) + lambda ln l)/l`, `sigma_xx = lambda ln l / l` at stretch l.
    #[test]
    fn uniaxial_strain() {
        for strain in [-0.7_f64, 0.5] {
            let mut path = Path::new(MODEL);
            path.stretch([0.0, strain], 100);
            // A strain at the middle of a step stretches by its Cayley transform.
            let l = ((1.0 + strain / 200.0) / (1.0 - strain / 200.0)).powi(100);
            let [xx, yy, zz, xy] = stress(&path.point);
            let lame = 3.0e5;
            assert!((yy / ((3.0e5 * (l * l - 1.0) + lame * l.ln()) / l) - 1.0).abs() < 1e-12);
            assert!((xx / (lame * l.ln() / l) - 1.0).abs() < 1e-12);
            assert!(zz == xx && xy == 0.0);
            let energy = 0.5 * 3.0e5 * (l * l - 1.0 - 2.0 * l.ln()) + 0.5 * lame * l.ln().powi(2);
            assert!((MODEL.elastic_energy(&path.point).to_array()[0] / energy - 1.0).abs() < 1e-12);
        }
    }

    /// At a stretch and a shear whose principal stresses follow from the eigenvalues of `b`.
    #[test]
    fn the_stiffness_is_the_tangent_and_the_largest_tension() {
        for (strain, gamma) in [([0.3, -0.1], 0.8), ([-0.2, 0.4], 0.3), ([-0.3, -0.2], 0.1)] {
            let mut path = Path::new(MODEL);
            path.stretch(strain, 1);
            path.shear(gamma, 1);
            let [a, c] = strain.map(|s: f64| (1.0 + 0.5 * s) / (1.0 - 0.5 * s));
            let (xx, xy, yy) = (a * a + (gamma * c).powi(2), gamma * c * c, c * c);
            let largest = 0.5 * (xx + yy) + (0.25 * (xx - yy).powi(2) + xy * xy).sqrt();
            let (g, lame, j) = (3.0e5, 3.0e5, a * c);
            let tension = (g * (largest - 1.0) + lame * j.ln()).max(0.0);
            let expected = (2.0 * (g - lame * j.ln()) + 2.0 * lame + tension) / 1000.0;
            let found = MODEL.stiffness_over_density(&path.point).to_array()[0];
            assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected}");
        }
    }

    #[test]
    fn turned_inside_out_is_not_a_number() {
        let mut path = Path::new(MODEL);
        path.stretch([-2.5, 0.0], 1); // beyond -2 the end is on the other side of the start
        assert!(path.point.stress.xx.to_array()[0].is_nan());
    }
}
