//! Errors of runs against the time that they take.

use std::fmt;

use plotters::style::BLACK;

use super::Report;
use super::row::{Column, Row, column, curves};
use crate::figure::axis::Scale;
use crate::figure::chart::{CURVE, Chart, DISCS, Panel, Series};
use crate::figure::shape::Form;
use crate::output::number;
use crate::precision::{order, order_against};
use crate::vary::with_unit;

/// Observed order of a curve: of the error in the resolution `key`.
fn order_of(rows: &[Row], key: &str) -> Option<f64> {
    // Outputs and other limits cut the longest step: what counts is how long steps were.
    let is_step = ["time.max_step", "time.safety", "time.step_factor"].contains(&key);
    let is_count = key.ends_with(".per_cell");
    let size = |row: &Row| match row.outcome() {
        ended if is_step => Some(ended.time / ended.steps as f64),
        _ if is_count => row.resolution.map(|points| points.sqrt().recip()),
        _ => row.resolution,
    };
    let points: Vec<(f64, f64)> = rows
        .iter()
        .filter_map(|row| Some((size(row)?, row.error?)))
        .collect();
    match rows.iter().rfind(|row| row.finest) {
        Some(finest) => order_against(size(finest)?, &points),
        None => order(&points),
    }
}

/// The columns in the middle and at the end of the table.
pub(super) fn columns<'a>() -> [Vec<Column<'a>>; 2] {
    let value = column("value", |row| number(row.values.first().copied().flatten()));
    let error = column("error [1]", |row| number(row.error));
    let pareto = column("pareto_cpu", |row| row.pareto.to_string());
    [vec![value, error], vec![pareto]]
}

/// The figure of runs of which `jobs` were made at once.
pub(super) fn chart(report: &Report, jobs: usize) -> Chart {
    let mut series = Vec::new();
    let mut rings = Vec::new();
    for (label, rows) in curves(&report.rows) {
        let label = if label.is_empty() { "all runs" } else { label };
        let label = match order_of(rows, &report.design.resolution) {
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
            report.design.measure.title(),
        ],
        scales: [Some(Scale::Log); 2],
        ..Panel::default()
    };
    Chart {
        note: format!(
            "order: of the error in {}",
            with_unit(&report.design.resolution)
        ),
        panels: vec![panel],
        series,
        ..Chart::default()
    }
}

/// The table for people.
pub(super) fn words(report: &Report, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let of = report.design.measure.title();
    writeln!(f, "{of}; `*`: on the Pareto front of CPU time of stepping")?;
    for (label, rows) in curves(&report.rows) {
        let key = &report.design.resolution;
        let order = order_of(rows, key).map_or_else(
            || "no order".to_owned(),
            |p| format!("order {p:.2} in {key}"),
        );
        let label = if label.is_empty() { "all runs" } else { label };
        writeln!(f, "{label}: {order}")?;
        for row in rows {
            writeln!(f, "  {}", line(row))?;
        }
    }
    Ok(())
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
