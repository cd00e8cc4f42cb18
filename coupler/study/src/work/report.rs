//! What a study has found, as a table, a figure and words.

use std::fmt;
use std::path::Path;

use plotters::style::BLACK;

use super::row::{Report, Row, count, curves, write_rows};
use crate::StudyError;
use crate::figure::axis::Scale;
use crate::figure::chart::{CURVE, Chart, DISCS, Panel, Series};
use crate::figure::shape::Form;
use crate::output::number;
use crate::precision::{order, order_against};
use crate::vary::with_unit;

/// What a study has found.
#[derive(Debug, Clone)]
pub struct WorkReport {
    /// What the error is of.
    pub error_of: String,
    /// Key of the resolution.
    pub resolution: String,
    /// The runs, curve by curve, each from coarse to fine.
    pub rows: Vec<Row>,
    /// Runs that were started for it; the others were there.
    pub started: usize,
}

impl WorkReport {
    /// Observed order of a curve: of the error in the resolution.
    fn order(rows: &[&Row]) -> Option<f64> {
        let points: Vec<(f64, f64)> = rows
            .iter()
            .filter_map(|row| Some((row.resolution?, row.error?)))
            .collect();
        match rows.iter().rfind(|row| row.finest) {
            Some(finest) => order_against(finest.resolution?, &points),
            None => order(&points),
        }
    }
}

impl Report for WorkReport {
    fn rows(&self) -> &[Row] {
        &self.rows
    }

    fn write_csv(&self, path: &Path, alone: bool) -> Result<(), StudyError> {
        let names = |names: &[&str]| names.iter().map(ToString::to_string).collect::<Vec<_>>();
        let (middle, end) = (names(&["value", "error [1]"]), names(&["pareto_cpu"]));
        write_rows(path, &self.rows, alone, [&middle, &end], |row| {
            let value = row.values.first().copied().flatten();
            [
                vec![number(value), number(row.error)],
                vec![row.pareto.to_string()],
            ]
        })
    }

    fn draw(&self, path: &Path, title: &str, jobs: usize) -> Result<(), StudyError> {
        let mut series = Vec::new();
        let mut rings = Vec::new();
        for (label, rows) in curves(&self.rows) {
            let label = if label.is_empty() { "all runs" } else { label };
            let label = match Self::order(&rows) {
                Some(order) => format!("{label}: order {order:.2}"),
                None => label.to_owned(),
            };
            let mut points = Vec::new();
            for row in rows {
                let Some(error) = row.error else { continue };
                let point = (row.outcome().stepping_cpu(), error);
                points.push(point);
                rings.extend(row.pareto.then_some(point));
            }
            series.push(Series {
                label,
                colour: None,
                forms: vec![CURVE, DISCS],
                points: vec![points],
            });
        }
        series.push(Series {
            label: "Pareto front".to_owned(),
            colour: Some(BLACK),
            forms: vec![Form::Discs(9.0, false)],
            points: vec![rings],
        });
        let shared = if jobs > 1 {
            format!(" ({jobs} runs at once)")
        } else {
            String::new()
        };
        let panel = Panel {
            words: [
                String::new(),
                format!("CPU time of stepping in s{shared}"),
                self.error_of.clone(),
            ],
            scales: [Some(Scale::Log); 2],
            ..Panel::default()
        };
        let chart = Chart {
            title: title.to_owned(),
            note: format!("order: of the error in {}", with_unit(&self.resolution)),
            panels: vec![panel],
            series,
            ..Chart::default()
        };
        chart.draw(path)
    }
}

/// The table for people.
impl fmt::Display for WorkReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let of = &self.error_of;
        writeln!(f, "{of}; `*`: on the Pareto front of CPU time of stepping")?;
        for (label, rows) in curves(&self.rows) {
            let order = Self::order(&rows).map_or_else(
                || "no order".to_owned(),
                |p| format!("order {p:.2} in {}", self.resolution),
            );
            let label = if label.is_empty() { "all runs" } else { label };
            writeln!(f, "{label}: {order}")?;
            for row in rows {
                writeln!(f, "  {}", line(row))?;
            }
        }
        f.write_str(&count(&self.rows, self.started))
    }
}

/// A run in a line. One that failed has no times to compare.
fn line(row: &Row) -> String {
    let outcome = row.outcome();
    let error = |n: f64| format!("{n:.3e}");
    let time = |s: f64| {
        if outcome.whole() {
            format!("{s:>9.4} s")
        } else {
            format!("{:>9}  ", "-")
        }
    };
    let reason = outcome.reason.as_ref();
    format!(
        "{} {:<12} {:>10}  error {:>10}  stepping: cpu {}  wall {}  of {:>2}  {:>8} steps{}",
        if row.pareto { '*' } else { ' ' },
        outcome.status.name(),
        row.resolution.map_or_else(String::new, |h| h.to_string()),
        row.error.map_or_else(|| "-".to_owned(), error),
        time(outcome.stepping_cpu()),
        time(outcome.spent.stepping_wall_s),
        row.timed.times.len(),
        outcome.steps,
        reason.map_or_else(String::new, |r| format!("  ({r})")),
    )
}
