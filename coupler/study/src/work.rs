//! `tandem study`: the error of a scene over its resolution and methods, against the time that it takes.

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

use coupler::record::check::{Expected, Measure};
use coupler::scene::{Measurand, Study};

use crate::StudyError;
use crate::case::{Case, Source, scene_title};
use crate::figure::precision::{Curve, Panel, draw};
use crate::outcome::{Outcome, history_column};
use crate::precision::{order, order_against, pareto};
use crate::runner::{Runner, RunnerOptions};
use crate::vary::{VARIANT, Vary, combinations, with_unit};

/// What is studied.
#[derive(Debug, Clone)]
pub struct StudyOptions {
    /// The scene.
    pub source: Source,
    /// Replaces what the scene varies, unless empty.
    pub vary: Vec<Vary>,
    /// Replaces what the scene takes for the error.
    pub error: Option<Measurand>,
    /// Replaces the key that tells how fine a run is.
    pub resolution: Option<String>,
    /// Replaces the keys that lead along a curve, unless empty.
    pub along: Vec<String>,
    /// Times that each run is timed.
    pub repeat: usize,
}

/// A run and its error.
#[derive(Debug, Clone)]
pub struct Row {
    /// Name of its directory in `runs`.
    pub run: String,
    /// The run.
    pub case: Case,
    /// Label of its curve.
    pub curve: String,
    /// The number that tells how fine it is.
    pub resolution: Option<f64>,
    /// What it left.
    pub outcome: Outcome,
    /// Value of the check whose error is taken.
    pub value: Option<f64>,
    /// Its error, if it has one.
    pub error: Option<f64>,
    /// Whether the others of its curve are compared with it.
    pub finest: bool,
    /// Whether no other run is both faster, by CPU time, and more precise.
    pub pareto_cpu: bool,
    /// Likewise by wall time.
    pub pareto_wall: bool,
}

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

/// Runs a study, and writes `study.csv` and `study.svg` to `out`.
///
/// # Errors
/// [`StudyError`]. Nothing is started unless every run has a valid scene and an error.
pub fn study(
    options: &StudyOptions,
    runner: RunnerOptions,
    out: &Path,
) -> Result<WorkReport, StudyError> {
    let design = Design::new(options)?;
    let runner = Runner::new(runner, out)?;
    let total = design.cases.len();
    tracing::info!(
        "{total} runs, {} at once; {}",
        runner.jobs(),
        design.measure.title()
    );
    let outcomes = runner.each(&design.cases, |case| {
        let outcome = runner.run(case, options.repeat)?;
        tracing::info!(
            "{}: {}, {:.3} s of CPU time",
            case.label(&[]),
            outcome.status.name(),
            outcome.cpu()
        );
        Ok(outcome)
    })?;
    let rows = design.rows(&runner, outcomes)?;
    let report = WorkReport {
        error_of: design.measure.title(),
        resolution: design.resolution.clone(),
        rows,
        started: runner.started(),
    };
    report.write_csv(&out.join("study.csv"), runner.jobs() == 1)?;
    let title = scene_title(&options.source.path);
    report.draw(&out.join("study.svg"), &title, runner.jobs())?;
    Ok(report)
}

/// The runs of a study, before any is started.
struct Design {
    cases: Vec<Case>,
    resolution: String,
    along: Vec<String>,
    measure: Measurement,
}

/// How the error of a run is taken.
enum Measurement {
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
}

impl Design {
    fn new(options: &StudyOptions) -> Result<Self, StudyError> {
        let declared = options.source.case(&[])?.scene.study;
        let from_scene = || {
            declared.vary.iter().map(|(key, values)| Vary {
                key: key.clone(),
                values: values.clone(),
            })
        };
        let vary: Vec<Vary> = if options.vary.is_empty() {
            from_scene().collect()
        } else {
            options.vary.clone()
        };
        if vary.is_empty() {
            return Err(StudyError::asked(
                "there is nothing to vary",
                "give `--vary mpm.cell=0.01,0.005`, or write a `[study]` into the scene",
            ));
        }
        let cases: Vec<Case> = combinations(&vary)?
            .iter()
            .map(|settings| options.source.case(settings))
            .collect::<Result<_, _>>()?;
        let resolution = options
            .resolution
            .clone()
            .unwrap_or_else(|| resolution(&declared, &vary));
        let along = if !options.along.is_empty() {
            options.along.clone()
        } else if options.resolution.is_none() && resolution == declared.resolution {
            declared.along.clone()
        } else {
            Study::along(&resolution)
        };
        let wanted = options.error.clone().or(declared.error);
        let measure = Measurement::new(wanted, &cases)?;
        let design = Self {
            cases,
            resolution,
            along,
            measure,
        };
        design.assert_sound()?;
        Ok(design)
    }

