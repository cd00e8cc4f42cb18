//! Materials of the continuum, and what their numbers may be: a scene and a solver check by the same rule.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::capability::word;
use super::fault::{ConfigFault, Faults};

/// A material of the continuum.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MaterialConfig {
    /// Name, by which point groups refer to it.
    pub name: String,
    /// Initial density in kg/m^3 (unit thickness).
    pub density: f64,
    /// Constitutive model.
    pub model: MaterialModel,
}

/// Constitutive model (docs/physics.md section 6). Moduli and stresses in Pa, angles in degrees.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum MaterialModel {
    /// Elasticity that is linear in the logarithmic strain (Hencky), with an energy of its own: Kirchhoff stress `K tr(eps) 1 +
    /// 2 G dev(eps)`. For strains up to a third; beyond, `neo_hookean`.
    LinearElastic(Elasticity),
    /// Linear elasticity in rate form, with the Jaumann rate of the Cauchy stress (Jiang 2020 eqs. 25, 36), as in the paper. It has
    /// no energy: cycles of volume and shear create or lose some.
    Hypoelastic(Elasticity),
    /// Drucker-Prager with tension cut-off and dilation (Jiang 2020 eqs. 31 to 35), in Cauchy stress; elastic as `linear_elastic`.
    DruckerPrager(Frictional),
    /// Mohr-Coulomb with tension cut-off, plane strain (Singer 2022, Chen 2023), in Cauchy stress; elastic as `linear_elastic`.
    MohrCoulomb(Frictional),
    /// Compressible Neo-Hookean (Chen 2023).
    NeoHookean(Elasticity),
    /// Weakly compressible Newtonian fluid (Chen 2023): `p = K/gamma ((rho/rho_0)^gamma - 1)`.
    Fluid {
        /// K in Pa.
        bulk_modulus: f64,
        /// gamma.
        exponent: f64,
        /// mu in Pa s.
        viscosity: f64,
    },
    /// The mu(I) rheology of dense granular flow (Jop, Forterre and Pouliquen 2006), at constant volume where grains touch and without
    /// stress where they do not (Dunatunga and Kamrin 2015); elastic as `linear_elastic`.
    MuI(Inertial),
    /// Von Mises plasticity with linear isotropic hardening (Bardenhagen 2000), in Cauchy stress; elastic as `linear_elastic`.
    VonMises {
        /// K in Pa.
        bulk_modulus: f64,
        /// G in Pa.
        shear_modulus: f64,
        /// Initial yield stress in uniaxial tension in Pa.
        yield_stress: f64,
        /// Hardening modulus in Pa.
        hardening_modulus: f64,
    },
}

impl Default for MaterialModel {
    /// No stiffness.
    fn default() -> Self {
        Self::LinearElastic(Elasticity::default())
    }
}

/// The moduli of a solid that does not yield.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Elasticity {
    /// K in Pa.
    pub bulk_modulus: f64,
    /// G in Pa.
    pub shear_modulus: f64,
}

/// Elasticity and strength of a material with internal friction.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Frictional {
    /// K in Pa.
    pub bulk_modulus: f64,
    /// G in Pa.
    pub shear_modulus: f64,
    /// phi in degrees.
    pub friction_angle: f64,
    /// psi in degrees.
    pub dilation_angle: f64,
    /// c in Pa.
    pub cohesion: f64,
    /// sigma_t in Pa.
    pub tensile_strength: f64,
    /// How dilation ends; `None`: it continues without end at the dilation angle. Drucker-Prager only.
    #[serde(default)]
    pub critical_state: Option<CriticalState>,
    /// Whether material that was pulled apart has no stress until it is back at the volume at which its grains
    /// separated. Only without cohesion.
    #[serde(default)]
    pub separates: bool,
}

impl Frictional {
    /// Whether its state is only stress and volume.
    pub fn is_plain(&self) -> bool {
        self.critical_state.is_none() && !self.separates
    }
}

/// How the dilation of sand ends in continued shear: the slope of the plastic potential is multiplied by a factor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum CriticalState {
    /// exp(-gamma/gamma_c) of the plastic shear strain gamma; the number is gamma_c.
    ShearStrain(f64),
    /// (1/J - 1/J_c)/(1 - 1/J_c) of the volume J over the initial one, between 0 and 1; the number is J_c, above 1.
    Volume(f64),
}

/// Elasticity of a granular material and its friction, which grows with the rate of shear.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Inertial {
    /// K in Pa.
    pub bulk_modulus: f64,
    /// G in Pa.
    pub shear_modulus: f64,
    /// mu_s, the friction at rest.
    pub static_friction: f64,
    /// mu_2, the limit of friction at high rates.
    pub limit_friction: f64,
    /// I_0, the inertial number at which friction is halfway between them.
    pub inertial_number: f64,
    /// d in m.
    pub grain_diameter: f64,
    /// rho_s in kg/m^3, of the grains themselves.
    pub grain_density: f64,
    /// Rate in 1/s at which the volume of a point approaches the mean volume of the points around it; at a hundredth of
    /// this rate it approaches the volume for which there is space. Continued shear flows need it; 0: off.
    #[serde(default)]
    pub volume_rate: f64,
}

impl MaterialModel {
    /// Key of the model in a configuration.
    pub fn key(&self) -> String {
        word(self)
    }

