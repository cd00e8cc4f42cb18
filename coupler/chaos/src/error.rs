//! Why chaos cannot begin.

use std::io;
use std::path::{Path, PathBuf};

use thiserror::Error;

/// Chaos cannot begin.
#[derive(Debug, Error)]
pub enum ChaosError {
    /// A file or directory cannot be used.
    #[error("cannot {action} {}: {source}", path.display())]
    File {
        /// What was to be done.
        action: &'static str,
        /// With what.
        path: PathBuf,
        /// The system's answer.
        source: io::Error,
    },
    /// The scene does not end well even if nothing happens to it.
    #[error("undisturbed, the run {how}: {said}")]
    Undisturbed {
        /// How it ended.
        how: String,
        /// What it said last.
        said: String,
    },
    /// Two undisturbed runs differ.
    #[error("two undisturbed runs differ: {0}")]
    Differ(String),
}

/// Words an error of the system.
pub(crate) fn file(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> ChaosError {
    let path = path.to_path_buf();
    move |source| ChaosError::File {
        action,
        path,
        source,
    }
}
