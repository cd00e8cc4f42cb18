//! The contract between Tandem's processes.
//!
//! The only crate that names iceoryx2 and bincode. It knows neither solver nor coupler. `PROTOCOL.md` in this crate is
//! the normative text; the code names its clauses where it implements them.
//!
//! | folder or file | what is in it |
//! | --- | --- |
//! | [`config`] | the configuration of a solver, what it can do, and what a configuration asks for |
//! | [`message`] | the channels, the records and control messages that cross, and their bytes |
//! | [`solver`] | the two traits that a solver implements |
//! | [`forces`] | what passes between a bodies' side and its driver in a step |
//! | [`ledger`], [`impulse`] | the ledger of bodies, for any integrator; compensated sums |
//! | [`step`] | one time step, and the clock |
//! | [`transport`] | how messages cross: shared memory, direct calls, and the names and waits of a run |
//! | [`session`] | the protocol: the three parties of a session, over any transport; a solver as a program |
//! | [`recording`], [`trace`] | every message of a run in a file, and played to a solver again; what each party does when |
//! | [`hosted`] | one solver alone, led message by message |
//! | [`lend`] | a function lent to threads that live on |
//! | [`processor`] | the check of the processor at the start of a program |
//! | [`saved`], [`packed`] | the bytes of a saved state; files that say what they are |
//!
//! Geometry and mechanics that several solvers need are the crate `mechanics`.

#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

pub mod files;
pub mod forces;
pub mod hosted;
pub mod impulse;
pub mod ledger;
pub mod lend;
pub mod message;
pub mod packed;
pub mod processor;
pub mod recording;
pub mod saved;
pub mod session;
pub mod solver;
pub mod step;
pub mod text;
pub mod trace;
pub mod transport;

pub use config;

/// A vector in the plane.
pub type Vec2 = nalgebra::Vector2<f64>;
