//! How the error of a run is taken: of a check, or against the finest run of its curve.

use coupler::record::check::When;
use coupler::record::rundir::HISTORY;
use coupler::record::{Summary, Table};
use coupler::scene::{Measurand, Scene};

use super::row::Row;
use crate::StudyError;
use crate::case::Case;
use crate::runner::Runner;

/// How the error of a run is taken.
pub(super) enum Measurement {
    /// Of a check.
    Check {
        name: String,
        /// What its error is relative to.
        unit: &'static str,
        /// Whether the summary's error is still to be divided by the reference.
        absolute: bool,
    },
    /// Against the finest run of the curve.
    Finer(Vec<String>),
    /// None: what runs show is compared with nothing.
    Values(Vec<Value>),
}

/// A check, or a column of the history, of which the last row counts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Value {
    name: String,
    /// Of a column.
    unit: Option<String>,
}

impl Value {
    /// Its name with the unit, as headers of tables have it.
    pub fn header(&self) -> String {
        match &self.unit {
            Some(unit) => format!("{} [{unit}]", self.name),
            None => self.name.clone(),
        }
    }

    fn of(&self, row: &Row, runner: &Runner) -> Option<f64> {
        finite(*shown(row, &self.name, runner)?.last()?)
    }
}

impl Measurement {
    pub(super) fn new(wanted: Option<Measurand>, cases: &[Case]) -> Result<Self, StudyError> {
        let scene = &cases[0].scene;
        match wanted {
            None => {
                let checks = scene.checks.iter().map(|check| check.name.clone());
                let columns = scene
                    .output
                    .columns
                    .iter()
                    .map(|column| column.name.clone());
                let mut names: Vec<String> = checks.collect();
                if names.is_empty() {
                    names.extend(columns);
                }
                Self::values(&names, scene)
            }
            Some(Measurand::Check(name)) => {
                let near = || {
                    scene
                        .checks
                        .iter()
                        .filter(|c| c.expected.reference.is_some())
                };
                let Some(check) = near().find(|check| check.name == name) else {
                    let names = near().map(|check| check.name.as_str());
                    return Err(StudyError::usage(
                        format!("--error {name}: no check with a `reference` has this name"),
                        coupler::scene::diagnostic::suggestion(
                            &name,
                            "checks with a reference",
                            names,
                        ),
                    ));
                };
                let scaled = check.expected.scale.is_some();
                // The reference at the time of the largest distance is no size: it may be anything, and 0.
                let plain = !scaled && check.expected.relative_tolerance.is_none();
                let absolute = plain && check.when != When::MaxError;
                let unit = if scaled {
                    "of the check's scale"
                } else if plain && !absolute {
                    "in its unit"
                } else {
                    "of the reference"
                };
                Ok(Self::Check {
                    name,
                    unit,
                    absolute,
                })
            }
            Some(Measurand::Finer(names)) => {
                for name in &names {
                    known("--finer", name, scene)?;
                }
                Ok(Self::Finer(names))
            }
        }
    }

    /// The values of these checks and columns.
    pub(super) fn values(names: &[String], scene: &Scene) -> Result<Self, StudyError> {
        if names.is_empty() {
            return Err(StudyError::usage(
                format!("{} has neither checks nor columns", scene.name),
                "write an `[[output.column]]` or a `[[check]]` into the scene",
            ));
        }
        let value = |name: &String| {
            known("--value", name, scene)?;
            let is_check = scene.checks.iter().any(|check| check.name == *name);
            let column = scene.output.columns.iter().find(|c| c.name == *name);
            Ok(Value {
                name: name.clone(),
                unit: column.filter(|_| !is_check).map(|c| c.unit.clone()),
            })
        };
        let values: Result<_, StudyError> = names.iter().map(value).collect();
        Ok(Self::Values(values?))
    }

    /// Takes the error of each run, or its values.
    pub(super) fn take(&self, rows: &mut [Row], runner: &Runner) -> Result<(), StudyError> {
        match self {
            Self::Check { name, absolute, .. } => {
                for row in rows {
                    let check = row.outcome().check(name);
                    row.values = vec![check.and_then(|check| finite(check.value))];
                    row.error = check_error(row.outcome(), name, *absolute);
                }
                Ok(())
            }
            Self::Finer(names) => against_the_finest(rows, names, runner),
            Self::Values(values) => {
                for row in rows {
                    row.values = values.iter().map(|value| value.of(row, runner)).collect();
                }
                Ok(())
            }
        }
    }

