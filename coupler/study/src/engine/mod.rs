//! What starts runs. An engine is given commands and starts each once; what ended is told by the run directories alone, so
//! that a command may as well be started again by a queue whose worker was lost.

mod hyperqueue;
mod local;
mod slurm;
pub(crate) mod start;

use clap::{Args, ValueEnum};

use self::start::{Place, Start};
use crate::StudyError;

/// What starts the runs of a study.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum Engine {
    /// Processes of this machine, `--jobs` at once.
    #[default]
    Local,
    /// HyperQueue's Python package; of the server that `HQ_SERVER_DIR` names, or on this machine.
    #[value(name = "hyperqueue")]
    HyperQueue,
    /// One job array of Slurm.
    Slurm,
}

/// What starts the runs of a study, and what each may use.
#[derive(Debug, Clone, Copy, Default, Args)]
pub struct Queue {
    /// What starts the runs.
    #[arg(long, value_enum, default_value_t)]
    pub engine: Engine,
    /// Processors that a queue keeps for a run; by default one for each thread of its two solvers.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub cores: Option<u16>,
    /// Memory that a queue keeps for a run.
    #[arg(long, value_name = "MIB", value_parser = clap::value_parser!(u32).range(1..))]
    pub memory: Option<u32>,
}

impl Engine {
    /// Starts runs and returns when they are over, or when it was interrupted and has ended those of this machine. `look`
    /// is called now and then; it tells how many have not left a summary yet.
    pub(crate) fn work(
        self,
        starts: &[&Start],
        place: &Place,
        look: &mut dyn FnMut() -> usize,
    ) -> Result<(), StudyError> {
        match self {
            Self::Local => local::work(starts, place, look),
            Self::HyperQueue => hyperqueue::work(starts, place, look),
            Self::Slurm => slurm::work(starts, place, look),
        }
    }
}
