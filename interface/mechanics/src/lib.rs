//! What several of Tandem's crates need for mechanics in the plane: no solver, no protocol.
//!
//! | file | what is in it |
//! | --- | --- |
//! | [`outline`] | the nearest point of an outline, by which points and bodies touch |
//! | [`mass`] | area, centre and second moments of outlines swept by a disc |
//! | [`rigid`] | contact with points, for a rigid-body solver whose own contact has none |
//! | [`expression`] | formulas in a scene: fields, loads, checks |
//! | [`fill`] | regions filled with points |
//! | [`generate`] | sets of bodies from a seed |
//! | [`mod@reference`] | a material point method and the motion of bodies, plain and slow: the oracles of tests and of the kit |
//! | [`threads`], `trial` | the threads of a solver; whether they share its loops |
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

pub mod expression;
pub mod fill;
pub mod generate;
pub mod mass;
pub mod outline;
pub mod reference;
pub mod rigid;
pub mod threads;
mod trial;
