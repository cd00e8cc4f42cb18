//! A run of a study, what is measured of it, what tables say of its times, and what a report of runs can do.

use std::fmt;
use std::path::Path;

use crate::StudyError;
use crate::case::Case;
use crate::output::{self, number};
use crate::runner::{Runner, Timed};
use coupler::record::Summary;

/// What a study has found: errors against run time, values over what was varied, or statistics of a sample.
pub trait Report: fmt::Display {
    /// Its runs.
    fn rows(&self) -> &[Row];

    /// Writes `study.csv`; `alone` if no run shared the machine with another.
    ///
    /// # Errors
    /// [`StudyError::File`].
    fn write_csv(&self, path: &Path, alone: bool) -> Result<(), StudyError>;

    /// Draws `study.svg` of the runs of a scene, of which `jobs` were made at once.
    ///
    /// # Errors
    /// [`StudyError`].
    fn draw(&self, path: &Path, title: &str, jobs: usize) -> Result<(), StudyError>;
}

/// A run and what is measured of it.
#[derive(Debug, Clone)]
pub struct Row {
    /// Name of its directory in `runs`.
    pub run: String,
    /// The run.
    pub case: Case,
    /// Label of its curve.
    pub curve: String,
    /// Its resolution.
    pub resolution: Option<f64>,
    /// What it left, and its times.
    pub timed: Timed,
    /// Value of the check whose error is taken; of a sweep all that are asked for.
    pub values: Vec<Option<f64>>,
    /// Its error, if it has one.
    pub error: Option<f64>,
    /// Whether the others of its curve are compared with it.
    pub finest: bool,
    /// Whether no other run is both faster, by CPU time of stepping, and more precise.
    pub pareto: bool,
}

impl Row {
    /// A run of which nothing is measured yet.
    pub(crate) fn new(
        runner: &Runner,
        case: Case,
        timed: Timed,
        curve: String,
        resolution: Option<f64>,
    ) -> Self {
        Self {
            run: runner.name(&case),
            curve,
            resolution,
            values: Vec::new(),
            error: None,
            finest: false,
            pareto: false,
            case,
            timed,
        }
    }

    /// What it left.
    pub fn outcome(&self) -> &Summary {
        &self.timed.outcome
    }
}

/// Header of [`times`].
const TIMES: [&str; 11] = [
    "stepping cpu [s]",
    "stepping wall [s]",
    "repetitions",
    "scatter [1]",
    "cpu [s]",
    "wall [s]",
    "alone",
    "steps",
    "points",
    "dt_min [s]",
    "dt_max [s]",
];

/// What a run took; `alone` if no other ran at the time.
fn times(row: &Row, alone: bool) -> [String; TIMES.len()] {
    let o = row.outcome();
    [
        o.stepping_cpu().to_string(),
        o.spent.stepping_wall_s.to_string(),
        row.timed.times.len().to_string(),
        number(row.timed.scatter()),
        o.cpu().to_string(),
        o.spent.wall_s.to_string(),
        alone.to_string(),
        o.steps.to_string(),
        o.points.to_string(),
        number(o.dt_min),
        number(o.dt_max),
    ]
}

/// Curves in their order: label and rows.
pub(super) fn curves(rows: &[Row]) -> Vec<(&str, Vec<&Row>)> {
    let mut curves: Vec<(&str, Vec<&Row>)> = Vec::new();
    for row in rows {
        match curves.last_mut() {
            Some((label, rows)) if *label == row.curve => rows.push(row),
            _ => curves.push((&row.curve, vec![row])),
        }
    }
    curves
}

/// How many runs there are, in words.
pub(super) fn count(rows: &[Row], started: usize) -> String {
    let made: usize = rows.iter().map(|row| row.timed.times.len()).sum();
    let repeated = if made > rows.len() {
        format!(", repeated to {made}")
    } else {
        String::new()
    };
    let plural = if rows.len() == 1 { "" } else { "s" };
    format!(
        "{} run{plural}{repeated}, {started} of them new",
        rows.len()
    )
}

/// Writes a table with a row a run: what it is, its own columns (in the middle and at the end) and its times.
pub(crate) fn write_rows(
    path: &Path,
    rows: &[Row],
    alone: bool,
    [middle, end]: [&[String]; 2],
    own: impl Fn(&Row) -> [Vec<String>; 2],
) -> Result<(), StudyError> {
    let settings = rows.first().map_or(&[][..], |row| &row.case.settings);
    let text = |texts: &[&str]| texts.iter().map(ToString::to_string).collect::<Vec<_>>();
    let mut header = text(&["run", "curve"]);
    header.extend(settings.iter().map(|(key, _)| key.clone()));
    header.extend(text(&["resolution", "status"]));
    header.extend_from_slice(middle);
    header.extend(text(&TIMES));
    header.extend_from_slice(end);
    header.extend(text(&["scene_hash", "reason"]));
    let mut lines = vec![header];
    for row in rows {
        let outcome = row.outcome();
        let [middle, end] = own(row);
        let mut record = vec![row.run.clone(), row.curve.clone()];
        record.extend(row.case.settings.iter().map(|(_, value)| value.clone()));
        record.extend([number(row.resolution), outcome.status.name().to_owned()]);
        record.extend(middle);
        record.extend(times(row, alone));
        record.extend(end);
        let reason = outcome.reason.clone().unwrap_or_default();
        record.extend([row.case.scene.hash.clone(), reason]);
        lines.push(record);
    }
    output::write_table(path, &lines)
}
