//! Values of runs over what was varied, where no error is asked for.

use std::fmt;
use std::path::Path;

use super::row::{Report, Row, count, curves, write_rows};
use crate::StudyError;
use crate::figure::chart::{CURVE, Chart, DISCS, Panel, Series};
use crate::output::number;
use crate::vary::{Vary, with_unit};

/// What a sweep has found.
#[derive(Debug, Clone)]
pub struct SweepReport {
    /// The key along the curves.
    pub key: String,
    /// Its values as they were given, where they are not all numbers.
    pub names: Option<Vec<String>>,
    /// Checks and columns whose values are shown, with the unit of columns.
    pub values: Vec<String>,
    /// The runs, curve by curve, in the order of the key's values.
    pub rows: Vec<Row>,
    /// Runs that were started for it; the others were there.
    pub started: usize,
}

impl Report for SweepReport {
    fn rows(&self) -> &[Row] {
        &self.rows
    }

    fn write_csv(&self, path: &Path, alone: bool) -> Result<(), StudyError> {
        write_rows(path, &self.rows, alone, [&self.values, &[]], |row| {
            [row.values.iter().copied().map(number).collect(), Vec::new()]
        })
    }

    fn draw(&self, path: &Path, title: &str, _jobs: usize) -> Result<(), StudyError> {
        let points = |rows: &[&Row], k: usize| {
            let rows = rows.iter();
            rows.filter_map(|row| Some((row.resolution?, row.values[k]?)))
                .collect()
        };
        let series = curves(&self.rows).into_iter().map(|(label, rows)| Series {
            label: label.to_owned(),
            colour: None,
            forms: vec![CURVE, DISCS],
            points: (0..self.values.len()).map(|k| points(&rows, k)).collect(),
        });
        let panel = |value: &String| Panel {
            words: [String::new(), with_unit(&self.key), value.clone()],
            ..Panel::default()
        };
        let chart = Chart {
            title: title.to_owned(),
            columns: 2,
            names: self.names.clone(),
            panels: self.values.iter().map(panel).collect(),
            series: series.collect(),
            ..Chart::default()
        };
        chart.draw(path)
    }
}

/// The place of a run along the curves: the number of the key, or the place of its value among those that were given.
pub(super) fn place(row: &Row, key: &str, named: Option<&Vary>) -> Option<f64> {
    let Some(vary) = named else {
        return row.case.number(key);
    };
    let (_, own) = row.case.settings.iter().find(|(known, _)| known == key)?;
    let place = vary.values.iter().position(|value| value == own)?;
    Some(place as f64)
}

/// The table for people: a line a value, a column a run.
impl fmt::Display for SweepReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let longest = self
            .values
            .iter()
            .chain([&self.key])
            .map(|name| name.chars().count());
        let wide = longest.max().unwrap_or(0);
        for (label, rows) in curves(&self.rows) {
            if !label.is_empty() {
                writeln!(f, "{label}:")?;
            }
            let key = |row: &Row| match (&self.names, row.resolution) {
                (Some(names), Some(place)) => names[place as usize].clone(),
                (None, Some(number)) => number.to_string(),
                (_, None) => "-".to_owned(),
            };
            let column: Vec<usize> = rows
                .iter()
                .map(|row| key(row).chars().count().max(11))
                .collect();
            let mut line = |name: &str, cell: &dyn Fn(&Row) -> String| {
                write!(f, "  {name:<wide$}")?;
                for (row, wide) in rows.iter().zip(&column) {
                    write!(f, "  {:>wide$}", cell(row))?;
                }
                writeln!(f)
            };
            line(&self.key, &key)?;
            for (k, name) in self.values.iter().enumerate() {
                let cell = |row: &Row| match row.values[k] {
                    Some(value) => format!("{value:.4e}"),
                    None => row.outcome().status.name().to_owned(),
                };
                line(name, &cell)?;
            }
        }
        f.write_str(&count(&self.rows, self.started))
    }
}
