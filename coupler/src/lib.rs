//! The coupler controls time. It starts the solvers, computes the common step from the limits of both sides, watches,
//! records and reports. It uses the solvers only through `interface`.
//!
//! | crate or module | content |
//! | --- | --- |
//! | [`scene`] | scene files, and everything that can be wrong with one |
//! | [`run`] | a run from open to closed: its step limit and the layout of its steps, the processes of the solvers, why it ended early, checkpoints |
//! | [`record`] | the quantities of a run, its energies and momenta, its checks, and its files |
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

pub mod run;

pub use {record, scene};
