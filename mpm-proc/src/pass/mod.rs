//! The passes of a step: each reads the data, changes them, and is called by `step.rs`.

pub mod contact;
pub mod drift;
pub mod grid_to_points;
pub mod leaving;
pub mod limits;
pub mod measure;
pub mod points_to_grid;
pub mod stress;
pub mod xpic;
