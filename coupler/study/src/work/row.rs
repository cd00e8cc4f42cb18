//! A run of a study and its error.

use crate::case::Case;
use crate::outcome::Outcome;
use crate::runner::Timed;

/// A run and its error.
#[derive(Debug, Clone)]
pub struct Row {
    /// Name of its directory in `runs`.
    pub run: String,
    /// The run.
    pub case: Case,
    /// Label of its curve.
    pub curve: String,
    /// The number that tells how fine it is.
    pub resolution: Option<f64>,
    /// What it left, and its times.
    pub timed: Timed,
    /// Value of the check whose error is taken.
    pub value: Option<f64>,
    /// Its error, if it has one.
    pub error: Option<f64>,
    /// Whether the others of its curve are compared with it.
    pub finest: bool,
    /// Whether no other run is both faster, by CPU time of stepping, and more precise.
    pub pareto_cpu: bool,
    /// Likewise by wall time.
    pub pareto_wall: bool,
}

impl Row {
    /// What it left.
    pub fn outcome(&self) -> &Outcome {
        &self.timed.outcome
    }
}
