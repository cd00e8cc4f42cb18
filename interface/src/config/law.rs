//! Contact laws.

use std::f64::consts::PI;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::defaults::{is_one, is_zero, never, one};

/// Contact law. Stiffness in N/m per metre of thickness.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum ContactLaw {
    /// Linear spring (Jiang 2020 eq. 43), Coulomb friction with a tangential spring, optional viscous damping.
    Linear {
        /// k_n in N/m.
        normal_stiffness: f64,
        /// k_t in N/m; needed where there is friction.
        #[serde(default, skip_serializing_if = "is_zero")]
        #[schemars(skip_serializing_if = "never")]
        tangential_stiffness: f64,
        /// mu.
        #[serde(default, skip_serializing_if = "is_zero")]
        #[schemars(skip_serializing_if = "never")]
        friction: f64,
        /// zeta of the contact, a fraction of critical damping of the pair: 0 elastic. Restitution e is
        /// `zeta = -ln e / sqrt(pi^2 + ln^2 e)`.
        #[serde(default, skip_serializing_if = "is_zero")]
        #[schemars(skip_serializing_if = "never")]
        damping_ratio: f64,
    },
    /// Linear spring with adhesion and rolling resistance, both optional.
    Granular {
        /// k_n in N/m.
        normal_stiffness: f64,
        /// k_t in N/m; needed where there is friction.
        #[serde(default, skip_serializing_if = "is_zero")]
        #[schemars(skip_serializing_if = "never")]
        tangential_stiffness: f64,
        /// mu.
        #[serde(default, skip_serializing_if = "is_zero")]
        #[schemars(skip_serializing_if = "never")]
        friction: f64,
        /// zeta of the contact, as for `linear`.
        #[serde(default, skip_serializing_if = "is_zero")]
        #[schemars(skip_serializing_if = "never")]
        damping_ratio: f64,
        /// Pulling stress in Pa over the width `2 sqrt(2 R* xi)` of the contact.
        #[serde(default, skip_serializing_if = "is_zero")]
        #[schemars(skip_serializing_if = "never")]
        adhesion: f64,
        /// mu_r: the moment that resists rolling is at most `mu_r R* F_n`. Between bodies only.
        #[serde(default, skip_serializing_if = "is_zero")]
        #[schemars(skip_serializing_if = "never")]
        rolling_friction: f64,
    },
    /// Hertz-Mindlin with dashpot (Singer 2022): `F_n = K xi^1.5`, `k_t = k_n 2 (1 - nu) / (2 - nu)`.
    HertzMindlin {
        /// K in N/m^1.5 (per m); for spheres `4/3 E* sqrt(R*)`.
        hertz_constant: f64,
        /// nu, for the tangential stiffness.
        #[serde(default, skip_serializing_if = "is_zero")]
        #[schemars(skip_serializing_if = "never")]
        poisson_ratio: f64,
        /// mu.
        #[serde(default, skip_serializing_if = "is_zero")]
        #[schemars(skip_serializing_if = "never")]
        friction: f64,
        /// Coefficient of restitution e; 1: elastic.
        #[serde(default = "one", skip_serializing_if = "is_one")]
        #[schemars(skip_serializing_if = "never")]
        restitution: f64,
        /// Pulling stress in Pa over the width `2 sqrt(2 R* xi)` of the contact.
        #[serde(default, skip_serializing_if = "is_zero")]
        #[schemars(skip_serializing_if = "never")]
        adhesion: f64,
    },
    /// Force in proportion to the area of the overlap (Chen 2023 eq. 18): `F_n = k_A A`, A the circular segment of
    /// height xi of a disc of the reduced radius.
    Area {
        /// k_A in N/m^2 (per m).
        area_stiffness: f64,
        /// k_t in N/m; needed where there is friction.
        #[serde(default, skip_serializing_if = "is_zero")]
        #[schemars(skip_serializing_if = "never")]
        tangential_stiffness: f64,
        /// mu.
        #[serde(default, skip_serializing_if = "is_zero")]
        #[schemars(skip_serializing_if = "never")]
        friction: f64,
    },
}

impl Default for ContactLaw {
    /// No stiffness: things pass through one another.
    fn default() -> Self {
        Self::Linear {
            normal_stiffness: 0.0,
            tangential_stiffness: 0.0,
            friction: 0.0,
            damping_ratio: 0.0,
        }
    }
}

impl ContactLaw {
    /// mu.
    pub fn friction(&self) -> f64 {
        match *self {
            Self::Linear { friction, .. }
            | Self::Granular { friction, .. }
            | Self::HertzMindlin { friction, .. }
            | Self::Area { friction, .. } => friction,
        }
    }

    /// Damping as a fraction of critical.
    pub fn damping_ratio(&self) -> f64 {
        match *self {
            Self::Linear { damping_ratio, .. } | Self::Granular { damping_ratio, .. } => {
                damping_ratio
            }
            Self::HertzMindlin { restitution, .. } => ratio_of_restitution(restitution),
            Self::Area { .. } => 0.0,
        }
    }

    /// The larger of normal and tangential stiffness in N/m, where the law has a constant one.
    pub fn constant_stiffness(&self) -> Option<f64> {
        match *self {
            Self::Linear {
                normal_stiffness,
                tangential_stiffness,
                ..
            }
            | Self::Granular {
                normal_stiffness,
                tangential_stiffness,
                ..
            } => Some(normal_stiffness.max(tangential_stiffness)),
            Self::HertzMindlin { .. } | Self::Area { .. } => None,
        }
    }
}

/// Fraction of critical damping of a linear contact with restitution `e`: `-ln e / sqrt(pi^2 + ln^2 e)` (Schwager and
/// Poeschel 2007).
pub fn ratio_of_restitution(e: f64) -> f64 {
    let log = e.ln();
    -log / (PI * PI + log * log).sqrt()
}
