//! A session: open, configure, step, drain, closed; abort from any of them (PROTOCOL.md section 2).
//!
//! The state machines of [`crate::core`] return the next action; this module carries it out. A party takes [turns]: in
//! each turn it carries out one action of its machine, or finds that it has to wait. [`turns::drive`] gives one party
//! turns until its session is over, with the waits of a process; [`together`] gives turns to all three parties in one
//! thread; a simulation decides by itself whose turn it is.

pub mod coupler;
pub mod process;
pub mod solver;
mod stopwatch;
pub mod together;
pub mod turns;

pub use coupler::{CouplerSide, Stop, Supervisor};
pub use solver::{DemSide, MpmSide, serve_dem, serve_mpm};
pub use stopwatch::cpu_time;
