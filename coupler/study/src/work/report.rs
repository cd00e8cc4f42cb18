//! What a study has found, as a table, a figure and words.

use std::fmt;
use std::path::Path;

use super::row::Row;
use crate::StudyError;
use crate::figure::precision::{Curve, Panel, draw};
use crate::outcome::Outcome;
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
    /// Curves in their order: label and rows.
    fn curves(&self) -> Vec<(&str, Vec<&Row>)> {
        let mut curves: Vec<(&str, Vec<&Row>)> = Vec::new();
        for row in &self.rows {
            match curves.last_mut() {
                Some((label, rows)) if *label == row.curve => rows.push(row),
                _ => curves.push((&row.curve, vec![row])),
            }
        }
        curves
    }

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

    pub(super) fn write_csv(&self, path: &Path, alone: bool) -> Result<(), StudyError> {
        let keys: Vec<&String> = self
            .rows
            .iter()
            .take(1)
            .flat_map(|r| r.case.settings.iter().map(|(k, _)| k))
            .collect();
        let mut table = csv::Writer::from_writer(Vec::new());
        let mut header: Vec<&str> = vec!["run", "curve"];
        header.extend(keys.iter().map(|key| key.as_str()));
        header.extend([
            "resolution",
            "status",
            "value",
            "error [1]",
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
            "pareto_cpu",
            "pareto_wall",
            "scene_hash",
            "reason",
        ]);
        let number = |n: Option<f64>| n.map_or_else(String::new, |n| n.to_string());
        let mut records = vec![
            header
                .iter()
                .map(ToString::to_string)
                .collect::<Vec<String>>(),
        ];
        for row in &self.rows {
            let o = row.outcome();
            let mut record = vec![row.run.clone(), row.curve.clone()];
            record.extend(row.case.settings.iter().map(|(_, value)| value.clone()));
            record.extend([
                number(row.resolution),
                o.status.name().to_owned(),
                number(row.value),
                number(row.error),
                o.stepping_cpu().to_string(),
                o.stepping_wall_s.to_string(),
                row.timed.times.len().to_string(),
                number(row.timed.scatter()),
                o.cpu().to_string(),
                o.wall_s.to_string(),
                alone.to_string(),
                o.steps.to_string(),
                o.points.to_string(),
                number(o.dt_min),
                number(o.dt_max),
                row.pareto_cpu.to_string(),
                row.pareto_wall.to_string(),
                row.case.scene.hash.clone(),
                o.reason.clone().unwrap_or_default(),
            ]);
            records.push(record);
        }
        for record in records {
            table
                .write_record(record)
                .expect("rows of one length into memory");
        }
        let bytes = table.into_inner().expect("memory takes everything");
        std::fs::write(path, bytes).map_err(StudyError::file("write", path))
    }

    pub(super) fn draw(&self, path: &Path, title: &str, jobs: usize) -> Result<(), StudyError> {
        let curves: Vec<Curve> = self
            .curves()
            .into_iter()
            .map(|(label, rows)| {
                let order = Self::order(&rows).map(|p| format!("order {p:.2}"));
                let points = |cost: fn(&Outcome) -> f64, front: fn(&Row) -> bool| {
                    rows.iter()
                        .filter_map(|row| Some((cost(row.outcome()), row.error?, front(row))))
                        .collect()
                };
                let label = if label.is_empty() { "all runs" } else { label };
                Curve {
                    label: match order {
                        Some(order) => format!("{label}: {order}"),
                        None => label.to_owned(),
                    },
                    points: [
                        points(Outcome::stepping_cpu, |row| row.pareto_cpu),
                        points(|o| o.stepping_wall_s, |row| row.pareto_wall),
                    ],
                }
            })
            .collect();
        let shared = if jobs > 1 {
            format!(" ({jobs} runs at once)")
        } else {
            String::new()
        };
        let panel = |time: &str| Panel {
            x: format!("{time} in s{shared}"),
            y: self.error_of.clone(),
        };
        let note = format!(
            "ring: Pareto front; order: of the error in {}",
            with_unit(&self.resolution)
        );
        let panels = [
            panel("CPU time of stepping"),
            panel("wall time of stepping"),
        ];
        draw(path, title, &panels, &curves, &note)
    }

    /// Whether a run failed, for a reason that is not the method's.
    pub fn failed(&self) -> bool {
        self.rows.iter().any(|row| !row.outcome().settled())
    }
}

/// The table for people.
impl fmt::Display for WorkReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let of = &self.error_of;
        writeln!(f, "{of}; `*`: on the Pareto front of CPU time of stepping")?;
        for (label, rows) in self.curves() {
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
        let made: usize = self.rows.iter().map(|row| row.timed.times.len()).sum();
        let repeated = if made > self.rows.len() {
            format!(", repeated to {made}")
        } else {
            String::new()
        };
        let count = match self.rows.len() {
            1 => "1 run".to_owned(),
            n => format!("{n} runs"),
        };
        write!(f, "{count}{repeated}, {} of them new", self.started)
    }
}

/// A run in a line. One that failed has no times to compare.
fn line(row: &Row) -> String {
    let outcome = row.outcome();
    let number = |n: Option<f64>| n.map_or_else(|| "-".to_owned(), |n| format!("{n:.3e}"));
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
        if row.pareto_cpu { '*' } else { ' ' },
        outcome.status.name(),
        row.resolution.map_or_else(String::new, |h| h.to_string()),
        number(row.error),
        time(outcome.stepping_cpu()),
        time(outcome.stepping_wall_s),
        row.timed.times.len(),
        outcome.steps,
        reason.map_or_else(String::new, |r| format!("  ({r})")),
    )
}
