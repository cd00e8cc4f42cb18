//! The data of the solver: points, nodes, and what is known of them from step to step. Nothing here knows a pass.

pub mod continuum;
pub mod grid;
pub mod images;
pub mod imps;
pub mod loads;
pub mod points;
pub mod saved;
pub mod stages;
pub mod walls;
