//! Builds a solver from a configuration or a saved state.

pub(crate) mod capabilities;
pub(crate) mod configure;
pub(crate) mod laws;
pub(crate) mod saved;
