//! Options of a run. None of them changes a bit of the result.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use interface::solver::{DemSolver, MpmSolver};

use crate::record::screen::Screen;

/// How a scene is run.
#[derive(Clone, Debug)]
pub struct RunOptions {
    /// Where the solvers are.
    pub solvers: Solvers,
    /// Threads of each solver.
    pub threads: usize,
    /// Most steps granted at once; `None`: the number in the scene.
    pub window: Option<u32>,
    /// Whether all messages are recorded in the run directory.
    pub record: bool,
    /// File for a timeline of the processes, an absolute path.
    pub trace: Option<PathBuf>,
    /// Whether a bar is wanted on a terminal.
    pub progress: bool,
    /// Shows that bar and the output of the solvers on standard error. Without it, solvers write there themselves.
    pub screen: Option<Screen>,
    /// How long to wait for a solver that is alive and does not run, because something has stopped it.
    pub patience: Duration,
    /// Wall time of stepping after which the run ends in order, as if it had been interrupted.
    pub stepping: Option<Duration>,
    /// Set from outside to end the run in order, after a last checkpoint.
    pub interrupt: Arc<AtomicBool>,
    /// Set from outside to end it without waiting for the solvers.
    pub at_once: Arc<AtomicBool>,
    /// Set from outside to save a checkpoint soon.
    pub save: Arc<AtomicBool>,
}

/// Where the solvers of a run are.
#[derive(Clone, Debug)]
pub enum Solvers {
    /// In processes of their own: a program and its arguments each, to which `--join RUN` is added.
    Processes {
        /// The continuum's.
        mpm: Vec<String>,
        /// The bodies'.
        dem: Vec<String>,
    },
    /// In this thread, in turns with the coupler.
    InProcess {
        /// Makes the continuum's.
        mpm: fn() -> Box<dyn MpmSolver>,
        /// Makes the bodies'.
        dem: fn() -> Box<dyn DemSolver>,
    },
}
