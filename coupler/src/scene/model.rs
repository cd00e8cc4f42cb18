//! A scene as checked values in SI units.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use interface::config::{DemConfig, MpmConfig};
use interface::message::control::Party;
use interface::session::StartDeadlines;

use super::document;
use super::written::Expectation;
use crate::record::check::{Check, Column};
use crate::record::frames::Content;
use crate::record::quantity::Quantities;

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

/// Duration and step. Times in s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimePlan {
    /// End of the run, which begins at 0 or where [`Scene::start`] says.
    pub end: f64,
    /// The longest step that the scene allows.
    pub max_step: Option<f64>,
    /// A step below this stops the run.
    pub min_step: f64,
    /// kappa of docs/physics.md section 4, in (0, 1].
    pub safety: f64,
    /// The step is this multiple of what the criterion allows: 1, except in experiments with instability.
    pub step_factor: f64,
    /// A run that creates more than this share of the energy in play fails.
    pub created_energy: f64,
    /// How the step limit is computed.
    pub criterion: Criterion,
}

impl TimePlan {
    /// Whether every step is within the limit of stability, as far as the composed criterion covers it.
    pub fn is_stable(&self) -> bool {
        self.criterion == Criterion::Composed && self.safety * self.step_factor <= 1.0
    }
}

/// How the step limit is computed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Criterion {
    /// From the stiffness and mobility of both sides (docs/physics.md section 4).
    Composed,
    /// Jiang 2020 eq. 51 as printed, for comparison.
    Jiang2020 {
        /// Fraction of `L/c`.
        kappa_1: f64,
        /// Fraction of `2 pi sqrt(m_min/k_n)`.
        kappa_2: f64,
    },
}

impl Criterion {
    /// Eq. 51 with the factors that the scenes of the paper have here, unless a scene has others.
    pub const EQ_51: Self = Self::Jiang2020 {
        kappa_1: 0.8,
        kappa_2: 0.1,
    };
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
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coupling {
    /// Verlet skin `V_d` in m; also in both configurations.
    pub skin: f64,
    /// Longest wait for another process.
    pub deadline: Duration,
    /// Longest waits for a solver before the first step.
    pub start: StartDeadlines,
    /// Most steps granted at once, at least 1.
    pub window: u32,
}

/// What `tandem study` does with a scene: which runs, and what their error is.
#[derive(Debug, Clone, PartialEq)]
pub struct Study {
    /// The error of a run; `None` if the scene does not define one.
    pub error: Option<Measurand>,
    /// Dotted key of the number that sets the resolution of a run.
    pub resolution: String,
    /// Varied keys that lead along a curve instead of telling curves apart.
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

/// When a run saves its state by itself.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CheckpointPlan {
    /// Wall time between checkpoints.
    pub wall: Option<Duration>,
    /// Simulated time between checkpoints in s.
    pub time: Option<f64>,
    /// Numbers of the outputs, counted from t = 0, at which a checkpoint is kept for other runs.
    pub at: BTreeSet<u64>,
    /// Whether a checkpoint at the end is kept too.
    pub end: bool,
}

impl Study {
    /// The keys that a study varies along a curve by default.
    pub fn along(resolution: &str) -> Vec<String> {
        vec!["variant".to_owned(), resolution.to_owned()]
    }
}
