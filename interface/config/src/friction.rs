//! The meaning of a friction angle: the same material fails at a different angle in each test.
//!
//! Mohr-Coulomb fails at its parameter `phi` in plane strain and in triaxial tests. Drucker-Prager's cone `tau + q
//! sigma_m = k` does not use the intermediate stress, so its angle depends on that stress. In plane strain the flow
//! rule determines it: plastic strain `lambda (s/(2 tau) + q_psi/3 1)` without a component out of the plane has `s_zz =
//! -2/3 q_psi tau`, which gives
//!
//! `sin phi' = q sqrt(1 - q_psi^2/3) / (1 - q q_psi/3)`;
//!
//! without dilation `sin phi' = q`. Jiang 2020 eq. 35 takes `q = 3 tan phi / sqrt(9 + 12 tan^2 phi)`, for which `phi' =
//! phi` where the dilation angle is the friction angle too, and less elsewhere: 28.7 degrees of 30 without dilation.
//! The same equation makes `q_psi` that of the dilation angle in plane strain.
//!
//! An infinite slope shears parallel to itself without a strain along it, which turns the stress to where (Davis 1968)
//!
//! `tan theta = sin phi' cos psi / (1 - sin phi' sin psi)`.
//!
//! In triaxial compression and extension `q = 6 sin phi / (sqrt(3) (3 -+ sin phi))`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::capability::word;
use super::fault::ConfigFault;
use super::{Frictional, MaterialModel};

/// The test in which a friction angle was measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FrictionTest {
    /// Flow in plane strain, as of Mohr-Coulomb's material of that angle.
    PlaneStrain,
    /// The angle of repose: the slope at which a long layer begins to flow.
    Repose,
    /// Compression of a cylinder along its axis.
    TriaxialCompression,
    /// Its extension.
    TriaxialExtension,
}

impl FrictionTest {
    /// All of them.
    pub const ALL: [Self; 4] = [
        Self::PlaneStrain,
        Self::Repose,
        Self::TriaxialCompression,
        Self::TriaxialExtension,
    ];

    /// The test in words, to follow "in".
    pub fn words(self) -> String {
        word(&self).replace('_', " ")
    }
}

/// Slope `q` of Drucker-Prager's cone by Jiang 2020 eq. 35; the angle in radians.
pub fn cone_slope(angle: f64) -> f64 {
    3.0 * angle.tan() / cone_root(angle)
}

/// The root of Jiang 2020 eq. 35, `sqrt(9 + 12 tan^2)`; the angle in radians.
pub fn cone_root(angle: f64) -> f64 {
    (9.0 + 12.0 * angle.tan().powi(2)).sqrt()
}

/// The angle in radians whose [`cone_slope`] is `q`; `None` above the largest slope, `sqrt(3)/2`.
fn angle_of_slope(q: f64) -> Option<f64> {
    let rest = 9.0 - 12.0 * q * q;
    (rest > 0.0).then(|| (3.0 * q / rest.sqrt()).atan())
}

/// Sine of the angle in plane strain of a layer that flows on a slope; angles in radians.
fn sine_of_repose(repose: f64, dilation: f64) -> f64 {
    repose.tan() / (dilation.cos() + repose.tan() * dilation.sin())
}

/// The angle in degrees of a sine; `None` if the material does not fail.
fn degrees(sine: f64) -> Option<f64> {
    (0.0..1.0).contains(&sine).then(|| sine.asin().to_degrees())
}

impl MaterialModel {
    /// This model with the friction angle that gives what was measured as `friction_angle` in a test, and with the cohesion
    /// that keeps the largest tension.
    ///
    /// # Errors
    /// The fault, with a key below the model's own: the model has no friction, or it cannot fail at this angle.
    pub fn measured(self, test: FrictionTest) -> Result<Self, ConfigFault> {
        let Some((measured, cone)) = self.frictional() else {
            return Err(ConfigFault {
                key: "friction_test".into(),
                value: self.key(),
                expected: "drucker_prager or mohr_coulomb".into(),
                help: "only these have a friction angle".into(),
            });
        };
        let fault = |expected: &str, help: &str| ConfigFault {
            key: format!("model.{}.friction_angle", self.key()),
            value: measured.friction_angle.to_string(),
            expected: expected.into(),
            help: help.into(),
        };
        let [phi, psi] = [measured.friction_angle, measured.dilation_angle].map(f64::to_radians);
        if !(phi > 0.0 && phi < std::f64::consts::FRAC_PI_2) {
            return Err(fault("above 0 and below 90 degrees", ""));
        }
        let own = if cone {
            let q_psi = cone_slope(psi);
            let of_plane_strain =
                |sine: f64| sine / ((1.0 - q_psi * q_psi / 3.0).sqrt() + sine * q_psi / 3.0);
            let of_triaxial =
                |sign: f64| 6.0 * phi.sin() / (3.0_f64.sqrt() * (3.0 + sign * phi.sin()));
            angle_of_slope(match test {
                FrictionTest::PlaneStrain => of_plane_strain(phi.sin()),
                FrictionTest::Repose => of_plane_strain(sine_of_repose(phi, psi)),
                FrictionTest::TriaxialCompression => of_triaxial(-1.0),
                FrictionTest::TriaxialExtension => of_triaxial(1.0),
            })
        } else {
            match test {
                FrictionTest::Repose => {
                    let sine = sine_of_repose(phi, psi);
                    (sine < 1.0).then(|| sine.asin())
                }
                _ => Some(phi),
            }
        };
        let own = own.ok_or_else(|| {
            let help = if cone {
                "the cone of eq. 35 cannot be that steep, and in plane strain it would hardly fail: use `mohr_coulomb`"
            } else {
                "no material stands so steep"
            };
            fault("an angle that the model can have", help)
        })?;
        let numbers = Frictional {
            friction_angle: own.to_degrees(),
            cohesion: measured.cohesion * own.tan() / phi.tan(),
            ..measured
        };
        Ok(if cone {
            Self::DruckerPrager(numbers)
        } else {
            Self::MohrCoulomb(numbers)
        })
    }

