//! The crate from outside: one program, a module for each subject. `umask.rs` is a program of its own.

mod toys;

mod clauses;
mod configuration;
mod session;
