//! The content of a frame: points, bodies and contacts at an instant, and the selection of their fields.

use std::sync::Arc;

use interface::config::MpmConfig;
use interface::config::capability::{CONTACTS, PLASTIC_STRAIN};
use interface::message::control::Party;
use interface::message::wire::{BodyState, ContactState, PointState};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::vtu::{Array, Precision};

/// Points, bodies and contacts at an instant.
#[derive(Debug, Clone, PartialEq)]
pub struct Instant {
    /// t_n in s.
    pub time: f64,
    /// Positions at t_n, velocities at t_{n-1/2}.
    pub points: Vec<PointState>,
    /// Of the measurement at t_n.
    pub bodies: Vec<BodyState>,
    /// The source of the plastic strain for each group; `None` if no group has any, or the solver does not report it.
    pub plastic_strain: Option<Arc<[PlasticStrain]>>,
    /// Contacts at t_n; `None` if the bodies' side does not report them.
    pub contacts: Option<Vec<ContactState>>,
}

/// The fields that the solvers of a run report for frames, besides positions.
#[derive(Debug, Clone, Default)]
pub struct ReportedFields {
    /// The contacts of bodies.
    pub contacts: bool,
    /// As in [`Instant`].
    pub plastic_strain: Option<Arc<[PlasticStrain]>>,
}

impl ReportedFields {
    /// The fields that solvers with these capabilities report, in a run with this continuum.
    pub fn by(mpm: Option<&MpmConfig>, can: impl Fn(Party, &str) -> bool) -> Self {
        let mpm = mpm.filter(|_| can(Party::Mpm, PLASTIC_STRAIN));
        Self {
            contacts: can(Party::Dem, CONTACTS),
            plastic_strain: mpm.and_then(PlasticStrain::of_groups),
        }
    }
}

/// The source of the plastic strain of a group's points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlasticStrain {
    /// The solver stores it.
    Kept,
    /// The material does not flow, so it is 0.
    None,
    /// The material flows, and the solver does not store how far: it is NaN.
    Forgotten,
}

impl PlasticStrain {
    /// The sources for the groups of a continuum whose solver reports it; `None` if no material stores any.
    pub fn of_groups(config: &MpmConfig) -> Option<Arc<[Self]>> {
        let materials = config
            .groups
            .iter()
            .map(|group| &config.materials[group.material].model);
        let of_groups: Arc<[Self]> = materials
            .map(
                |model| match (model.keeps_plastic_strain(), model.is_plastic()) {
                    (true, _) => Self::Kept,
                    (false, true) => Self::Forgotten,
                    (false, false) => Self::None,
                },
            )
            .collect();
        of_groups.contains(&Self::Kept).then_some(of_groups)
    }

    /// The plastic strain of a point of such a group.
    pub(super) fn of(self, point: &PointState) -> f64 {
        match self {
            Self::Kept => point.plastic_strain.into(),
            Self::None => 0.0,
            Self::Forgotten => f64::NAN,
        }
    }
}

/// The fields of points and bodies in frames, besides positions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Field {
    /// Velocity in m/s, of points and bodies.
    Velocity,
    /// Stress of points in Pa.
    Stress,
    /// Volume of points in m^3/m.
    Volume,
    /// Mass of points in kg/m.
    Mass,
    /// Plastic strain of points: equivalent (von Mises) or shear (sand with a memory); where a material keeps it.
    PlasticStrain,
    /// Angle of bodies in rad.
    Angle,
    /// Angular velocity of bodies in rad/s.
    Spin,
    /// Contacts of bodies with bodies and points, and their forces in N/m: files of their own.
    Contacts,
}

/// The selection of what frames contain.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Content {
    /// The fields; all of them by default.
    pub fields: Option<Vec<Field>>,
    /// Their digits.
    pub precision: Precision,
}

impl Content {
    pub(super) fn has(&self, field: Field) -> bool {
        self.fields
            .as_ref()
            .is_none_or(|fields| fields.contains(&field))
    }

    /// Those of these arrays that are selected.
    pub(super) fn keep<const N: usize>(&self, arrays: [(Option<Field>, Array); N]) -> Vec<Array> {
        let asked = arrays
            .into_iter()
            .filter(|(field, _)| field.is_none_or(|field| self.has(field)));
        asked.map(|(_, array)| array).collect()
    }
}
