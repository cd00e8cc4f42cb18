//! A session: open, configure, step, drain, closed; abort from any of them (PROTOCOL.md section 2).
//!
//! The machines of [`crate::core`] say what to do next; here it is done. A party takes [turns]: each does one thing that
//! its machine asks for, or finds that there is nothing to do but wait. [`turns::drive`] lets one party take turns until
//! its session is over, waiting as a process does; [`together`] lets all three take turns in one thread; a simulation
//! decides by itself whose turn it is.

pub mod coupler;
pub mod process;
pub mod solver;
mod stopwatch;
pub mod together;
pub mod turns;

pub use coupler::{CouplerSide, Stop, Supervisor};
pub use solver::{DemSide, MpmSide, serve_dem, serve_mpm};
pub use stopwatch::cpu_time;
