//! The oracles of the kit and of the solvers' tests: plain and slow.

pub mod bodies;
mod continuum;
pub mod grid_contact;
pub mod law;
pub mod layers;
mod material;
mod nodes;
mod start;
mod volumes;
mod walls;

pub use continuum::{Kernel, Reference, Totals};
pub use material::RefPoint;
