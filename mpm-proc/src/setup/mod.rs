//! From a configuration to a solver that is ready.

pub mod capabilities;
pub mod chains;
pub mod configure;
pub mod fields;
pub mod grid;
mod notes;
pub mod region;
