//! The oracles of the kit and of the solvers' tests: plain and slow.

pub mod bodies;
mod continuum;
pub mod law;
mod material;

pub use continuum::{Kernel, Reference, Totals, is_within};
pub use material::{RefLaw, RefPoint};
