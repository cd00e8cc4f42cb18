//! The coupler: owns time. Launches the solvers, composes the shared step from both sides' limits, watches, records
//! and reports. Sees neither solver's code: it knows them through `interface` only.
#![forbid(unsafe_code)]

pub mod check;
pub mod diagnostic;
pub mod expression;
pub mod quantity;
pub mod scene;