    fn assert_sound(&self) -> Result<(), StudyError> {
        if matches!(self.measure, Measurement::Finer(_))
            && self
                .cases
                .iter()
                .any(|case| case.number(&self.resolution).is_none())
        {
            return Err(StudyError::asked(
                format!(
                    "no run can be told to be the finest: `{}` is not a number in all of them",
                    self.resolution
                ),
                "name the key that tells it: `--resolution KEY`",
            ));
        }
        Ok(())
    }

    fn rows(&self, runner: &Runner, outcomes: Vec<Outcome>) -> Result<Vec<Row>, StudyError> {
        let mut rows: Vec<Row> = self
            .cases
            .iter()
            .zip(outcomes)
            .map(|(case, outcome)| Row {
                run: runner.name(case),
                curve: case.label(&self.along),
                resolution: case.number(&self.resolution),
                value: None,
                error: None,
                finest: false,
                pareto_cpu: false,
                pareto_wall: false,
                case: case.clone(),
                outcome,
            })
            .collect();
        // Curves in the order of their first run; within one from coarse to fine, as costs go.
        let mut place = BTreeMap::new();
        for row in &rows {
            let next = place.len();
            place.entry(row.curve.clone()).or_insert(next);
        }
        rows.sort_by(|a, b| {
            let size = |row: &Row| row.resolution.unwrap_or(0.0);
            place[&a.curve]
                .cmp(&place[&b.curve])
                .then(size(b).total_cmp(&size(a)))
        });
        match &self.measure {
            Measurement::Check { name, absolute, .. } => {
                for row in &mut rows {
                    row.value = row.outcome.verdict(name).and_then(|check| check.value);
                    row.error = check_error(&row.outcome, name, *absolute);
                }
            }
            Measurement::Finer(names) => against_the_finest(&mut rows, names, runner)?,
        }
        let front = |cost: fn(&Outcome) -> f64| {
            let points: Vec<(f64, f64)> = rows
                .iter()
                .map(|row| (cost(&row.outcome), row.error.unwrap_or(f64::NAN)))
                .collect();
            pareto(&points)
        };
        let (cpu, wall) = (front(Outcome::cpu), front(|o| o.wall_s));
        for (row, (cpu, wall)) in rows.iter_mut().zip(cpu.into_iter().zip(wall)) {
            (row.pareto_cpu, row.pareto_wall) = (cpu, wall);
        }
        Ok(rows)
    }
}

/// The scene's own key if it or a variant is varied, else the first key that is given numbers only.
fn resolution(declared: &Study, vary: &[Vary]) -> String {
    if vary
        .iter()
        .any(|v| v.key == declared.resolution || v.key == VARIANT)
    {
        return declared.resolution.clone();
    }
    vary.iter()
        .find(|v| v.numbers().is_some())
        .map_or_else(|| declared.resolution.clone(), |v| v.key.clone())
}

