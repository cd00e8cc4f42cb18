//! The oracles of the kit and of the solvers' tests: plain and slow.

pub mod bodies;
mod continuum;
pub mod law;

pub use continuum::{Kernel, RefLaw, RefPoint, Reference};
