//! Why a study ends without a result.

use coupler::record::FileError;
use coupler::scene::diagnostic::SceneErrors;
use thiserror::Error;

/// Why a study ends without a result.
#[derive(Debug, Error)]
pub enum StudyError {
    /// A scene, with the values that it was given, is none.
    #[error("{0}")]
    Scene(SceneErrors),
    /// The command cannot be carried out; the second is what to write instead.
    #[error("error: {0}\n   help: {1}")]
    Usage(String, String),
    /// A file cannot be read or written.
    #[error("error: {0}")]
    File(#[from] FileError),
    /// The figure cannot be drawn.
    #[error("error: cannot draw the figure: {0}")]
    Figure(String),
    /// Asked to end; what was done is kept.
    #[error("interrupted; the runs that are done are kept, the same command goes on")]
    Interrupted,
}

impl StudyError {
    pub(crate) fn usage(what: impl Into<String>, help: impl Into<String>) -> Self {
        Self::Usage(what.into(), help.into())
    }

    /// Exit status of the program.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Scene(_) | Self::Usage(..) => 2,
            Self::File(_) | Self::Figure(_) => 3,
            Self::Interrupted => 130,
        }
    }
}
