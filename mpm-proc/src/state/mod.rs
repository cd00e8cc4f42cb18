//! The data of the solver: points, nodes, and their state from step to step. Nothing here uses a pass.

pub mod columns;
pub mod contact;
pub mod continuum;
pub mod damping;
pub mod grid;
pub mod holds;
pub mod images;
pub mod imps;
pub mod loads;
pub mod markers;
pub mod nodes;
pub mod point_set;
pub mod points;
pub mod reflections;
pub mod saved;
pub mod settling;
pub mod totals;
pub mod walls;
