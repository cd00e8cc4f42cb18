//! Weakly compressible Newtonian fluid (Chen 2023): `p = K/gamma (J^-gamma - 1)`, `J = rho_0/rho`.

use super::model::Material;
use super::point::{Deformation, Dissipated, Point, Stress, swelling};
use crate::kernel::lanes::{Lanes, ZERO, splat};

/// A fluid.
#[derive(Debug, Clone, Copy)]
pub struct Fluid {
    /// K in Pa.
    pub bulk: f64,
    /// gamma, at least 1.
    pub exponent: f64,
    /// mu in Pa s.
    pub viscosity: f64,
    /// Initial density in kg/m^3.
    pub density: f64,
}

impl Fluid {
    /// `J^-gamma`.
    #[inline(always)]
    fn power(&self, volume: Lanes) -> Lanes {
        (splat(-self.exponent) * volume.ln()).exp()
    }

    /// `K/gamma (J^-gamma - 1)` in Pa.
    #[inline(always)]
    fn pressure(&self, point: &Point<Lanes>) -> Lanes {
        splat(self.bulk / self.exponent) * (self.power(point.volume * point.state) - splat(1.0))
    }
}

impl Material for Fluid {
    /// `J` at the start: the mass of a point is that of its initial volume at the configured density, whatever its pressure.
    type State = Lanes;
    const DISSIPATES: bool = true;

    fn initial(&self) -> Point<Lanes> {
        Point::unstressed(splat(1.0))
    }

    /// Begins at the `J` that has the pressure.
    fn prestressed(&self, stress: Stress) -> Result<Point<Lanes>, String> {
        let [xx, yy, zz, xy] =
            [stress.xx, stress.yy, stress.zz, stress.xy].map(|s| s.to_array()[0]);
        let base = 1.0 - self.exponent * xx / self.bulk;
        if xx != yy || yy != zz || xy != 0.0 || base <= 0.0 {
            return Err(
                "a fluid at rest has the same stress in all directions and no shear".into(),
            );
        }
        let mut point = self.initial();
        point.state = splat(base.powf(-1.0 / self.exponent));
        let pressure = self.pressure(&point);
        [point.stress.xx, point.stress.yy, point.stress.zz] = [-pressure; 3]; // to the bit that of its `J`
        Ok(point)
    }

    #[inline(always)]
    fn update(&self, point: &mut Point<Lanes>, by: &Deformation, per_dt: f64) -> Dissipated {
        if per_dt == 0.0 {
            return Dissipated::NOTHING; // an interval of no length keeps the stress of the one before
        }
        point.volume *= swelling(by.xx + by.yy);
        let pressure = self.pressure(point);
        // 2 mu dev(D)
        let mean = (by.xx + by.yy) * splat(1.0 / 3.0);
        let twice_mu = splat(2.0 * self.viscosity * per_dt);
        let [x, y, z] = [by.xx - mean, by.yy - mean, -mean];
        let shear = splat(0.5) * (by.xy + by.yx);
        point.stress = Stress {
            xx: twice_mu.mul_sub(x, pressure),
            yy: twice_mu.mul_sub(y, pressure),
            zz: twice_mu.mul_sub(z, pressure),
            xy: twice_mu * shear,
        };
        let square = x * x + y * y + z * z + splat(2.0) * shear * shear;
        Dissipated {
            plastic: ZERO,
            viscous: twice_mu * square * point.volume,
        }
    }

    /// `2 rho c^2 = 2 K J^-gamma`.
    #[inline(always)]
    fn stiffness_over_density(&self, point: &Point<Lanes>) -> Lanes {
        let pressure = splat(-1.0 / 3.0) * (point.stress.xx + point.stress.yy + point.stress.zz);
        let tangent = splat(self.exponent).mul_add(pressure, splat(self.bulk));
        tangent * point.volume * splat(2.0 / self.density)
    }

    fn viscosity_over_density(&self) -> f64 {
        2.0 * self.viscosity / self.density
    }

    /// `-int p dJ` from `J = 1` on, over `J` at the start.
    fn elastic_energy(&self, point: &Point<Lanes>) -> Lanes {
        let j = point.volume * point.state;
        let grows = if self.exponent > 1.0 {
            (self.power(j) * j - splat(1.0)) * splat(1.0 / (self.exponent - 1.0))
        } else {
            -j.ln()
        };
        splat(self.bulk / self.exponent) * (grows + j - splat(1.0)) / point.state
    }

