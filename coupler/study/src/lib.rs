//! Many runs of a scene, each by the program itself, and what they show together.
//!
//! | room | what is in it |
//! | --- | --- |
//! | [`vary`], [`sample`], [`case`] | values of scene keys, listed or drawn, and the checked scene of each run |
//! | [`runner`], `pool` | runs of the program, on this machine or through a launcher, resumable |
//! | [`precision`], [`work`] | Pareto fronts and orders; `tandem study`: error against run time |
//! | [`stability`] | `tandem stability`: where a step becomes unstable, and what criteria say of it |
//! | [`plot`], [`plot_options`] | `tandem plot`: curves out of what was written as CSV, and its command line |
//! | [`snapshots`] | `tandem plot --frames`: pictures of the points and bodies of a run |
//! | [`figure`] | all of these as SVG |
//!
//! This crate knows the coupler for its scenes and its words of a summary. It sees no solver and starts none: a run is
//! a command, so that it may as well be started on another machine.
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

pub mod case;
mod error;
pub mod figure;
mod output;
pub mod plot;
pub mod plot_options;
mod pool;
pub mod precision;
mod progress;
pub mod runner;
pub mod sample;
pub mod snapshots;
pub mod stability;
pub mod vary;
pub mod work;

pub use error::StudyError;
