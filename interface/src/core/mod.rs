//! The protocol without I/O: state machines for the three parties of a session.
//!
//! A state machine gets an event ([`Event`]) and returns the next action ([`Action`]). It implements every clause of
//! PROTOCOL.md, the order of messages and the deadlines; it knows no channels, threads, clocks or files. So the same
//! machines run between processes, in one thread, and in simulation ([`crate::session`] carries out their actions), and
//! a clause is checked in one place for every transport.
//!
//! [`continuum::Continuum`] and [`bodies::Bodies`] are the two solvers' sides; their common part is their
//! [`line::Line`] to the coupler. [`coupler::Coupler`] is the coupler's side.

mod approach;
pub mod bodies;
mod check;
pub mod continuum;
pub mod coupler;
mod error;
mod event;
mod line;
mod machine;
mod pieces;

pub(crate) use approach::fastest;
pub use error::SessionError;
pub(crate) use error::broken;
pub use event::{Action, Done, Event, Task, Wait};
pub use machine::Machine;
pub use pieces::solver_part;
