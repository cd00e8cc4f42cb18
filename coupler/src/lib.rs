//! The coupler: owns time. Launches the solvers, composes the shared step from both sides' limits, watches, records
//! and reports. Sees neither solver's code: it knows them through `interface` only.
//!
//! | room | what is in it |
//! | --- | --- |
//! | [`scene`] | scene files, and everything that can be wrong with one |
//! | [`run`] | a run from open to closed: its step limit and the layout of its steps, the processes of the solvers, why it ended early, checkpoints |
//! | [`record`] | what can be asked of a run, its energies and momenta, its checks, and the files that it leaves behind |
#![forbid(unsafe_code)]

pub mod record;
pub mod run;
pub mod scene;
