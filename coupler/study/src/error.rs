//! Why a study ends without a result.

use std::io;
use std::path::{Path, PathBuf};

use coupler::scene::diagnostic::SceneErrors;
use thiserror::Error;

/// Why a study ends without a result.
#[derive(Debug, Error)]
pub enum StudyError {
    /// A scene, with the values that it was given, is none.
    #[error("{0}")]
    Scene(SceneErrors),
    /// What was asked for cannot be; the second is what to write instead.
    #[error("error: {0}\n   help: {1}")]
    Asked(String, String),
    /// A file cannot be read or written.
    #[error("error: cannot {action} {path}: {source}")]
    File {
        /// What was tried.
        action: &'static str,
        /// With what.
        path: PathBuf,
        /// Why not.
        source: io::Error,
    },
    /// The figure cannot be drawn.
    #[error("error: cannot draw the figure: {0}")]
    Figure(String),
    /// Asked to end; what was done is kept.
    #[error("interrupted; the runs that are done are kept, the same command goes on")]
    Interrupted,
}

impl StudyError {
    pub(crate) fn asked(what: impl Into<String>, help: impl Into<String>) -> Self {
        Self::Asked(what.into(), help.into())
    }

    pub(crate) fn file(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_path_buf();
        move |source| Self::File {
            action,
            path,
            source,
        }
    }

    /// Exit status of the program.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Scene(_) | Self::Asked(..) => 2,
            Self::File { .. } | Self::Figure(_) => 3,
            Self::Interrupted => 130,
        }
    }
}
