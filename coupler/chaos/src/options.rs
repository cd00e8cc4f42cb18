//! What is to be done.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::kind::Kind;

/// What is to be done.
#[derive(Debug, Clone)]
pub struct Options {
    /// The program, which has the subcommands `run`, `resume` and `clean`.
    pub program: PathBuf,
    /// Scene and its overrides, as words of a command line.
    pub scene: Vec<String>,
    /// What can happen.
    pub kinds: Vec<Kind>,
    /// How often something happens.
    pub rounds: u64,
    /// Number of the first round.
    pub first: u64,
    /// What everything is chosen from.
    pub seed: u64,
    /// Rounds at once.
    pub jobs: usize,
    /// Where runs have their directories; those of rounds that fail stay.
    pub out: PathBuf,
    /// Set from outside to end.
    pub interrupt: Arc<AtomicBool>,
}
