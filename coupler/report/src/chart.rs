//! What the page's script draws as curves.

use coupler::run::stability::Bound;
use serde::Serialize;

use crate::record::Record;
use coupler::record::Table;

/// Rows of a table that a curve has room for.
const ROWS: usize = 600;
/// Columns of the history that are drawn.
const COLUMNS: usize = 48;
/// Parts of the ledger that are held or lost, in the order in which they are stacked, with their words.
const PARTS: [(&str, &str); 9] = [
    ("kinetic", "Motion"),
    ("rotation", "Rotation of bodies"),
    ("elastic", "Elastic"),
    ("gravity", "Gravity, above its lowest"),
    ("contact", "Contact springs"),
    ("friction", "Lost by friction"),
    ("viscous", "Lost by viscosity"),
    ("plastic", "Lost by plastic flow"),
    ("transfer", "Lost by the transfer"),
];
/// A part below this share of the largest is not drawn: it would be thinner than a line.
const VISIBLE: f64 = 1e-6;

/// Numbers over time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Series {
    /// For the legend.
    pub label: String,
    /// In the unit of the chart; `null` where there is no number.
    pub values: Vec<f32>,
    /// The number of its colour.
    pub colour: usize,
}

/// All curves of a run.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Charts {
    /// The energy ledger.
    pub energy: Option<Energy>,
    /// What bound the step.
    pub steps: Option<Steps>,
    /// The columns of the history.
    pub history: Vec<Curve>,
    /// What is left out of these curves, for people.
    #[serde(skip)]
    pub notes: Notes,
}

/// What is left out of curves, by chart.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Notes {
    /// Of the energies and of the steps, which are one table.
    pub course: Option<String>,
    /// Of the history.
    pub history: Vec<String>,
}

/// The energy ledger over time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Energy {
    /// s.
    pub time: Vec<f32>,
    /// In J/m, to be stacked.
    pub parts: Vec<Series>,
    /// What they should add up to: the start and the work put in since, in J/m.
    pub expected: Vec<f32>,
}

/// The steps over time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Steps {
    /// Ends of the intervals in s, one more than intervals.
    pub time: Vec<f32>,
    /// Share of an interval's steps by what bound them, in percent.
    pub shares: Vec<Series>,
    /// Mean step of each interval in s.
    pub step: Vec<f32>,
}

/// A column of the history.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Curve {
    /// Its name.
    pub label: String,
    /// Its unit; empty of a pure number.
    pub unit: String,
    /// s.
    pub time: Vec<f32>,
    /// In that unit.
    pub values: Vec<f32>,
}

/// The curves of a run.
pub fn charts(record: &Record) -> Charts {
    let mut notes = Notes::default();
    let course = record.course.as_ref().filter(|course| course.rows() > 0);
    let thin = course.map(|course| thin(course, ROWS));
    notes.course = course.and_then(|course| thinned(course.rows()));
    Charts {
        energy: thin.as_ref().and_then(energy),
        steps: thin.as_ref().and_then(steps),
        history: history(record, &mut notes),
        notes,
    }
}

/// At most so many rows of a table, evenly spread, the first and the last among them.
fn thin(table: &Table, most: usize) -> Table {
    let kept = crate::thin::evenly(table.rows(), most);
    table.rows_at(&kept)
}

fn thinned(rows: usize) -> Option<String> {
    (rows > ROWS).then(|| {
        format!(
            "{ROWS} of {} rows are drawn, evenly spread.",
            crate::words::count(rows as u64)
        )
    })
}

fn energy(course: &Table) -> Option<Energy> {
    let column = |name: &str| course.column(name).map(|column| &column.values[..]);
    let rows = course.rows();
    let lowest = column("gravity").map_or(0.0, |g| g.iter().copied().fold(f64::INFINITY, f64::min));
    let parts: Vec<(usize, Vec<f64>)> = PARTS
        .iter()
        .enumerate()
        .filter_map(|(k, (name, _))| {
            let shift = if *name == "gravity" { lowest } else { 0.0 };
            let values = column(name)?.iter().map(|value| value - shift);
            // A transfer that has given more than it took has lost nothing, as in the total.
            let least = if *name == "transfer" {
                0.0
            } else {
                f64::NEG_INFINITY
            };
            Some((k, values.map(|value| value.max(least)).collect()))
        })
        .collect();
    let start: f64 = parts.iter().map(|(_, values)| values[0]).sum();
    let driven = column("driven");
    let put_in = |row: usize| driven.map_or(0.0, |driven| driven[row] - driven[0]);
    Some(Energy {
        time: short(column("time")?),
        expected: (0..rows).map(|row| (start + put_in(row)) as f32).collect(),
        parts: visible(parts),
    })
}

/// The parts that are large enough to be seen; the first where none is.
fn visible(parts: Vec<(usize, Vec<f64>)>) -> Vec<Series> {
    let size = |values: &[f64]| values.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    let largest = parts.iter().map(|(_, v)| size(v)).fold(0.0, f64::max);
    let seen = |values: &[f64]| size(values) > VISIBLE * largest;
    let series = |(k, values): (usize, Vec<f64>)| Series {
        label: PARTS[k].1.to_owned(),
        values: short(&values),
        colour: k,
    };
    let parts = parts.into_iter();
    parts
        .filter(|(_, values)| seen(values))
        .map(series)
        .collect()
}

