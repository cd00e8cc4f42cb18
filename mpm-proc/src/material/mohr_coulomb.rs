//! Mohr-Coulomb plasticity in plane strain with tension cut-off (Singer 2022, Chen 2023), returned in principal stresses
//! (Clausen, Damkilde and Andersen 2006).

use interface::config::material::Frictional;

use super::elastic::Moduli;
use super::perfect_plasticity::YieldSurface;
use super::point::Stress;
use crate::kernel::lanes::{Lanes, ZERO, splat};

/// Mohr-Coulomb material: `k sigma_1 - sigma_3 = sigma_c` with `k = (1 + sin phi)/(1 - sin phi)`,
/// `sigma_c = 2 c sqrt(k)`, tension positive, and no principal stress above `sigma_t`.
#[derive(Debug, Clone, Copy)]
pub struct MohrCoulomb {
    /// Elastic part.
    pub moduli: Moduli,
    k: f64,
    sigma_c: f64,
    /// The smaller of the tensile strength and the apex, in Pa.
    sigma_t: f64,
    /// `D b / (a D b)` of the surface between the largest and the smallest stress.
    plane: [f64; 3],
    /// `D b` of the surfaces (1, 3), (2, 3) and (1, 2).
    flow: [[f64; 3]; 3],
    /// Inverse of `a_i D b_j` for the edges of surfaces (1, 3) with (2, 3), and (1, 3) with (1, 2).
    edge: [[[f64; 2]; 2]; 2],
}

/// The two principal stresses in each surface: the first is multiplied by k, the second by -1.
const SURFACES: [[usize; 2]; 3] = [[0, 2], [1, 2], [0, 1]];

impl MohrCoulomb {
    /// Initial density in kg/m^3.
    pub fn new(density: f64, material: &Frictional) -> Self {
        let moduli = Moduli::of(density, material);
        let phi = material.friction_angle.to_radians();
        let psi = material.dilation_angle.to_radians();
        let ratio = |angle: f64| (1.0 + angle.sin()) / (1.0 - angle.sin());
        let (k, m) = (ratio(phi), ratio(psi));
        let sigma_c = 2.0 * material.cohesion * k.sqrt();
        let apex = if k > 1.0 {
            sigma_c / (k - 1.0)
        } else {
            f64::MAX
        };
        let lame = moduli.lame();
        let flow = SURFACES.map(|[i, j]| {
            let mut b = [0.0; 3];
            (b[i], b[j]) = (m, -1.0);
            b.map(|x| lame * (m - 1.0) + 2.0 * moduli.shear * x)
        });
        let along = |s: usize, v: [f64; 3]| k * v[SURFACES[s][0]] - v[SURFACES[s][1]];
        let edge = [1, 2].map(|other| {
            let [a, b] = [along(0, flow[0]), along(0, flow[other])];
            let [c, d] = [along(other, flow[0]), along(other, flow[other])];
            let det = a * d - b * c;
            [[d / det, -b / det], [-c / det, a / det]]
        });
        Self {
            moduli,
            k,
            sigma_c,
            sigma_t: material.tensile_strength.min(apex),
            plane: flow[0].map(|x| x / along(0, flow[0])),
            flow,
            edge,
        }
    }

    /// Returns ordered principal stresses to the surfaces.
    ///
    /// The return to one surface is valid if it keeps the order of the stresses. If it would pass another stress, the
    /// stress returns to the edge of the two surfaces. What then exceeds the tensile strength is cut off, for each
    /// stress by itself; this includes stresses beyond the apex.
    #[inline(always)]
    fn return_principal(&self, p: [Lanes; 3]) -> [Lanes; 3] {
        let excess = |s: usize| {
            let [i, j] = SURFACES[s];
            p[i].mul_sub(splat(self.k), p[j] + splat(self.sigma_c))
        };
        let f = excess(0);
        let yields = f.simd_gt(ZERO);
        let by_plane = [0, 1, 2].map(|i| f.mul_neg_add(splat(self.plane[i]), p[i]));
        let by_edge = |edge: usize| {
            let g = excess(edge + 1);
            let [[a, b], [c, d]] = self.edge[edge];
            let first = splat(a) * f + splat(b) * g;
            let second = splat(c) * f + splat(d) * g;
            [0, 1, 2].map(|i| {
                p[i] - splat(self.flow[0][i]) * first - splat(self.flow[edge + 1][i]) * second
            })
        };
        let (high, low) = (by_edge(0), by_edge(1));
        let passes_high = by_plane[1].simd_gt(by_plane[0]);
        let passes_low = by_plane[2].simd_gt(by_plane[1]);
        [0, 1, 2].map(|i| {
            let edge = passes_high.select(high[i], passes_low.select(low[i], by_plane[i]));
            yields.select(edge, p[i]).fast_min(splat(self.sigma_t))
        })
    }
}

impl YieldSurface for MohrCoulomb {
    fn moduli(&self) -> &Moduli {
        &self.moduli
    }