    fn sound_speed(&self) -> f64 {
        (self.bulk / self.density).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::single_point::{Path, stress};

    const WATER: Fluid = Fluid {
        bulk: 3.0e4,
        exponent: 7.0,
        viscosity: 8.9e-4,
        density: 997.0,
    };

    #[test]
    fn pressure_follows_the_equation_of_state() {
        for (strain, exponent) in [(-0.05, 7.0), (0.03, 7.0), (-0.05, 1.0)] {
            let fluid = Fluid {
                exponent,
                viscosity: 0.0,
                ..WATER
            };
            let mut path = Path::new(fluid);
            path.stretch([strain, strain], 10_000);
            let j = path.point.volume.to_array()[0];
            assert!((j / (2.0 * strain).exp() - 1.0).abs() < 1e-8);
            let p = 3.0e4 / exponent * (j.powf(-exponent) - 1.0);
            let [xx, yy, zz, xy] = stress(&path.point);
            assert!((xx / -p - 1.0).abs() < 1e-11 && xx == yy && yy == zz && xy == 0.0);
            // 2 c^2, with rho c^2 = K J^-gamma and rho = rho_0 / J.
            let stiffness = fluid.stiffness_over_density(&path.point).to_array()[0];
            let twice = 2.0 * 3.0e4 * j.powf(1.0 - exponent) / 997.0;
            assert!((stiffness / twice - 1.0).abs() < 1e-10);
            // The work of the pressure, by Simpson's rule.
            let n = 1000;
            let pressure = |j: f64| 3.0e4 / exponent * (j.powf(-exponent) - 1.0);
            let h = (j - 1.0) / f64::from(n);
            let work: f64 = (0..n)
                .map(|i| {
                    let a = 1.0 + h * f64::from(i);
                    -h / 6.0 * (pressure(a) + 4.0 * pressure(a + 0.5 * h) + pressure(a + h))
                })
                .sum();
            let energy = fluid.elastic_energy(&path.point).to_array()[0];
            assert!((energy / work - 1.0).abs() < 1e-9, "{energy} {work}");
        }
    }

    /// The pressure acts on the volume that its mass has at the configured density.
    #[test]
    fn a_point_under_pressure_begins_with_its_initial_volume() {
        let [pressure, j] = [6.0e3_f64, 2.4_f64.powf(-1.0 / 7.0)];
        let stress = Stress {
            xx: splat(-pressure),
            yy: splat(-pressure),
            zz: splat(-pressure),
            xy: ZERO,
        };
        let mut point = WATER.prestressed(stress).unwrap();
        let before = WATER.elastic_energy(&point).to_array()[0];
        assert!(point.volume.to_array()[0] == 1.0);
        let swells = Deformation {
            xx: splat(1.0e-4),
            ..Deformation::NOTHING
        };
        WATER.update(&mut point, &swells, 1.0);
        let p = 3.0e4 / 7.0 * ((j * 1.0e-4_f64.exp()).powf(-7.0) - 1.0);
        assert!((-point.stress.mean().to_array()[0] / p - 1.0).abs() < 1e-9);
        let work = before - WATER.elastic_energy(&point).to_array()[0];
        assert!(
            (work / (0.5e-4 * (p + pressure)) - 1.0).abs() < 1e-4,
            "{work}"
        );
    }

    #[test]
    fn turning_makes_no_stress() {
        let mut path = Path::new(WATER);
        path.turn(0.5, 10);
        assert!(stress(&path.point) == [0.0; 4] && path.viscous == 0.0);
    }

    /// `tau = mu gamma'`, lost at `tau gamma'`.
    #[test]
    fn simple_shear_is_newtonian() {
        let mut path = Path::new(WATER);
        path.shear(2.0, 100); // 0.02 a step of Path::DT
        let rate = 0.02 / crate::material::single_point::DT;
        let [xx, _, _, xy] = stress(&path.point);
        assert!((xy / (8.9e-4 * rate) - 1.0).abs() < 1e-12 && xx.abs() < 1e-12);
        assert!((path.viscous / (8.9e-4 * rate * 2.0) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn an_interval_of_no_length_keeps_the_stress() {
        let mut path = Path::new(WATER);
        path.shear(0.02, 1);
        let before = stress(&path.point);
        WATER.update(&mut path.point, &Deformation::NOTHING, 0.0);
        assert!(before[3] > 0.0 && stress(&path.point) == before);
    }
}
