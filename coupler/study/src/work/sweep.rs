//! Values of runs over what was varied, where no error is asked for.

use std::fmt;

use super::Report;
use super::measure::Value;
use super::row::{Column, Row, column, curves};
use crate::figure::chart::{CURVE, Chart, DISCS, Panel, Series};
use crate::output::number;
use crate::vary::{Vary, with_unit};

/// A column for each value.
pub(super) fn columns(values: &[Value]) -> Vec<Column<'_>> {
    let values = values.iter().enumerate();
    let of = |(k, value): (usize, &Value)| column(value.header(), move |row| number(row.values[k]));
    values.map(of).collect()
}

/// A panel for each value.
pub(super) fn chart(report: &Report, values: &[Value]) -> Chart {
    let points = |rows: &[Row], k: usize| {
        let rows = rows.iter();
        rows.filter_map(|row| Some((row.resolution?, row.values[k]?)))
            .collect()
    };
    let series = curves(&report.rows).map(|(label, rows)| Series {
        label: label.to_owned(),
        colour: None,
        forms: vec![CURVE, DISCS],
        points: (0..values.len()).map(|k| points(rows, k)).collect(),
    });
    let panel = |value: &Value| Panel {
        words: [
            String::new(),
            with_unit(&report.design.resolution),
            value.header(),
        ],
        ..Panel::default()
    };
    Chart {
        columns: 2,
        names: report.design.named.as_ref().map(|vary| vary.values.clone()),
        panels: values.iter().map(panel).collect(),
        series: series.collect(),
        ..Chart::default()
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
pub(super) fn words(report: &Report, values: &[Value], f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let along = &report.design.resolution;
    let names: Vec<String> = values.iter().map(Value::header).collect();
    let longest = names.iter().chain([along]).map(|name| name.chars().count());
    let wide = longest.max().unwrap_or(0);
    for (label, rows) in curves(&report.rows) {
        if !label.is_empty() {
            writeln!(f, "{label}:")?;
        }
        let key = |row: &Row| match (&report.design.named, row.resolution) {
            (Some(vary), Some(place)) => vary.values[place as usize].clone(),
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
        line(along, &key)?;
        for (k, name) in names.iter().enumerate() {
            let cell = |row: &Row| match row.values[k] {
                Some(value) => format!("{value:.4e}"),
                None => row.outcome().status.name().to_owned(),
            };
            line(name, &cell)?;
        }
    }
    Ok(())
}