    /// Its dilation has no critical state.
    #[inline(always)]
    fn flow(
        &self,
        trial: &Stress,
        _volume: Lanes,
        _share: Option<Lanes>,
        _per_dt: f64,
    ) -> (Stress, Lanes) {
        let centre = splat(0.5) * (trial.xx + trial.yy);
        let half = splat(0.5) * (trial.xx - trial.yy);
        let radius = half.mul_add(half, trial.xy * trial.xy).sqrt();
        let (high, low, z) = (centre + radius, centre - radius, trial.zz);
        let z_first = z.simd_gt(high);
        let z_last = z.simd_lt(low);
        let p = [
            z_first.select(z, high),
            z_first.select(high, z_last.select(low, z)),
            z_last.select(z, low),
        ];
        let q = self.return_principal(p);
        let new_high = z_first.select(q[1], q[0]);
        let new_low = z_last.select(q[1], q[2]);
        let zz = z_first.select(q[0], z_last.select(q[2], q[1]));

        let lost = [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
        let mean = (lost[0] + lost[1] + lost[2]) * splat(1.0 / 3.0);
        let volumetric = mean * splat(1.0 / (3.0 * self.moduli.bulk));
        let mut work = ZERO;
        for i in 0..3 {
            let strain = (lost[i] - mean) * splat(0.5 / self.moduli.shear) + volumetric;
            work = q[i].mul_add(strain, work);
        }

        let new_centre = splat(0.5) * (new_high + new_low);
        let ratio = splat(0.5) * (new_high - new_low) / radius.fast_max(splat(f64::MIN_POSITIVE));
        let stress = Stress {
            xx: half.mul_add(ratio, new_centre),
            yy: half.mul_neg_add(ratio, new_centre),
            zz,
            xy: trial.xy * ratio,
        };
        (stress, work)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::point::Point;
    use crate::material::single_point::{Path, stress};

    const MODULI: Moduli = Moduli {
        bulk: 5.0e5,
        shear: 3.0e5,
        density: 1500.0,
    };

    fn material(phi: f64, psi: f64, cohesion: f64, tension: f64) -> MohrCoulomb {
        let numbers = Frictional {
            bulk_modulus: MODULI.bulk,
            shear_modulus: MODULI.shear,
            friction_angle: phi,
            dilation_angle: psi,
            cohesion,
            tensile_strength: tension,
            critical_state: None,
            separates: false,
        };
        MohrCoulomb::new(MODULI.density, &numbers)
    }

    fn principal(point: &Point<()>) -> [f64; 3] {
        let [xx, yy, zz, xy] = stress(point);
        let (centre, radius) = (0.5 * (xx + yy), (0.25 * (xx - yy).powi(2) + xy * xy).sqrt());
        let mut p = [centre + radius, centre - radius, zz];
        p.sort_by(|a, b| b.total_cmp(a));
        p
    }

    /// Biaxial compression from an even stress: yields at `sigma_3 = k sigma_1 - sigma_c`, and with psi = 0 the volume
    /// stays elastic.
    #[test]
    fn biaxial_compression_follows_the_surface() {
        let model = material(30.0, 0.0, 2.0e3, 0.0);
        let mut path = Path::new(model);
        path.stretch([-0.01, -0.01], 50);
        path.stretch([0.02, -0.02], 2000);
        let [p1, _, p3] = principal(&path.point);
        assert!(
            (3.0 * p1 - p3 - 4.0e3 * 3.0_f64.sqrt()).abs() < 1e-6,
            "{p1} {p3}"
        );
        let [xx, yy, zz, _] = stress(&path.point);
        let mean = (xx + yy + zz) / 3.0;
        let volume = path.point.volume.to_array()[0];
        let expected = MODULI.bulk * volume.ln() / volume;
        assert!((mean / expected - 1.0).abs() < 1e-10, "{mean}");
        assert!(path.plastic > 0.0);
    }

    /// `sin phi` from the Mohr circle in simple shear, whatever the direction.
    #[test]
    fn the_mohr_circle_touches_the_line() {
        let model = material(35.0, 10.0, 0.0, 0.0);
        let mut path = Path::new(model);
        path.stretch([-0.01, -0.012], 50);
        path.shear(0.05, 5000);
        let [p1, _, p3] = principal(&path.point);
        let sin = (p1 - p3) / -(p1 + p3);
        assert!((sin - 35.0_f64.to_radians().sin()).abs() < 1e-12, "{sin}");
    }

    /// Against the definition: no random trial ends outside, nothing inside is touched, and the plastic strain obeys
    /// the flow rule of some mixture of surfaces (it does no negative work).
    #[test]
    fn random_trials_end_on_the_surfaces() {
        let mut random = fastrand::Rng::with_seed(5);
        for (psi, tension) in [(0.0, 0.0), (20.0, 1e3), (35.0, 4e3)] {
            let model = material(35.0, psi, 3.0e3, tension);
            for _ in 0..5000 {
                let mut value = || splat(3e4 * random.f64() - 2e4);
                let trial = Stress {
                    xx: value(),
                    yy: value(),
                    zz: value(),
                    xy: value(),
                };
                let (new, _) = model.flow(&trial, splat(1.0), None, 0.0);
                let order = |s: Stress| {
                    principal(&Point {
                        stress: s,
                        volume: splat(1.0),
                        state: (),
                    })
                };
                let (p, q) = (order(trial), order(new));
                let f = |s: [f64; 3]| model.k * s[0] - s[2] - model.sigma_c;
                assert!(f(q) < 1e-6 && q[0] <= model.sigma_t + 1e-6, "{p:?} {q:?}");
                if f(p) < 0.0 && p[0] < model.sigma_t {
                    assert!((0..3).all(|i| (p[i] - q[i]).abs() < 1e-9));
                }
            }
        }
    }

    #[test]
    fn sand_pulled_apart_has_no_stress() {
        let mut path = Path::new(material(35.0, 10.0, 0.0, 0.0));
        path.shear(0.01, 10);
        path.stretch([0.02, 0.03], 3);
        assert!(stress(&path.point).iter().all(|s| s.abs() < 1e-9));
    }
}