    /// The angle in degrees at which it fails in a test, if it has friction and fails.
    pub fn fails_at(&self, test: FrictionTest) -> Option<f64> {
        let (numbers, cone) = self.frictional()?;
        let [phi, psi] = [numbers.friction_angle, numbers.dilation_angle].map(f64::to_radians);
        let [q, q_psi] = [phi, psi].map(cone_slope);
        let in_plane = if cone {
            q * (1.0 - q_psi * q_psi / 3.0).sqrt() / (1.0 - q * q_psi / 3.0)
        } else {
            phi.sin()
        };
        let root = 3.0_f64.sqrt();
        match test {
            FrictionTest::PlaneStrain => degrees(in_plane),
            FrictionTest::Repose => {
                let tan = in_plane * psi.cos() / (1.0 - in_plane * psi.sin());
                Some(tan.atan().to_degrees())
            }
            _ if !cone => degrees(in_plane),
            FrictionTest::TriaxialCompression => degrees(3.0 * q / (2.0 * root + q)),
            FrictionTest::TriaxialExtension => degrees(3.0 * q / (2.0 * root - q)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sand(phi: f64, psi: f64) -> Frictional {
        Frictional {
            bulk_modulus: 5e5,
            shear_modulus: 3.2e5,
            friction_angle: phi,
            dilation_angle: psi,
            cohesion: 100.0,
            tensile_strength: 0.0,
            critical_state: None,
            separates: false,
        }
    }

    fn own(model: &MaterialModel) -> Frictional {
        match model {
            MaterialModel::DruckerPrager(numbers) | MaterialModel::MohrCoulomb(numbers) => *numbers,
            _ => unreachable!(),
        }
    }

    #[test]
    fn what_was_measured_is_what_it_fails_at() {
        for cone in [MaterialModel::DruckerPrager, MaterialModel::MohrCoulomb] {
            for test in FrictionTest::ALL {
                for (phi, psi) in [(20.0, 0.0), (30.0, 0.0), (30.0, 12.0), (33.0, 33.0)] {
                    let model = cone(sand(phi, psi)).measured(test).unwrap();
                    let fails = model.fails_at(test).unwrap();
                    assert!((fails - phi).abs() < 1e-10, "{model:?} {test:?}: {fails}");
                    let apex = own(&model).cohesion / own(&model).friction_angle.to_radians().tan();
                    let expected = 100.0 / phi.to_radians().tan();
                    assert!((apex / expected - 1.0).abs() < 1e-12);
                }
            }
        }
    }

    /// Without dilation, 30 degrees in eq. 35 are 28.7 degrees in plane strain and an angle of repose of 25.7. An angle
    /// of repose of 30 degrees needs 37.76 in eq. 35, or 35.26 with Mohr-Coulomb.
    #[test]
    fn thirty_degrees_are_not_thirty_degrees() {
        let printed = MaterialModel::DruckerPrager(sand(30.0, 0.0));
        let plane = printed.fails_at(FrictionTest::PlaneStrain).unwrap();
        assert!((plane - 28.711).abs() < 1e-3, "{plane}");
        let slope = printed.fails_at(FrictionTest::Repose).unwrap();
        assert!((slope - 25.659).abs() < 1e-3, "{slope}");
        let angle = |model: MaterialModel| {
            own(&model.measured(FrictionTest::Repose).unwrap()).friction_angle
        };
        let cone = angle(printed);
        assert!((cone - 37.761).abs() < 1e-3, "{cone}");
        let surface = angle(MaterialModel::MohrCoulomb(sand(30.0, 0.0)));
        assert!((surface - 35.264).abs() < 1e-3, "{surface}");
        // If the dilation angle equals the friction angle, eq. 35 is exact in plane strain.
        let associated = MaterialModel::DruckerPrager(sand(30.0, 30.0));
        let plane = associated.fails_at(FrictionTest::PlaneStrain).unwrap();
        assert!((plane - 30.0).abs() < 1e-12);
    }
}