    /// Whether the thickness can follow from the stress out of plane: a solid that is elastic at small strains and does not yield.
    pub fn takes_plane_stress(&self) -> bool {
        matches!(self, Self::LinearElastic(_) | Self::Hypoelastic(_))
    }

    /// K and G in Pa; a fluid has no G.
    pub fn moduli(&self) -> (f64, f64) {
        match *self {
            Self::LinearElastic(m) | Self::Hypoelastic(m) | Self::NeoHookean(m) => {
                (m.bulk_modulus, m.shear_modulus)
            }
            Self::VonMises {
                bulk_modulus,
                shear_modulus,
                ..
            } => (bulk_modulus, shear_modulus),
            Self::DruckerPrager(m) | Self::MohrCoulomb(m) => (m.bulk_modulus, m.shear_modulus),
            Self::MuI(m) => (m.bulk_modulus, m.shear_modulus),
            Self::Fluid { bulk_modulus, .. } => (bulk_modulus, 0.0),
        }
    }

    /// The numbers of a model with an angle of friction, and whether its yield surface is a cone.
    pub(super) fn frictional(&self) -> Option<(Frictional, bool)> {
        match *self {
            Self::DruckerPrager(numbers) => Some((numbers, true)),
            Self::MohrCoulomb(numbers) => Some((numbers, false)),
            _ => None,
        }
    }

    /// Whether its points keep the plastic strain. They do unless stress and volume are all that the model needs.
    pub fn keeps_plastic_strain(&self) -> bool {
        match self.frictional() {
            Some((numbers, _)) => !numbers.is_plain(),
            None => self.is_plastic(),
        }
    }

    /// Whether strain can be permanent.
    pub fn is_plastic(&self) -> bool {
        matches!(
            self,
            Self::DruckerPrager(_) | Self::MohrCoulomb(_) | Self::VonMises { .. } | Self::MuI(_)
        )
    }

    /// The impossible numbers, in the order of the configuration.
    pub fn faults(&self) -> Vec<ConfigFault> {
        Faults::all(|found| self.look(found))
    }

    /// The same; the model's key is below what is looked at.
    pub(super) fn look(&self, found: &mut Faults<'_>) {
        const ANGLE: &str = "0 to below 90 degrees";
        const STRESS: &str = "a stress of 0 or more";
        let mut found = found.at(self.key());
        let (bulk, shear) = self.moduli();
        found.positive("bulk_modulus", bulk, "a modulus above 0");
        if !matches!(self, Self::Fluid { .. }) {
            found.positive("shear_modulus", shear, "a modulus above 0");
        }
        match *self {
            Self::LinearElastic(_) | Self::Hypoelastic(_) | Self::NeoHookean(_) => {}
            Self::DruckerPrager(m) | Self::MohrCoulomb(m) => {
                let (phi, psi) = (m.friction_angle, m.dilation_angle);
                let (c, tension) = (m.cohesion, m.tensile_strength);
                found.number("friction_angle", phi, (0.0..90.0).contains(&phi), ANGLE);
                // More dilation than friction would create energy.
                let less = (0.0..=phi.max(0.0)).contains(&psi);
                found.number("dilation_angle", psi, less, "0 to the friction angle");
                found.not_negative("cohesion", c, STRESS);
                found.not_negative("tensile_strength", tension, STRESS);
                if m.separates {
                    found.number("cohesion", c, c <= 0.0, "0 where it separates");
                }
                let cone = matches!(self, Self::DruckerPrager(_));
                match m.critical_state {
                    None => {}
                    Some(CriticalState::ShearStrain(of) | CriticalState::Volume(of)) if !cone => {
                        let expected = "none: drucker_prager alone has it";
                        found.number("critical_state", of, false, expected);
                    }
                    Some(CriticalState::ShearStrain(of)) => {
                        let key = "critical_state.shear_strain";
                        found.number(key, of, of > 0.0, "a strain above 0");
                    }
                    Some(CriticalState::Volume(of)) => {
                        let expected = "a volume above 1, the initial one";
                        found.number("critical_state.volume", of, of > 1.0, expected);
                    }
                }
            }
            Self::MuI(m) => {
                let (least, most) = (m.static_friction, m.limit_friction);
                let (number, d, rho) = (m.inertial_number, m.grain_diameter, m.grain_density);
                let coefficient = "a coefficient of 0 or more";
                found.not_negative("static_friction", least, coefficient);
                found.number(
                    "limit_friction",
                    most,
                    most > least,
                    "above static_friction",
                );
                found.positive("inertial_number", number, "a number above 0");
                found.positive("grain_diameter", d, "a length above 0");
                found.positive("grain_density", rho, "a density above 0");
                found.not_negative("volume_rate", m.volume_rate, "a rate of 0 or more");
            }
            Self::Fluid {
                exponent,
                viscosity,
                ..
            } => {
                let holds = exponent >= 1.0;
                found.number("exponent", exponent, holds, "an exponent of 1 or more");
                found.not_negative("viscosity", viscosity, "a viscosity of 0 or more");
            }
            Self::VonMises {
                yield_stress,
                hardening_modulus: h,
                ..
            } => {
                found.positive("yield_stress", yield_stress, "a stress above 0");
                found.not_negative("hardening_modulus", h, "a modulus of 0 or more");
            }
        }
    }
}
