//! From a configuration or a saved state to a solver.

pub mod configure;
pub mod saved;
