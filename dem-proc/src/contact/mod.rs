//! Contact of bodies with one another and with points: its geometry, and the test whether a body has passed through
//! another.

pub mod approach;
pub mod chain;
pub mod convex;
pub mod damping;
pub mod engine;
mod frame_contacts;
pub mod impact;
pub mod nearest;
pub mod overlap;
pub mod pair_geometry;
pub mod pairs;
pub mod passage;
pub mod point_body;
pub mod point_pairs;
pub mod points;
mod release;
pub mod segments;
pub mod side;
pub mod span;
