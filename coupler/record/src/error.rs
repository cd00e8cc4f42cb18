//! Reasons why a file or a run directory cannot be used, with advice.

use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use thiserror::Error;

/// The system does not do something with a file or folder.
#[derive(Debug, Error)]
#[error("cannot {action} {}: {source}", path.display())]
pub struct FileError {
    /// What was tried.
    pub action: &'static str,
    /// The file or folder.
    pub path: PathBuf,
    /// The error of the system.
    pub source: io::Error,
}

/// Turns an error of the system into one that names what was tried with which file.
pub fn fail(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> FileError {
    let path = path.to_path_buf();
    move |source| FileError {
        action,
        path,
        source,
    }
}

/// The run directory cannot be used.
#[derive(Debug, Error)]
pub enum RunDirError {
    /// A file or folder cannot be written, or read back.
    #[error(transparent)]
    File(#[from] FileError),
    /// Another run uses the directory.
    #[error("{} is in use by {holder}", path.display())]
    InUse {
        /// The directory.
        path: PathBuf,
        /// Process and command of the other run.
        holder: String,
    },
    /// The run would replace a file that is not Tandem's.
    #[error("{} is not a file of an earlier run, and this run would replace it", .0.display())]
    NotOurs(PathBuf),
}

impl RunDirError {
    /// What the user can do about it.
    pub fn advice(&self) -> &'static str {
        match self {
            Self::File(error) => match error.source.kind() {
                ErrorKind::StorageFull | ErrorKind::QuotaExceeded => {
                    "the disk is full: make room, or give a directory on another disk with --out"
                }
                ErrorKind::FileTooLarge => "the system limits the size of files: see `ulimit -f`",
                ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => {
                    "give a directory that can be written with --out"
                }
                ErrorKind::InvalidInput => {
                    "Tandem uses no links and no special files in a run directory: remove it, or give another directory with --out"
                }
                ErrorKind::NotFound => {
                    "no directory can be made there, or it was moved or removed while the run used it"
                }
                _ => "give another directory with --out",
            },
            Self::InUse { .. } => "wait for its end, or give another directory with --out",
            Self::NotOurs(_) => "move it, or give another directory with --out",
        }
    }
}
