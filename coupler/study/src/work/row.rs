//! A run of a study, what is measured of it, and the tables of runs.

use std::path::Path;

use crate::StudyError;
use crate::case::Case;
use crate::output::{self, number};
use crate::runner::{Runner, Timed};
use coupler::record::Summary;

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

/// A column of a table of runs: its header, and its cell of a run.
pub(crate) struct Column<'a>(String, Box<dyn Fn(&Row) -> String + 'a>);

pub(crate) fn column<'a>(
    header: impl Into<String>,
    cell: impl Fn(&Row) -> String + 'a,
) -> Column<'a> {
    Column(header.into(), Box::new(cell))
}

/// What a run took; `alone` if no other ran at the time.
fn times<'a>(alone: bool) -> [Column<'a>; 11] {
    [
        column("stepping cpu [s]", |row| {
            row.outcome().stepping_cpu().to_string()
        }),
        column("stepping wall [s]", |row| {
            row.outcome().spent.stepping_wall_s.to_string()
        }),
        column("repetitions", |row| row.timed.times.len().to_string()),
        column("scatter [1]", |row| number(row.timed.scatter())),
        column("cpu [s]", |row| row.outcome().cpu().to_string()),
        column("wall [s]", |row| row.outcome().spent.wall_s.to_string()),
        column("alone", move |_| alone.to_string()),
        column("steps", |row| row.outcome().steps.to_string()),
        column("points", |row| row.outcome().points.to_string()),
        column("dt_min [s]", |row| number(row.outcome().dt_min)),
        column("dt_max [s]", |row| number(row.outcome().dt_max)),
    ]
}

/// Curves in their order: label and rows.
pub(super) fn curves(rows: &[Row]) -> impl Iterator<Item = (&str, &[Row])> {
    let curves = rows.chunk_by(|a, b| a.curve == b.curve);
    curves.map(|rows| (rows[0].curve.as_str(), rows))
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
    let cut_short = rows.iter().filter(|row| !row.outcome().whole()).count();
    let cut_short = match cut_short {
        0 => String::new(),
        n => format!(", {n} of them without an end"),
    };
    format!(
        "{} run{plural}{repeated}, {started} of them new{cut_short}",
        rows.len()
    )
}

/// Writes a table with a row a run: what it is, columns of the `middle`, its times, and columns of the `end`.
pub(crate) fn write_rows(
    path: &Path,
    rows: &[Row],
    alone: bool,
    [middle, end]: [Vec<Column>; 2],
) -> Result<(), StudyError> {
    let settings = rows.first().map_or(&[][..], |row| &row.case.settings);
    let settings = settings.iter().enumerate();
    let mut columns = vec![
        column("run", |row| row.run.clone()),
        column("curve", |row| row.curve.clone()),
    ];
    columns.extend(
        settings.map(|(k, (key, _))| column(key, move |row| row.case.settings[k].1.clone())),
    );
    columns.push(column("resolution", |row| number(row.resolution)));
    columns.push(column("status", |row| {
        row.outcome().status.name().to_owned()
    }));
    columns.extend(middle);
    columns.extend(times(alone));
    columns.extend(end);
    columns.push(column("scene_hash", |row| row.case.scene.hash.clone()));
    columns.push(column("reason", |row| {
        row.outcome().reason.clone().unwrap_or_default()
    }));
    let header = columns
        .iter()
        .map(|Column(header, _)| header.clone())
        .collect();
    let line = |row| columns.iter().map(|Column(_, cell)| cell(row)).collect();
    let lines: Vec<Vec<String>> = std::iter::once(header)
        .chain(rows.iter().map(line))
        .collect();
    output::write_table(path, &lines)
}
