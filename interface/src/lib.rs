//! The contract between Tandem's processes.
//!
//! The only crate that names iceoryx2 and bincode; it knows neither solver nor coupler. [`wire`] holds the records that
//! cross, [`config`] what a solver is told, [`solver`] what a solver is, [`step`] time. `PROTOCOL.md` beside this crate
//! is the normative text; its clause numbers stand in the code where they are kept.

pub mod books;
pub mod capability;
pub mod clauses;
mod codec;
pub mod config;
pub mod control;
pub mod core;
mod defaults;
pub mod domain;
pub mod expression;
pub mod generate;
pub mod impulse;
pub mod mass;
pub mod material;
pub mod message;
pub mod needs;
pub mod outline;
pub mod process;
pub mod recording;
pub mod rigid;
pub mod saved;
pub mod session;
pub mod solver;
pub mod stage;
pub mod step;
pub mod surfaces;
pub mod transport;
pub mod wait;
pub mod wire;

/// A vector in the plane.
pub type Vec2 = nalgebra::Vector2<f64>;
