//! How the kit is used.

use std::time::Duration;

/// How the kit is used.
#[derive(Debug, Clone)]
pub struct Options {
    /// Ids of the clauses to judge; all when empty.
    pub only: Vec<String>,
    /// Most steps granted at once.
    pub window: u64,
    /// Longest wait for Hello and for Ready. A solver that has been awaited for so long once is awaited for
    /// [`crate::bench::PATIENCE`] from then on, so that one that never comes is judged in bounded time.
    pub startup: Duration,
    /// Whether the messages of each clause are kept.
    pub trace: bool,
    /// Clauses that are judged at the same time; 0 is taken for 1. Those that measure time are judged alone.
    pub jobs: usize,
}
