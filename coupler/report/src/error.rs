//! Why there is no page.

use std::io;
use std::path::{Path, PathBuf};

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
    #[error("cannot {action} {}: {source}", path.display())]
    File {
        /// What was tried.
        action: &'static str,
        /// With what.
        path: PathBuf,
        /// Why not.
        source: io::Error,
    },
    /// The page cannot be made although everything was read.
    #[error("cannot make the page: {0}")]
    Page(String),
}

impl ReportError {
    pub(crate) fn file(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_path_buf();
        move |source| Self::File {
            action,
            path,
            source,
        }
    }
}
