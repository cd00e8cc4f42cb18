//! Scenes: from the file as written to checked values in SI units. Nothing downstream checks again.
//!
//! ```text
//! file --document--> tree with overrides --structure--> every unknown or mistyped key
//!      --written---> typed as written    --parse------> Scene
//! ```
//!
//! What the rest of the coupler uses: [`Scene::load`], the fields of [`Scene`], [`Scene::plan`] and [`schema`]. Rows of
//! the history and the verdicts of checks come from [`crate::record::check::Recorder`], which takes the columns and checks of a scene.
//!
//! The format is described for its users in `docs/scene-format.md`.

mod bodies;
mod branch;
mod continuum;
pub mod diagnostic;
mod document;
mod forcing;
mod geometry;
mod model;
mod needs;
mod outline;
mod output;
mod parse;
pub mod plan;
mod problems;
mod solvers;
mod start;
mod structure;
mod study;
mod written;

use std::path::Path;

use crate::scene::diagnostic::SceneErrors;

pub use model::{
    CheckpointPlan, Coupling, Criterion, Measurand, Output, Scene, Solvers, Start, Study, TimePlan,
};
pub use needs::unmet;
pub use solvers::solver_override;
pub use written::{VERSION, schema};

impl Scene {
    /// Reads and checks a scene file, with the overrides of `variant` and then those of `set` (`KEY=VALUE`, dotted
    /// keys), the later winning.
    ///
    /// # Errors
    /// Everything that is wrong with the scene, as far as it can be told at once: its [`Display`](std::fmt::Display)
    /// is for people, with file, line, key, value, what was expected and the nearest valid key.
    pub fn load(path: &Path, variant: Option<&str>, set: &[String]) -> Result<Self, SceneErrors> {
        let document = document::Document::read(path, variant, set)?;
        let directory = path.parent().unwrap_or(Path::new("."));
        parse::scene(document, directory)
    }

    /// What will run, what is left out and why, and estimates of memory, step and number of steps.
    pub fn plan(&self) -> plan::Plan {
        plan::Plan::new(self)
    }
}
