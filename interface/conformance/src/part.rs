//! The files by which solvers note that they take part in a run (clause O-8), as the kit sees them from outside.

#![allow(clippy::disallowed_methods, reason = "the private directory of a run")]

use std::fs::{self, File, TryLockError};
use std::path::PathBuf;

use interface::transport::domain::Domain;

/// A file `joined-PID.X` in the run's directory.
pub struct Note {
    /// Where it is.
    pub path: PathBuf,
    /// The process that its name gives.
    pub pid: u32,
}

impl Note {
    /// Whether a process holds it.
    pub fn is_locked(&self) -> bool {
        let lock = File::open(&self.path).map(|file| file.try_lock_shared());
        matches!(lock, Ok(Err(TryLockError::WouldBlock)))
    }
}

/// The notes that are in the directory of a run.
pub fn notes(domain: &Domain) -> impl Iterator<Item = Note> {
    let entries = fs::read_dir(domain.directory());
    let entries = entries.into_iter().flatten().flatten();
    entries.filter_map(|entry| {
        let name = entry.file_name();
        let (pid, _) = name.to_str()?.strip_prefix("joined-")?.split_once('.')?;
        Some(Note {
            path: entry.path(),
            pid: pid.parse().ok()?,
        })
    })
}
