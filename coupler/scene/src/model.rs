//! A scene as checked values in SI units.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use interface::config::{DemConfig, MpmConfig};
use interface::message::control::Party;
use interface::session::START;
use schemars::JsonSchema;
use serde::Deserialize;

use super::document;
use super::expectation::Expectation;
use record::check::{Check, Column};
use record::frames::Content;
use record::quantity::Quantities;

/// A scene, checked, in SI units.
#[derive(Debug, Clone)]
pub struct Scene {
    /// Name: letters, digits, `_` and `-`.
    pub name: String,
    /// What to look at in the results.
    pub about: String,
    /// How its run is known to end.
    pub expect: Expectation,
    /// Another run whose state the scene begins with.
    pub start: Option<Start>,
    /// Duration and step.
    pub time: TimePlan,
    /// The continuum's configuration; `None`: no MPM process. `threads` is 1, for the command line to change.
    pub mpm: Option<MpmConfig>,
    /// The bodies' configuration; `None`: no DEM process. `threads` is 1, for the command line to change.
    pub dem: Option<DemConfig>,
    /// Other solvers than the built-in ones.
    pub solvers: Solvers,
    /// The exchange between the processes.
    pub coupling: Coupling,
    /// What is recorded.
    pub output: Output,
    /// What the run must show.
    pub checks: Vec<Check>,
    /// The scene's constants.
    pub constants: BTreeMap<String, f64>,
    /// The quantities that columns and checks are made of.
    pub quantities: Quantities,
    /// The scene after variant and `--set`, with CSV references replaced by their numbers, paths of solvers whole: a
    /// scene file again, that stands alone.
    pub resolved_toml: String,
    /// BLAKE3 of [`Self::resolved_toml`] in hexadecimal.
    pub hash: String,
    /// Names of the file's variants.
    pub variants: Arc<[String]>,
    /// The settings of `tandem study`. They are not part of the resolved text or the hash.
    pub study: Study,
    /// Things that are allowed but probably not meant.
    pub warnings: Vec<String>,
    /// Where each key was written, for messages that come after the scene has been read.
    pub(super) document: Arc<document::Document>,
}

/// Another run whose state a scene begins with.
#[derive(Debug, Clone, PartialEq)]
pub struct Start {
    /// Its directory, as an absolute path.
    pub run: PathBuf,
    /// The latest time in s of the checkpoint; `None`: the newest.
    pub at: Option<f64>,
    /// Whether the clock begins at 0, and not at the time of that run.
    pub from_zero: bool,
    /// Hash of the state ([`Scene::begun_with`]); `None`: any state.
    pub state: Option<String>,
}

impl Scene {
    /// The solvers that take part.
    pub fn parties(&self) -> Vec<Party> {
        let mpm = self.mpm.is_some().then_some(Party::Mpm);
        let dem = self.dem.is_some().then_some(Party::Dem);
        mpm.into_iter().chain(dem).collect()
    }

    /// `start.from` and `start.state`, of a scene that begins with a run whose state is known.
    pub fn begins_with(&self) -> Option<[String; 2]> {
        let start = self.start.as_ref()?;
        Some([start.from(), start.state.clone()?])
    }
}

impl Start {
    /// The value of `start.from`.
    pub fn from(&self) -> String {
        let run = self.run.display();
        self.at
            .map_or_else(|| run.to_string(), |at| format!("{run}@{at}"))
    }
}

/// Duration and step.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TimePlan {
    /// End of the run in s; it begins at 0, or at the time that `start` gives.
    pub end: f64,
    /// Longest step in s, in addition to the stability limits.
    pub max_step: Option<f64>,
    /// A step below this (s) stops the run; 1e-9 of `end` by default.
    pub min_step: Option<f64>,
    /// Safety factor kappa of the composed limit, above 0 and at most 1; 0.8 by default.
    #[serde(default = "safety")]
    pub safety: f64,
    /// Forces the step to this multiple of what the limits allow, to find the limit of stability by experiment; 1 by
    /// default.
    #[serde(default = "step_factor")]
    pub step_factor: f64,
    /// A run that creates numerically more than this share of the energy in play fails; 0.1 by default.
    #[serde(default = "created_energy")]
    pub created_energy: f64,
}

