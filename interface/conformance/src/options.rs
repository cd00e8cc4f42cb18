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
    /// [`crate::PATIENCE`] from then on, so that one that never comes is judged in bounded time.
    pub startup: Duration,
    /// Whether the messages of each clause are kept.
    pub trace: bool,
    /// Clauses that are judged at the same time; 0 is taken for 1. Those that measure time are judged alone.
    pub jobs: usize,
    /// The random cases.
    pub random: RandomCases,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            only: Vec::new(),
            window: 64,
            // An interpreter may have much to load, and the coupler waits longer (S-11).
            startup: Duration::from_secs(20),
            trace: false,
            jobs: 2,
            random: RandomCases::default(),
        }
    }
}

/// Which random cases are run.
#[derive(Debug, Clone, Copy)]
pub struct RandomCases {
    /// Seed of the first case; the next one has the next seed.
    pub seed: u64,
    /// Number of cases, at most.
    pub cases: u64,
    /// Time, at most.
    pub time: Duration,
    /// Time to make a case that fails smaller, at most.
    pub shrink: Duration,
    /// So many clauses may be found broken before the search ends.
    pub failures: usize,
}

impl Default for RandomCases {
    fn default() -> Self {
        Self {
            seed: 0,
            cases: 1000,
            time: Duration::from_secs(10),
            shrink: Duration::from_secs(10),
            failures: usize::MAX,
        }
    }
}
