//! `tandem stability`: where runs become unstable, measured, beside what the criteria say.
//!
//! A run is unstable when it ends so (exit status 4), fails under a step that is forced, or when its ledger shows more
//! energy from nowhere than a bound. The scene's cap is lifted, and its history is taken [`OUTPUTS`] times, so that
//! nothing but the criterion makes the step.

pub mod edge;
mod map;

use std::path::PathBuf;

use clap::Args;
use coupler::record::Summary;
use coupler::record::summary::Status;

use crate::StudyError;
use crate::case::Source;
use crate::runner::RunnerOptions;
use crate::vary::Setting;
use crate::work::Row;
use edge::Search;

pub use map::{MapReport, maps};

/// Scene key that forces the step.
pub const STEP_FACTOR: &str = "time.step_factor";
/// Rows of the history of a run, besides the first.
const OUTPUTS: f64 = 20.0;

/// What is mapped.
#[derive(Debug, Args)]
pub struct StabilityOptions {
    /// Scene files.
    #[arg(required = true)]
    pub scenes: Vec<PathBuf>,
    /// The runs.
    #[command(flatten)]
    pub runs: RunnerOptions,
    /// Named variant of the scenes; `quick` by default if they have it.
    #[arg(long, value_name = "NAME")]
    pub variant: Option<String>,
    /// Override a scene key; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Columns of the map: a scene key and its numbers.
    #[arg(long, value_name = "KEY=N1,N2,...")]
    pub vary: String,
    /// How the limit of [`STEP_FACTOR`] is searched for.
    #[command(flatten)]
    pub search: Search,
    /// Largest share of the energy in play that a stable run may create numerically.
    #[arg(long, value_name = "SHARE", default_value_t = 0.05, value_parser = share)]
    pub residual: f64,
}

fn share(text: &str) -> Result<f64, String> {
    let share = text.parse().ok().filter(|share| *share >= 0.0);
    share.ok_or_else(|| "expected a number that is not negative".into())
}

/// A scene whose step nothing but the criterion makes.
fn freed(source: &Source) -> Result<Source, StudyError> {
    let end = source.case(&[])?.scene.time.end;
    let mut freed = source.clone();
    freed.set.push(format!("time.max_step={end}"));
    freed.set.push(format!("output.every={}", end / OUTPUTS));
    Ok(freed)
}

/// Whether a run was stable, if it may create this share of the energy in play.
fn is_stable(outcome: &Summary, residual: f64) -> bool {
    outcome.whole() && outcome.energy.residual_max <= residual
}

fn setting(key: &str, value: f64) -> Setting {
    (key.to_owned(), value.to_string())
}

/// Refuses runs that say nothing about stability: a scene that fails without any forced step.
fn usable(row: &Row) -> Result<(), StudyError> {
    let outcome = row.outcome();
    if outcome.status == Status::Failed {
        let reason = outcome.reason.clone().unwrap_or_default();
        return Err(StudyError::usage(
            format!("{} does not run: {reason}", row.case.label(&[])),
            "a map is of a scene that runs",
        ));
    }
    Ok(())
}