impl Measurement {
    fn new(wanted: Option<Measurand>, cases: &[Case]) -> Result<Self, StudyError> {
        let scene = &cases[0].scene;
        match wanted {
            None => Err(StudyError::asked(
                format!(
                    "{} declares no error: none of its checks has a `reference`",
                    scene.name
                ),
                "name columns or checks that are compared with the finest run: `--finer NAME`",
            )),
            Some(Measurand::Check(name)) => {
                let near = |case: &Case| {
                    let mut checks = case.scene.checks.iter();
                    checks.find_map(|check| match &check.expected {
                        Expected::Near { measure, .. } if check.name == name => {
                            Some(measure.clone())
                        }
                        _ => None,
                    })
                };
                let Some(measure) = near(&cases[0]) else {
                    let names = scene.checks.iter().filter_map(|check| {
                        matches!(check.expected, Expected::Near { .. })
                            .then_some(check.name.as_str())
                    });
                    return Err(StudyError::asked(
                        format!("--error {name}: no check with a `reference` has this name"),
                        coupler::scene::diagnostic::suggestion(
                            &name,
                            "checks with a reference",
                            names,
                        ),
                    ));
                };
                let (unit, absolute) = match measure {
                    Measure::Absolute => ("of the reference", true),
                    Measure::Relative => ("of the reference", false),
                    Measure::Scale(_) => ("of the check's scale", false),
                };
                Ok(Self::Check {
                    name,
                    unit,
                    absolute,
                })
            }
            Some(Measurand::Finer(names)) => {
                for name in &names {
                    let columns = scene.output.columns.iter().map(|c| c.name.as_str());
                    let known = columns.chain(scene.checks.iter().map(|c| c.name.as_str()));
                    if !known.clone().any(|k| k == name) {
                        return Err(StudyError::asked(
                            format!("--finer {name}: no column and no check has this name"),
                            coupler::scene::diagnostic::suggestion(name, "known here", known),
                        ));
                    }
                }
                Ok(Self::Finer(names))
            }
        }
    }

    fn title(&self) -> String {
        match self {
            Self::Check { name, unit, .. } => format!("error of \"{name}\", {unit}"),
            Self::Finer(names) => format!("distance from the finest run: {}", names.join(", ")),
        }
    }
}

/// The error of a check in a whole run; with `absolute` over the size of the reference, unless that is 0.
fn check_error(outcome: &Outcome, name: &str, absolute: bool) -> Option<f64> {
    let verdict = outcome.whole().then(|| outcome.verdict(name)).flatten()?;
    let error = verdict.error?;
    Some(match verdict.reference {
        Some(reference) if absolute && reference != 0.0 => error / reference.abs(),
        _ => error,
    })
}

/// The distance of every run from the finest of its curve, which has none: of a column the root mean square over its
/// rows relative to its largest value in the finest run, of a check that of its value; of several the root mean square.
fn against_the_finest(
    rows: &mut [Row],
    names: &[String],
    runner: &Runner,
) -> Result<(), StudyError> {
    let curves: Vec<String> = rows.iter().map(|row| row.curve.clone()).collect();
    let values = |row: &Row, name: &str| -> Option<Vec<f64>> {
        if !row.outcome.whole() {
            return None;
        }
        match row.outcome.verdict(name) {
            Some(verdict) => Some(vec![verdict.value?]),
            None => history_column(&runner.directory(&row.case, 0), name),
        }
    };
    for k in 0..rows.len() {
        let candidate = |j: &usize| curves[*j] == curves[k] && rows[*j].outcome.whole();
        let Some(finest) = (0..rows.len()).rfind(candidate) else {
            continue;
        };
        if finest == k {
            rows[k].finest = true;
            continue;
        }
        let mut sum = 0.0;
        let mut known = true;
        for name in names {
            let (Some(own), Some(fine)) = (values(&rows[k], name), values(&rows[finest], name))
            else {
                known = false;
                break;
            };
            if own.len() != fine.len() {
                return Err(StudyError::asked(
                    format!(
                        "`{name}` has {} rows in one run and {} in another",
                        own.len(),
                        fine.len()
                    ),
                    "runs are compared row by row: keep `time.end` and `output.every`",
                ));
            }
            sum += distance(&own, &fine).powi(2) / names.len() as f64;
        }
        rows[k].error = known.then_some(sum.sqrt());
    }
    Ok(())
}

