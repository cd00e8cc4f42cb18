//! Results of runs whose values were drawn.

use std::fmt;
use std::path::Path;

use coupler::record::check::CheckResult;

use super::row::{Report, Row, count};
use super::sweep::SweepReport;
use crate::StudyError;
use crate::figure::chart::{Chart, DISCS, Panel, Series};
use crate::output::{number, write_table};
use crate::sample::{SHARES, Statistics};
use crate::vary::with_unit;

/// What a sample has found: its runs as those of a sweep.
#[derive(Debug, Clone)]
pub struct SampleReport {
    /// The keys that were drawn.
    pub keys: Vec<String>,
    /// Its runs, in the order in which they were drawn.
    pub runs: SweepReport,
}

impl SampleReport {
    /// Of a result, if at least two runs have it.
    pub fn statistics(&self, result: usize) -> Option<Statistics> {
        let values = self.runs.rows.iter().filter_map(|row| row.values[result]);
        Statistics::of(values.collect())
    }

    /// A line for each result: its name, the number of runs that have it, then the statistics.
    fn lines(&self, cell: impl Fn(Option<f64>) -> String) -> Vec<Vec<String>> {
        let line = |(k, name): (usize, &String)| {
            let found = self.statistics(k);
            let runs = found.map_or(0, |found| found.count);
            let mut line = vec![name.clone(), runs.to_string()];
            line.push(cell(found.map(|found| found.mean)));
            line.push(cell(found.map(|found| found.deviation)));
            let quantiles = (0..SHARES.len()).map(|k| cell(found.map(|found| found.quantiles[k])));
            line.extend(quantiles);
            let judged = found.and_then(|found| self.judged(name, found.mean));
            line.push(cell(judged.as_ref().map(|judged| judged.reference)));
            line.push(
                judged
                    .map_or("-", |judged| if judged.pass { "yes" } else { "no" })
                    .into(),
            );
            line
        };
        self.runs.values.iter().enumerate().map(line).collect()
    }

    fn header() -> Vec<String> {
        let names = ["result", "runs", "mean", "standard deviation"];
        let shares = SHARES.map(|share| format!("{:.0} %", 100.0 * share));
        let names = names.into_iter().map(String::from).chain(shares);
        names
            .chain(["reference", "mean passes"].map(String::from))
            .collect()
    }

    /// The verdict of a check on the mean of its values, if all runs are compared with the same and by their value alone
    /// (`rms_error` is not).
    fn judged(&self, name: &str, mean: f64) -> Option<CheckResult> {
        let rows = self.runs.rows.iter().filter(|row| row.outcome().whole());
        let mut verdicts = rows.filter_map(|row| row.outcome().check(name)).peekable();
        let expected = verdicts.peek()?.expected;
        let judge = |value: f64| {
            let reference = expected.reference.flatten();
            let distance = reference.map_or(0.0, |reference| (value - reference).abs());
            expected.judge(value, distance)
        };
        verdicts
            .all(|verdict| {
                verdict.expected == expected && judge(verdict.value).error == verdict.error
            })
            .then(|| judge(mean))
    }
}

impl Report for SampleReport {
    fn rows(&self) -> &[Row] {
        &self.runs.rows
    }

    /// Writes the runs to `path`, and beside it `statistics.csv`.
    fn write_csv(&self, path: &Path, alone: bool) -> Result<(), StudyError> {
        self.runs.write_csv(path, alone)?;
        let mut lines = vec![Self::header()];
        lines.extend(self.lines(number));
        write_table(&path.with_file_name("statistics.csv"), &lines)
    }

    /// A panel for each result over each key.
    fn draw(&self, path: &Path, title: &str, _jobs: usize) -> Result<(), StudyError> {
        let rows = &self.runs.rows;
        let (mut panels, mut points) = (Vec::new(), Vec::new());
        for (k, name) in self.runs.values.iter().enumerate() {
            for key in &self.keys {
                let point = |row: &Row| Some((row.case.number(key)?, row.values[k]?));
                points.push(rows.iter().filter_map(point).collect());
                panels.push(Panel {
                    words: [String::new(), with_unit(key), name.clone()],
                    ..Panel::default()
                });
            }
        }
        let series = Series {
            label: String::new(),
            colour: None,
            forms: vec![DISCS],
            points,
        };
        let chart = Chart {
            title: title.to_owned(),
            columns: 2,
            panels,
            series: vec![series],
            ..Chart::default()
        };
        chart.draw(path)
    }
}

/// The statistics for people.
impl fmt::Display for SampleReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut lines = vec![Self::header()];
        let cell = |value: Option<f64>| value.map_or_else(|| "-".into(), |v| format!("{v:.4e}"));
        lines.extend(self.lines(cell));
        let wide = lines.iter().map(|line| line[0].chars().count()).max();
        let wide = wide.unwrap_or(0);
        for line in lines {
            write!(f, "{:<wide$} {:>6}", line[0], line[1])?;
            for cell in &line[2..] {
                write!(f, " {cell:>11}")?;
            }
            writeln!(f)?;
        }
        f.write_str(&count(&self.runs.rows, self.runs.started))
    }
}
