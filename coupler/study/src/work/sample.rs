//! Results of runs whose values were drawn.

use std::fmt;
use std::path::Path;

use coupler::record::check::CheckResult;

use super::Report;
use super::measure::Value;
use super::row::Row;
use crate::StudyError;
use crate::figure::chart::{Chart, DISCS, Panel, Series};
use crate::output::{number, write_table};
use crate::sample::{SHARES, Statistics};
use crate::vary::with_unit;

/// A line for each result: its name, the number of runs that have it, then the statistics.
fn lines(
    report: &Report,
    values: &[Value],
    cell: impl Fn(Option<f64>) -> String,
) -> Vec<Vec<String>> {
    let line = |(k, value): (usize, &Value)| {
        let name = value.header();
        let results = report.rows.iter().filter_map(|row| row.values[k]);
        let results: Vec<f64> = results.collect();
        let mut line = vec![name.clone(), results.len().to_string()];
        // There are none of fewer than two runs.
        let found = Statistics::of(results);
        line.push(cell(found.map(|found| found.mean)));
        line.push(cell(found.map(|found| found.deviation)));
        let quantiles = (0..SHARES.len()).map(|k| cell(found.map(|found| found.quantiles[k])));
        line.extend(quantiles);
        let judged = found.and_then(|found| judged(report, &name, found.mean));
        line.push(cell(judged.as_ref().map(|judged| judged.reference)));
        line.push(
            judged
                .map_or("-", |judged| if judged.pass { "yes" } else { "no" })
                .into(),
        );
        line
    };
    values.iter().enumerate().map(line).collect()
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
fn judged(report: &Report, name: &str, mean: f64) -> Option<CheckResult> {
    let rows = report.rows.iter().filter(|row| row.outcome().whole());
    let mut verdicts = rows.filter_map(|row| row.outcome().check(name)).peekable();
    let expected = verdicts.peek()?.expected;
    let judge = |value: f64| {
        let reference = expected.reference.flatten();
        let distance = reference.map_or(0.0, |reference| (value - reference).abs());
        expected.judge(value, distance)
    };
    verdicts
        .all(|verdict| verdict.expected == expected && judge(verdict.value).error == verdict.error)
        .then(|| judge(mean))
}

/// Writes the statistics to `path`.
pub(super) fn write_statistics(
    report: &Report,
    values: &[Value],
    path: &Path,
) -> Result<(), StudyError> {
    let mut all = vec![header()];
    all.extend(lines(report, values, number));
    write_table(path, &all)
}

/// A panel for each result over each key.
pub(super) fn chart(report: &Report, values: &[Value]) -> Chart {
    let (mut panels, mut points) = (Vec::new(), Vec::new());
    for (k, value) in values.iter().enumerate() {
        for key in &report.design.along {
            let point = |row: &Row| Some((row.case.number(key)?, row.values[k]?));
            points.push(report.rows.iter().filter_map(point).collect());
            panels.push(Panel {
                words: [String::new(), with_unit(key), value.header()],
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
    Chart {
        columns: 2,
        panels,
        series: vec![series],
        ..Chart::default()
    }
}

/// The statistics for people.
pub(super) fn words(report: &Report, values: &[Value], f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let mut all = vec![header()];
    let cell = |value: Option<f64>| value.map_or_else(|| "-".into(), |v| format!("{v:.4e}"));
    all.extend(lines(report, values, cell));
    let wide = all.iter().map(|line| line[0].chars().count()).max();
    let wide = wide.unwrap_or(0);
    for line in all {
        write!(f, "{:<wide$} {:>6}", line[0], line[1])?;
        for cell in &line[2..] {
            write!(f, " {cell:>11}")?;
        }
        writeln!(f)?;
    }
    Ok(())
}