    pub(super) fn title(&self) -> String {
        match self {
            Self::Check { name, unit, .. } => format!("error of \"{name}\", {unit}"),
            Self::Values(values) => {
                let names: Vec<&str> = values.iter().map(|value| value.name.as_str()).collect();
                format!("values, compared with nothing: {}", names.join(", "))
            }
            Self::Finer(names) => format!("distance from the finest run: {}", names.join(", ")),
        }
    }
}

/// Refuses a name that is neither a column nor a check.
fn known(option: &str, name: &str, scene: &Scene) -> Result<(), StudyError> {
    let columns = scene.output.columns.iter().map(|c| c.name.as_str());
    let known = columns.chain(scene.checks.iter().map(|c| c.name.as_str()));
    if known.clone().any(|k| k == name) {
        return Ok(());
    }
    Err(StudyError::usage(
        format!("{option} {name}: no column and no check has this name"),
        coupler::scene::diagnostic::suggestion(name, "known here", known),
    ))
}

/// The error of a check in a whole run; with `absolute` over the size of the reference, unless that is 0.
fn check_error(outcome: &Summary, name: &str, absolute: bool) -> Option<f64> {
    let verdict = outcome.whole().then(|| outcome.check(name)).flatten()?;
    let size = verdict.reference.abs();
    let absolute = absolute && size > 0.0;
    finite(if absolute {
        verdict.error / size
    } else {
        verdict.error
    })
}

fn finite(number: f64) -> Option<f64> {
    number.is_finite().then_some(number)
}

/// What a whole run shows under a name: the value of a check, or the numbers of a column of its history.
fn shown(row: &Row, name: &str, runner: &Runner) -> Option<Vec<f64>> {
    let outcome = Some(row.outcome()).filter(|outcome| outcome.whole())?;
    if let Some(verdict) = outcome.check(name) {
        return Some(vec![finite(verdict.value)?]);
    }
    let history = Table::of_run(&runner.directory(&row.case, 0), HISTORY).ok()?;
    Some(history.column(name)?.values.clone())
}

/// The distance of every run from the finest of its curve, which has none: of a column the root mean square over its
/// rows relative to its largest value in the finest run, of a check that of its value; of several the root mean square.
fn against_the_finest(
    rows: &mut [Row],
    names: &[String],
    runner: &Runner,
) -> Result<(), StudyError> {
    for curve in rows.chunk_by_mut(|a, b| a.curve == b.curve) {
        let Some(finest) = curve.iter_mut().rfind(|row| row.outcome().whole()) else {
            continue;
        };
        finest.finest = true;
        let fine = names.iter().map(|name| shown(finest, name, runner));
        let fine: Vec<_> = fine.collect();
        for row in curve.iter_mut().filter(|row| !row.finest) {
            row.error = from_finest(row, names, &fine, runner)?;
        }
    }
    Ok(())
}

/// The distance of a run from the finest of its curve, which shows `fine` under the names.
fn from_finest(
    row: &Row,
    names: &[String],
    fine: &[Option<Vec<f64>>],
    runner: &Runner,
) -> Result<Option<f64>, StudyError> {
    let mut sum = 0.0;
    for (name, fine) in names.iter().zip(fine) {
        let (Some(own), Some(fine)) = (shown(row, name, runner), fine) else {
            return Ok(None);
        };
        if own.len() != fine.len() {
            return Err(StudyError::usage(
                format!(
                    "`{name}` has {} rows in one run and {} in another",
                    own.len(),
                    fine.len()
                ),
                "runs are compared row by row: keep `time.end` and `output.every`",
            ));
        }
        let Some(distance) = distance(&own, fine) else {
            return Ok(None);
        };
        sum += distance.powi(2) / names.len() as f64;
    }
    Ok(Some(sum.sqrt()))
}

/// Root mean square of the differences over the largest of `fine`, if that is not 0.
fn distance(own: &[f64], fine: &[f64]) -> Option<f64> {
    let square: f64 = own.iter().zip(fine).map(|(a, b)| (a - b).powi(2)).sum();
    let largest = fine.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    finite((square / fine.len() as f64).sqrt() / largest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_distance_is_relative_to_the_largest_value_of_the_finest_run() {
        let half = 0.5f64.sqrt();
        assert_eq!(distance(&[1.0, 3.0], &[1.0, 4.0]), Some(half / 4.0));
        assert_eq!(distance(&[2.0], &[4.0]), Some(0.5));
        // It was no number, also in the table.
        assert_eq!(distance(&[0.0, 0.0], &[0.0, 0.0]), None);
    }
}
