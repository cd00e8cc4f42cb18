//! The cases of a solver of bodies: points that walk along bodies as the kit says.

mod admit;
mod case;
mod compare;
mod copy;
mod generate;
mod run;

pub use case::Case;
