//! The protocol without I/O: state machines for the three parties of a session.
//!
//! A machine is told what has happened ([`Event`]) and says what to do next ([`Action`]). It knows every clause of
//! PROTOCOL.md, the order of messages and how long to wait for what; it knows nothing of channels, threads, clocks or
//! files. So the same machines run between processes, in one thread, and in simulation ([`crate::session`] has the ones
//! who do what they say), and a clause is checked here, once, whatever the transport.
//!
//! [`continuum::Continuum`] and [`bodies::Bodies`] are the two solvers' sides; what both have in common is their
//! [`line::Line`] to the coupler. [`coupler::Coupler`] leads.

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
