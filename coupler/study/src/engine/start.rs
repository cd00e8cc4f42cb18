//! What an engine is given: commands, and where and with what they run.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

/// A run that is to be made.
#[derive(Debug)]
pub(crate) struct Start {
    /// Its words.
    pub command: Vec<String>,
    /// File of its standard error.
    pub log: PathBuf,
}

/// Where runs are made, and what each may use.
pub(crate) struct Place<'a> {
    /// Directory of the runs.
    pub runs: &'a Path,
    /// Most runs at once, if it was said.
    pub jobs: Option<usize>,
    /// Processors of a run.
    pub cores: usize,
    /// Memory of a run in MiB, if it was said.
    pub memory: Option<u32>,
    /// Set from outside to end.
    pub interrupt: &'a AtomicBool,
}

impl Start {
    /// As a line for a shell.
    pub fn line(&self) -> String {
        let words = self.command.iter().map(String::as_str);
        shlex::try_join(words).expect("paths on a command line have no zero byte")
    }
}

impl Place<'_> {
    /// Whether it was interrupted.
    pub fn interrupted(&self) -> bool {
        self.interrupt.load(Ordering::Relaxed)
    }
}
