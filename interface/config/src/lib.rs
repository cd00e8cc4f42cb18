//! The configuration that the coupler sends to each solver: its part of the scene, checked and in SI units.
//!
//! The leaf types (shapes, transfers, material models, outlines, contact laws) are written in scene files exactly as
//! they are here. The configuration is JSON in the message Configure, so that a solver in any language can read it;
//! [`schema`] describes it.
//!
//! A crate of its own, so that all that `serde` and `schemars` derive here can be compiled without optimisation
//! (`Cargo.toml` of the workspace); solvers name it as `interface::config`.

#![forbid(unsafe_code)]

mod bodies;
mod bodies_faults;
pub mod capability;
mod chain_faults;
mod continuum;
mod continuum_faults;
mod fault;
pub mod friction;
mod lattice;
mod law;
pub mod laws;
pub mod material;
pub mod needs;
mod pairs_faults;
pub mod polygon;
mod region;
pub mod schema;
pub mod surfaces;

use schemars::JsonSchema;
use serde::de::{DeserializeOwned, Error};
use serde::{Deserialize, Serialize};
use serde_json::Value;

pub use self::bodies::*;
pub use self::continuum::*;
pub use self::continuum_faults::{CELLS_MAX, POINTS_MAX};
pub use self::fault::ConfigFault;
pub use self::lattice::{Following, points_of_ring};
pub use self::law::{ContactLaw, ratio_of_restitution};
pub use self::material::{
    CriticalState, Elasticity, Frictional, Inertial, MaterialConfig, MaterialModel,
};

/// What the bodies are in contact with on the continuum's side.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Interface {
    /// Its points, each a disc of its contact radius (Jiang 2020).
    #[default]
    Points,
    /// The segments between the markers of its boundary (Singer 2022; capability `segments`).
    Segments,
}

/// Reads a configuration from the text of the message Configure. A scene may leave out what has a default, a configuration
/// has all of it (S-5).
///
/// # Errors
/// It is not JSON, or not such a configuration.
pub fn from_json<T: Serialize + DeserializeOwned>(text: &str) -> serde_json::Result<T> {
    let config: T = serde_json::from_str(text)?;
    match missing(
        &serde_json::from_str(text)?,
        &serde_json::to_value(&config)?,
    ) {
        Some(field) => Err(Error::custom(format!("missing field `{field}`"))),
        None => Ok(config),
    }
}

/// A field that a configuration, or what is within it, has and that was not given.
fn missing<'a>(given: &Value, all: &'a Value) -> Option<&'a str> {
    match all {
        Value::Object(fields) => fields.iter().find_map(|(field, all)| {
            let found = given.get(field).map(|given| missing(given, all));
            found.unwrap_or(Some(field))
        }),
        Value::Array(each) => {
            let mut pairs = given.as_array()?.iter().zip(each);
            pairs.find_map(|(given, all)| missing(given, all))
        }
        _ => None,
    }
}

/// A configuration as the text of the message Configure.
pub fn to_json(config: &impl Serialize) -> String {
    serde_json::to_string(config).expect("configurations have string keys only")
}
