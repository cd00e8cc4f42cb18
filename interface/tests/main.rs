//! The crate from outside: one program, a module for each subject. `umask.rs` is a program of its own.

mod plain;
mod toys;

mod clauses;
mod configuration;
mod needs;
mod session;
