//! How the kit is used: the options of `tandem conformance` that are about the examination.

use std::num::{NonZero, ParseIntError};
use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, Command, FromArgMatches, value_parser};

/// How the kit is used.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// Test only these clauses.
    #[arg(long, value_name = "ID", value_delimiter = ',')]
    pub only: Vec<String>,
    /// Number of clauses tested at the same time; by default two for each core, at most eight. Clauses that measure
    /// time are tested alone.
    #[arg(long, value_name = "N", default_value_t = jobs(), hide_default_value = true, value_parser = value_parser!(u16).range(1..))]
    pub jobs: u16,
    /// The random cases.
    #[command(flatten)]
    pub random: RandomCases,
    // An interpreter may have much to load, and the coupler waits longer (S-11). A solver that has been awaited for so long
    // once is awaited for `PATIENCE` from then on, so that one that never comes is judged in bounded time.
    /// Longest wait for Hello and for Ready in seconds; the start-up time of a solver is not tested.
    #[arg(long, value_name = "SECONDS", default_value = "20", value_parser = some_seconds)]
    pub startup: Duration,
    /// Write the messages of every broken clause, one file for each.
    #[arg(long, value_name = "DIR")]
    pub trace: Option<PathBuf>,
}

/// Which random cases are run.
#[derive(Debug, Clone, Copy, Args)]
pub struct RandomCases {
    // Below 2^63: the cases after it must not begin again at 0.
    /// Seed of the first random case; the next one has the next seed.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = value_parser!(u64).range(..1 << 63))]
    pub seed: u64,
    /// Number of random cases, at most.
    #[arg(long, value_name = "N", default_value_t = 1000)]
    pub cases: u64,
    /// Time for random cases in seconds, at most.
    #[arg(long, value_name = "SECONDS", default_value = "10", value_parser = seconds)]
    pub time: Duration,
    /// Time to make a random case that fails smaller in seconds, at most.
    #[arg(long, value_name = "SECONDS", default_value = "10", value_parser = seconds)]
    pub shrink: Duration,
    /// So many clauses may be found broken before the search ends.
    #[arg(skip = usize::MAX)]
    pub failures: usize,
}

impl Default for Options {
    /// Those of a command line without any.
    fn default() -> Self {
        let command = Self::augment_args(Command::new("conformance"));
        let none = command.get_matches_from([""; 0]);
        Self::from_arg_matches(&none).expect("every option has a default")
    }
}

impl Default for RandomCases {
    fn default() -> Self {
        Options::default().random
    }
}

/// A clause mostly waits, for its deadlines and for the solver's start.
fn jobs() -> u16 {
    let cores = std::thread::available_parallelism().map_or(1, NonZero::get);
    (2 * cores).min(8) as u16
}

fn seconds(text: &str) -> Result<Duration, ParseIntError> {
    text.parse()
        .map(|seconds: u32| Duration::from_secs(seconds.into()))
}

fn some_seconds(text: &str) -> Result<Duration, String> {
    match text.parse::<u16>() {
        Ok(0) => Err("it is at least 1".to_owned()),
        Ok(seconds) => Ok(Duration::from_secs(seconds.into())),
        Err(error) => Err(error.to_string()),
    }
}
