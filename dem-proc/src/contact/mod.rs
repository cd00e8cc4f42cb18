//! Contact of bodies with one another and with points: where, how deep, and when it has gone too far.

pub mod approach;
pub mod chain;
pub mod convex;
pub mod impact;
pub mod meeting;
pub mod nearest;
pub mod overlap;
pub mod pairs;
pub mod passage;
pub mod point_pairs;
pub mod point_side;
pub mod points;
pub mod segments;
mod set;
mod stretch;
mod told;
