//! The cases of a continuum: clouds of elastic points, on which bodies press as the kit says.

mod case;
mod compare;
mod generate;
mod run;

pub use case::Case;