fn safety() -> f64 {
    0.8
}

fn step_factor() -> f64 {
    1.0
}

fn created_energy() -> f64 {
    0.1
}

impl TimePlan {
    /// The plan of a scene that gives nothing but its end (s).
    pub fn until(end: f64) -> Self {
        Self {
            end,
            max_step: None,
            min_step: None,
            safety: safety(),
            step_factor: step_factor(),
            created_energy: created_energy(),
        }
    }

    /// A step below this (s) stops the run.
    pub fn shortest(&self) -> f64 {
        self.min_step.unwrap_or(1e-9 * self.end)
    }

    /// Whether every step is within the limit of stability, as far as the composed limit covers it.
    pub fn is_stable(&self) -> bool {
        self.safety * self.step_factor <= 1.0
    }
}

/// Programs and their arguments that replace the built-in solvers; `--join RUN` is added to them.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Solvers {
    /// The continuum; `None`: the built-in one.
    pub mpm: Option<Vec<String>>,
    /// The bodies; `None`: the built-in one.
    pub dem: Option<Vec<String>>,
}

/// The exchange between the processes.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Coupling {
    /// Verlet skin V_d in m beyond contact distance; twice the largest contact radius by default, at least half of it.
    pub skin: Option<f64>,
    /// Longest wait for another process in s; 30 by default.
    pub deadline: f64,
    /// Longest wait in s for a solver to start and send Hello, and then for it to take its configuration and be ready; 100
    /// by default.
    pub start_deadline: f64,
    /// Largest number of steps granted at once; 64 by default. 1 is the strict mode, with the same result to the bit.
    pub window: u32,
}

impl Default for Coupling {
    fn default() -> Self {
        Self {
            skin: None,
            deadline: 30.0,
            start_deadline: START.as_secs_f64(),
            window: 64,
        }
    }
}

impl Coupling {
    /// Longest wait for another process.
    pub fn deadline(&self) -> Duration {
        Duration::from_secs_f64(self.deadline)
    }

    /// Longest wait for a solver before the first step: for its Hello, and then for its Ready.
    pub fn start_deadline(&self) -> Duration {
        Duration::from_secs_f64(self.start_deadline)
    }
}

/// What `tandem study` does with a scene: which runs, and what their error is.
#[derive(Debug, Clone, PartialEq)]
pub struct Study {
    /// The error of a run; `None` if the scene does not define one.
    pub error: Option<Measurand>,
    /// Dotted key of the number that sets the resolution of a run.
    pub resolution: String,
    /// Varied keys that lead along a curve instead of distinguishing curves.
    pub along: Vec<String>,
    /// Dotted scene key, or `variant`, and its values as `--set` takes them.
    pub vary: Vec<(String, Vec<String>)>,
}

/// The quantity from which the error of a run is computed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Measurand {
    /// The check of this name, which has a reference.
    Check(String),
    /// These columns of the history, or checks, compared with the finest run.
    Finer(Vec<String>),
}

/// What is recorded.
#[derive(Debug, Clone)]
pub struct Output {
    /// Simulated time between rows of the history in s.
    pub every: f64,
    /// Intervals of the history between frames; `None`: there are none.
    pub frames: Option<u64>,
    /// What frames hold.
    pub content: Content,
    /// Whether the run writes a page with its results at its end.
    pub report: bool,
    /// When the run saves its state; `None`: never.
    pub checkpoint: Option<CheckpointPlan>,
    /// Columns after the time.
    pub columns: Vec<Column>,
}

/// When a run saves its state: at the times of all of these keys.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CheckpointPlan {
    /// Wall time between checkpoints in s.
    pub wall: Option<f64>,
    /// Simulated time between checkpoints in s.
    pub time: Option<f64>,
    /// Simulated times in s of checkpoints that are kept, for other scenes to start from. Multiples of `output.every`.
    #[serde(default)]
    pub at: Vec<f64>,
    /// Whether the state at the end is kept too; false by default.
    #[serde(default)]
    pub end: bool,
}

impl Study {
    /// The keys that a study varies along a curve by default.
    pub fn along(resolution: &str) -> Vec<String> {
        vec!["variant".to_owned(), resolution.to_owned()]
    }
}
