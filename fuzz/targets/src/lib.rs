//! Hostile input: for each place where Tandem reads bytes that somebody else may have written, a target that takes any
//! bytes and does with them what Tandem does.
//!
//! A target may refuse its input; it must not panic, go on for ever, or take more memory than the length of the input and
//! the limits of a scene justify. Where a file has checksums the target makes them, so that what is behind them is reached.
//!
//! Two programs run the targets: `cargo fuzz` (`fuzz/README.md`), which looks for inputs that reach new code, and on a
//! stable compiler the test of this crate, which changes the seeds at random from a number.
//!
//! | file | what is read |
//! | --- | --- |
//! | [`scene`] | the text of a scene |
//! | [`session`] | messages, by the three parties with the built-in solvers |
//! | [`recording`] | recordings of runs |
//! | [`frames`] | VTK files and their list |
//! | [`run`] | a small run that was whole, of which the seeds are made |
//! | [`change`] | how inputs are changed |
//! | [`mod@target`] | what a target is |
#![forbid(unsafe_code)]

pub mod change;
pub mod frames;
pub mod recording;
pub mod run;
pub mod scene;
pub mod session;
pub mod target;

pub use target::Target;

/// All targets.
pub const TARGETS: [Target; 4] = [
    scene::TARGET,
    session::TARGET,
    recording::TARGET,
    frames::TARGET,
];

/// The target of this name.
pub fn target(name: &str) -> Option<Target> {
    TARGETS.into_iter().find(|target| target.name == name)
}
