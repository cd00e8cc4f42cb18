//! Why there is no page.

use std::path::PathBuf;

use coupler::record::FileError;
use thiserror::Error;

/// Why there is no page.
#[derive(Debug, Error)]
pub enum ReportError {
    /// A directory is not one that a run has written.
    #[error("{}: {what}\n   help: name a run directory, such as runs/collision_hard; `tandem run SCENE` makes one", path.display())]
    NotARun {
        /// The directory.
        path: PathBuf,
        /// What it lacks.
        what: &'static str,
    },
    /// A file cannot be read or written.
    #[error(transparent)]
    File(#[from] FileError),
}
