//! The tests of the whole program: one program, a module for each subject.
//!
//! One of them: `cargo test --workspace --release --test tandem-tests pages::`.

mod harness;

mod branch;
mod bugs;
mod chaos;
mod conformance;
mod deaths;
mod frames;
mod hashes;
mod hostile;
mod house;
mod instability;
mod launchers;
mod mangled;
mod mutants;
mod new_solver;
mod pages;
mod processor;
mod python;
mod recording;
mod refusals;
mod replay;
mod report;
mod resources;
mod resume;
mod rundir;
mod scenes;
mod study;
mod turning;
mod tutorial;
mod unread;
mod watch;