/// Root mean square of the differences over the largest of `fine`.
fn distance(own: &[f64], fine: &[f64]) -> f64 {
    let square: f64 = own.iter().zip(fine).map(|(a, b)| (a - b).powi(2)).sum();
    let largest = fine.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    (square / fine.len() as f64).sqrt() / largest
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

    fn write_csv(&self, path: &Path, alone: bool) -> Result<(), StudyError> {
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
            let o = &row.outcome;
            let mut record = vec![row.run.clone(), row.curve.clone()];
            record.extend(row.case.settings.iter().map(|(_, value)| value.clone()));
            record.extend([
                number(row.resolution),
                o.status.name().to_owned(),
                number(row.value),
                number(row.error),
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

    fn draw(&self, path: &Path, title: &str, jobs: usize) -> Result<(), StudyError> {
        let curves: Vec<Curve> = self
            .curves()
            .into_iter()
            .map(|(label, rows)| {
                let order = Self::order(&rows).map(|p| format!("order {p:.2}"));
                let points = |cost: fn(&Outcome) -> f64, front: fn(&Row) -> bool| {
                    rows.iter()
                        .filter_map(|row| Some((cost(&row.outcome), row.error?, front(row))))
                        .collect()
                };
                let label = if label.is_empty() { "all runs" } else { label };
                Curve {
                    label: match order {
                        Some(order) => format!("{label}: {order}"),
                        None => label.to_owned(),
                    },
                    points: [
                        points(Outcome::cpu, |row| row.pareto_cpu),
                        points(|o| o.wall_s, |row| row.pareto_wall),
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
        let panels = [panel("CPU time of all processes"), panel("wall time")];
        draw(path, title, &panels, &curves, &note)
    }

    /// Whether a run failed, for a reason that is not the method's.
    pub fn failed(&self) -> bool {
        self.rows.iter().any(|row| !row.outcome.settled())
    }
}

/// The table for people.
impl fmt::Display for WorkReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}; `*`: on the Pareto front of CPU time", self.error_of)?;
        for (label, rows) in self.curves() {
            let order = Self::order(&rows).map_or_else(
                || "no order".to_owned(),
                |p| format!("order {p:.2} in {}", self.resolution),
            );
            writeln!(
                f,
                "{}: {order}",
                if label.is_empty() { "all runs" } else { label }
            )?;
            for row in rows {
                let number =
                    |n: Option<f64>| n.map_or_else(|| "-".to_owned(), |n| format!("{n:.3e}"));
                writeln!(
                    f,
                    "  {} {:<12} {:>10}  error {:>10}  cpu {:>9.3} s  wall {:>9.3} s  {:>8} steps{}",
                    if row.pareto_cpu { '*' } else { ' ' },
                    row.outcome.status.name(),
                    row.resolution.map_or_else(String::new, |h| h.to_string()),
                    number(row.error),
                    row.outcome.cpu(),
                    row.outcome.wall_s,
                    row.outcome.steps,
                    row.outcome
                        .reason
                        .as_ref()
                        .map_or_else(String::new, |r| format!("  ({r})")),
                )?;
            }
        }
        write!(f, "{} runs, {} of them new", self.rows.len(), self.started)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_distance_is_relative_to_the_largest_value_of_the_finest_run() {
        assert_eq!(distance(&[1.0, 3.0], &[1.0, 4.0]), 0.5f64.sqrt() / 4.0);
        assert_eq!(distance(&[2.0], &[4.0]), 0.5);
    }

    fn declared() -> Study {
        Study {
            error: None,
            resolution: "mpm.cell".into(),
            along: Study::along("mpm.cell"),
            vary: Vec::new(),
        }
    }

    #[test]
    fn the_resolution_is_the_scenes_own_unless_another_number_is_varied_alone() {
        let of = |arguments: &[&str]| {
            let vary: Vec<Vary> = arguments.iter().map(|a| Vary::parse(a).unwrap()).collect();
            resolution(&declared(), &vary)
        };
        assert_eq!(of(&["mpm.shape=linear,ugimp", "mpm.cell=1,2"]), "mpm.cell");
        assert_eq!(of(&["variant=a,b", "time.safety=0.1,0.2"]), "mpm.cell");
        assert_eq!(
            of(&["mpm.shape=linear,ugimp", "time.max_step=1e-3,1e-4"]),
            "time.max_step"
        );
        assert_eq!(of(&["mpm.shape=linear,ugimp"]), "mpm.cell");
    }
}
