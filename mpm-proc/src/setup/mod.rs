//! From a configuration to a solver that is ready.

pub mod capabilities;
pub mod checks;
pub mod configure;
pub mod fields;
pub mod fill;
