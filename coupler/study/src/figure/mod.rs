//! Figures of areas with axes, drawn by plotters as lines and letters or as pixels. It has no layout for words: they are measured
//! with its font in `shape` before `sheet` gives them a place, so that none overlap.

pub mod axis;
pub(crate) mod chart;
pub(crate) mod file;
pub(crate) mod shape;
pub(crate) mod sheet;
