//! The coupler: owns time. Launches the solvers, composes the shared step from both sides' limits, watches, records
//! and reports. Sees neither solver's code: it knows them through `interface` only.
//!
//! | room | what is in it |
//! | --- | --- |
//! | [`scene`], [`diagnostic`] | scene files, and everything that can be wrong with one |
//! | [`stability`], [`pace`] | the composed step limit, and the layout of steps between outputs |
//! | [`launch`], [`run`], [`failure`] | solvers as processes or threads, the run from open to closed, and why it ended early |
//! | [`ledger`], [`quantity`], [`check`] | energies and momenta, what can be asked of a run, what it must show |
//! | [`summary`], [`rundir`], [`frames`], [`course`], [`progress`] | what a run leaves behind, and what it shows meanwhile |
//! | [`checkpoint`] | the state of a run, from which it can be resumed |
#![forbid(unsafe_code)]

mod account;
pub mod check;
pub mod checkpoint;
pub mod course;
pub mod diagnostic;
pub mod failure;
pub mod frames;
pub mod launch;
mod lead;
pub mod ledger;
pub mod pace;
pub mod progress;
pub mod quantity;
pub mod run;
pub mod rundir;
pub mod scene;
pub mod stability;
pub mod summary;
