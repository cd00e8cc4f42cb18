//! The passes of a step: each reads the data, changes them, and is called by `step.rs`.

pub mod check_points;
pub mod columns;
pub mod contact;
pub mod damping;
pub mod drift;
pub mod gaps;
pub mod grid_to_points;
pub mod holds;
pub mod images;
pub mod leaving;
pub mod limits;
pub mod loads;
pub mod markers;
pub mod measure;
pub mod node_momentum;
pub mod points_to_grid;
pub mod select_imps;
pub mod select_markers;
pub mod select_pairs;
pub mod sort;
pub mod spin;
pub mod stress;
pub mod stress_schemes;
pub mod update_grid;
pub mod volumes;
pub mod xpic;
