//! Linear elasticity with the Jaumann rate (Jiang 2020 eqs. 25, 36; PHYSICS.md section 1).

use super::{Deformation, Material, Point, Stress};
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

/// Volume after the interval over volume before: `exp(tr D dt)` to second order, positive whatever the step.
#[inline(always)]
pub fn volume_ratio(by: &Deformation) -> Lanes {
    let trace = by.xx + by.yy;
    trace.mul_add(trace.mul_add(splat(0.5), splat(1.0)), splat(1.0))
}

/// Linear elasticity in plane strain.
#[derive(Debug, Clone, Copy)]
pub struct LinearElastic(pub Moduli);

impl Material for LinearElastic {
    type State = ();

    fn initial(&self) -> Point<()> {
        Point {
            stress: Stress {
                xx: ZERO,
                yy: ZERO,
                zz: ZERO,
                xy: ZERO,
            },
            volume: splat(1.0),
            state: (),
        }
    }

    #[inline(always)]
    fn update(&self, point: &mut Point<()>, by: &Deformation) {
        point.stress = self.0.trial(&point.stress, by);
        point.volume *= volume_ratio(by);
    }

    #[inline(always)]
    fn stiffness_over_density(&self, point: &Point<()>) -> Lanes {
        point.volume * splat(self.0.plane_stiffness() / self.0.density)
    }

    fn elastic_energy(&self, point: &Point<()>) -> Lanes {
        self.0.energy(&point.stress) * point.volume
    }

    fn sound_speed(&self) -> f64 {
        self.0.sound_speed()
    }
}
