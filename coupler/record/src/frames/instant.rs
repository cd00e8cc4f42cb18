//! The content of a frame: points, bodies and contacts at an instant, and the selection of their fields.

use std::sync::Arc;

use interface::config::MpmConfig;
use interface::message::wire::{BodyState, ContactState, PointState};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::vtu::{Array, Precision};

/// Points, bodies and contacts at an instant.
#[derive(Debug)]
pub(super) struct Instant {
    /// t_n in s.
    pub time: f64,
    /// Positions at t_n, velocities at t_{n-1/2}.
    pub points: Vec<PointState>,
    /// Of the measurement at t_n.
    pub bodies: Vec<BodyState>,
    /// As [`plastic_strain`]; `None` also if the solver does not report it.
    pub plastic_strain: Option<Arc<[Option<f64>]>>,
    /// Contacts at t_n; `None` if they are not asked for, or the bodies' side does not report them.
    pub contacts: Option<Vec<ContactState>>,
}

/// The plastic strain of the points of each group: `None` is what the solver keeps for each point, 0 that of a material that does
/// not flow, and NaN that of one that flows while nobody keeps how far. `None` for all if no material keeps any.
pub(super) fn plastic_strain(config: &MpmConfig) -> Option<Arc<[Option<f64>]>> {
    let models = config
        .groups
        .iter()
        .map(|group| &config.materials[group.material].model);
    let of_groups: Arc<[Option<f64>]> = models
        .map(
            |model| match (model.keeps_plastic_strain(), model.is_plastic()) {
                (true, _) => None,
                (false, true) => Some(f64::NAN),
                (false, false) => Some(0.0),
            },
        )
        .collect();
    of_groups.contains(&None).then_some(of_groups)
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
