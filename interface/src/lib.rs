//! The contract between Tandem's processes.
//!
//! The only crate that names iceoryx2 and bincode; it knows neither solver nor coupler. [`wire`] holds the records that
//! cross, [`config`] what a solver is told, [`solver`] what a solver is, [`step`] time. `PROTOCOL.md` beside this crate
//! is the normative text; its clause numbers stand in the code where they are kept.

pub mod config;
pub mod outline;
pub mod solver;
pub mod step;
pub mod wire;

/// A vector in the plane.
pub type Vec2 = nalgebra::Vector2<f64>;
