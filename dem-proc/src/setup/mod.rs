//! From a configuration or a saved state to a solver.

pub(crate) mod capabilities;
pub(crate) mod configure;
pub(crate) mod saved;
