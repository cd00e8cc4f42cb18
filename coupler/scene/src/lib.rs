//! Scenes: from the file as written to checked values in SI units. Nothing downstream checks again.
//!
//! ```text
//! file --document--> tree with overrides --structure--> every unknown or mistyped key
//!      --written---> typed as written    --parse------> Scene
//! ```
//!
//! What the rest of the coupler uses: [`Scene::load`], the fields of [`Scene`], [`Scene::plan`] and [`schema()`]. Rows of
//! the history and the verdicts of checks come from [`record::check::Recorder`], which takes the columns and checks of a scene.
//!
//! The format is described for its users in `docs/scene-format.md`.

#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

mod bodies;
mod branch;
mod chains;
mod continuum;
pub mod diagnostic;
mod document;
mod doubts;
mod expectation;
mod forcing;
mod group_pairs;
mod model;
mod moduli;
mod needs;
mod output;
mod parse;
mod placement;
pub mod plan;
mod problems;
mod schema;
mod slice;
mod solvers;
mod start;
mod structure;
mod study;
mod written;

use std::path::{Path, PathBuf};

use interface::files::{self, STATE};

use crate::diagnostic::SceneErrors;
use record::rundir::SCENE;

pub use expectation::Expectation;
pub use model::{
    CheckpointPlan, Coupling, Measurand, Output, Scene, Solvers, Start, Study, TimePlan,
};
pub use needs::{refused, unmet};
pub use placement::{pressing, refuse_points_within_bodies};
pub use schema::schema;
pub use solvers::{BUILT_IN, solver_override};
pub use written::VERSION;

/// A scene file that has been read once, to make several of its variants.
#[derive(Debug)]
pub struct SceneFile {
    document: document::Document,
    /// Directory of the files that the scene names.
    directory: PathBuf,
}

impl SceneFile {
    /// Reads a scene file.
    ///
    /// # Errors
    /// It cannot be read, or is not TOML.
    pub fn read(path: &Path) -> Result<Self, SceneErrors> {
        Ok(Self {
            document: document::Document::read(path)?,
            directory: path.parent().unwrap_or(Path::new(".")).to_path_buf(),
        })
    }

    /// The same from a text. `name` stands for the file in messages; files that the scene names are in `directory`.
    ///
    /// # Errors
    /// It is not TOML.
    pub fn of_text(name: &str, text: &str, directory: &Path) -> Result<Self, SceneErrors> {
        Ok(Self {
            document: document::Document::parse(name.to_owned(), &text.into())?,
            directory: directory.to_path_buf(),
        })
    }

    /// The scene, as [`Scene::load`] checks it.
    ///
    /// # Errors
    /// Everything that is wrong with it.
    pub fn scene(&self, variant: Option<&str>, set: &[String]) -> Result<Scene, SceneErrors> {
        parse::scene(self.document.with(variant, set)?, &self.directory)
    }
}

impl Scene {
    /// Reads and checks a scene file, with the overrides of `variant` and then those of `set` (`KEY=VALUE`, dotted
    /// keys), the later winning.
    ///
    /// # Errors
    /// All faults of the scene that can be found at once. Their [`Display`](std::fmt::Display) is for people, with
    /// file, line, key, value, what was expected and the nearest valid key.
    pub fn load(path: &Path, variant: Option<&str>, set: &[String]) -> Result<Self, SceneErrors> {
        SceneFile::read(path)?.scene(variant, set)
    }

    /// The scene of a run directory, as resolved.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn of_run(dir: &Path) -> Result<Self, SceneErrors> {
        parse::scene(document::Document::of_run(dir, SCENE)?, dir)
    }

    /// The programs that the scene file names as solvers and that a run would start, with their sides. Those of the
    /// command line are the user's own and are left out.
    pub fn programs(&self) -> Vec<(&'static str, String)> {
        let named = solvers::commands(&self.solvers);
        named
            .filter(|(path, _)| self.document.is_of_file(path))
            .filter_map(|(path, command)| {
                let (side, takes_part) = match path {
                    "solvers.mpm" => ("mpm", self.mpm.is_some()),
                    _ => ("dem", self.dem.is_some()),
                };
                takes_part.then_some((side, command))
            })
            .collect()
    }

    /// Hash of the files among the words of the solvers' commands, such as a script: edited, they are another method. `None`
    /// without any.
    pub fn solver_files(&self) -> Option<String> {
        let words = [&self.solvers.mpm, &self.solvers.dem].into_iter().flatten();
        let read = |word: &String| files::read_named(Path::new(word), STATE).ok();
        let mut files = words.flatten().filter_map(read).peekable();
        files.peek()?;
        let mut hasher = blake3::Hasher::new();
        for content in files {
            hasher.update(blake3::hash(&content).as_bytes());
        }
        Some(hasher.finalize().to_string())
    }
}
