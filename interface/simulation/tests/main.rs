//! Scenarios by their seeds.

mod built_in;
mod seeds;
