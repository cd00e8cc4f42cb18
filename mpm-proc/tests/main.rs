//! The solver from outside: one program, a module for each subject.
#![allow(
    clippy::needless_range_loop,
    reason = "the index is the axis of the paper's formula, and often of several arrays at once"
)]

mod blocks;
mod chains;
mod conservation;
mod contact_schemes;
mod convergence;
mod dissipation;
mod drift;
mod forcing;
mod grid_contact;
mod holds;
mod kit;
mod leaving;
mod limits;
mod no_allocation;
mod orders;
mod periodic;
mod refusals;
mod saved;
mod selection;
