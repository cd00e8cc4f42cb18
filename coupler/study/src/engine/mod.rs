//! What starts runs. An engine is given commands and starts each once; what ended is told by the run directories alone, so
//! that a command may as well be started again by a queue whose worker was lost.

mod hyperqueue;
pub(crate) mod local;
mod slurm;
pub(crate) mod start;

use self::start::{Place, Start};
use crate::StudyError;

/// What starts the runs of a study.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Engine {
    /// A bounded number of processes of this machine.
    Local,
    /// HyperQueue: the server that `HQ_SERVER_DIR` names, or one of its own on this machine.
    HyperQueue,
    /// One job array of Slurm.
    Slurm,
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