fn steps(course: &Table) -> Option<Steps> {
    let time = &course.column("time")?.values;
    let counts: Vec<(usize, &[f64])> = Bound::ALL
        .iter()
        .enumerate()
        .filter_map(|(k, bound)| {
            let column = course.column(&format!("steps by {}", bound.name()))?;
            Some((k, &column.values[..]))
        })
        .collect();
    // Rows between which no step was taken, such as the last one of an interrupted run, are no interval.
    let total = |row: usize| counts.iter().map(|(_, n)| n[row]).sum::<f64>();
    let mut rows = vec![0];
    for row in 1..time.len() {
        let last = rows[rows.len() - 1];
        if total(row) > total(last) && time[row] > time[last] {
            rows.push(row);
        }
    }
    if rows.len() < 2 {
        return None;
    }
    let intervals = || rows.windows(2).map(|pair| (pair[0], pair[1]));
    let shares = counts.iter().filter_map(|(k, n)| {
        let share = |(a, b): (usize, usize)| 100.0 * (n[b] - n[a]) / (total(b) - total(a));
        let values: Vec<f32> = intervals().map(|i| share(i) as f32).collect();
        let any = values.iter().any(|&value| value > 0.0);
        any.then(|| Series {
            label: words_of_bound(Bound::ALL[*k]).to_owned(),
            values,
            colour: *k,
        })
    });
    let mean = |(a, b): (usize, usize)| (time[b] - time[a]) / (total(b) - total(a));
    Some(Steps {
        time: rows.iter().map(|&row| time[row] as f32).collect(),
        shares: shares.collect(),
        step: intervals().map(|i| mean(i) as f32).collect(),
    })
}

fn history(record: &Record, notes: &mut Notes) -> Vec<Curve> {
    let Some(history) = record.history.as_ref().filter(|history| history.rows() > 0) else {
        return Vec::new();
    };
    notes.history.extend(thinned(history.rows()));
    let thin = thin(history, ROWS);
    let Some((time, columns)) = thin.columns.split_first() else {
        return Vec::new();
    };
    if columns.len() > COLUMNS {
        notes.history.push(format!(
            "The first {COLUMNS} of {} columns are drawn; history.csv has all of them.",
            columns.len()
        ));
    }
    let curve = |column: &coupler::record::table::Column| Curve {
        label: column.name.clone(),
        unit: if column.unit == "1" {
            String::new()
        } else {
            crate::words::unit_of(&column.unit)
        },
        time: short(&time.values),
        values: short(&column.values),
    };
    columns.iter().take(COLUMNS).map(curve).collect()
}

/// What binds a step, for people who have not read its source.
fn words_of_bound(bound: Bound) -> &'static str {
    match bound {
        Bound::Elastic => "Waves in the material",
        Bound::Contact => "Contact of points and bodies",
        Bound::Bodies => "Contact between bodies",
        Bound::Kinematic => "Distance moved in a step",
        Bound::Cap => "Longest step of the scene",
        Bound::Output => "The next output",
        Bound::Growth => "Growth by at most 10 %",
    }
}

/// As many digits as a screen shows, and half the bytes.
fn short(values: &[f64]) -> Vec<f32> {
    values.iter().map(|&value| value as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn course() -> Table {
        Table::parse(
            "time [s],step [s],steps by elastic [1],steps by contact [1],steps by output [1],kinetic [J/m],gravity [J/m],driven [J/m],friction [J/m]\n\
             0,0,0,0,0,1,-5,0,0\n\
             1,0.1,8,0,2,3,-7,0,0\n\
             2,0.05,8,20,2,2,-7,1,2\n\
             2,0.05,8,20,2,2,-7,1,2\n",
        )
        .unwrap()
    }

    #[test]
    fn the_parts_add_up_to_what_was_there_and_put_in() {
        let energy = energy(&course()).unwrap();
        let labels: Vec<&str> = energy.parts.iter().map(|part| &part.label[..]).collect();
        assert_eq!(
            labels,
            ["Motion", "Gravity, above its lowest", "Lost by friction"]
        );
        for row in 0..4 {
            let sum: f32 = energy.parts.iter().map(|part| part.values[row]).sum();
            assert_eq!(sum, energy.expected[row]);
        }
    }

    #[test]
    fn shares_are_of_the_steps_between_two_rows() {
        let steps = steps(&course()).unwrap();
        assert_eq!(steps.time, [0.0, 1.0, 2.0]);
        assert_eq!(steps.step, [0.1, 0.05]);
        let shares: Vec<(&str, &[f32])> = steps
            .shares
            .iter()
            .map(|share| (&share.label[..], &share.values[..]))
            .collect();
        assert_eq!(
            shares,
            [
                ("Waves in the material", &[80.0, 0.0][..]),
                ("Contact of points and bodies", &[0.0, 100.0]),
                ("The next output", &[20.0, 0.0]),
            ]
        );
    }
}
