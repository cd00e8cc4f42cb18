//! What a frame holds: points, bodies and contacts at an instant, and which of their fields.

use interface::message::wire::{BodyState, ContactState, PointState};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::vtu::{Array, Precision};

/// What is where at an instant.
#[derive(Debug, Clone, PartialEq)]
pub struct Instant {
    /// t_n in s.
    pub time: f64,
    /// Positions at t_n, velocities at t_{n-1/2}.
    pub points: Vec<PointState>,
    /// Of the measurement at t_n.
    pub bodies: Vec<BodyState>,
    /// What presses at t_n; `None` where the bodies' side does not tell.
    pub contacts: Option<Vec<ContactState>>,
}

/// What frames tell of points and bodies besides where they are.
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
    /// Angle of bodies in rad.
    Angle,
    /// Angular velocity of bodies in rad/s.
    Spin,
    /// Contacts of bodies with bodies and points, and their forces in N/m: files of their own.
    Contacts,
}

/// What frames hold.
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

    /// Of these arrays, those that are asked for.
    pub(super) fn keep<const N: usize>(&self, arrays: [(Option<Field>, Array); N]) -> Vec<Array> {
        let asked = arrays
            .into_iter()
            .filter(|(field, _)| field.is_none_or(|field| self.has(field)));
        asked.map(|(_, array)| array).collect()
    }
}
