//! `tandem study`: the error of a scene over its resolution and methods, against the time that it takes.

mod measure;
mod report;
mod row;

use std::collections::BTreeMap;
use std::path::Path;

use coupler::scene::{Measurand, Study};

pub use self::report::WorkReport;
pub use self::row::Row;

use self::measure::Measurement;
use crate::StudyError;
use crate::case::{Case, Source, scene_title};
use crate::outcome::Outcome;
use crate::precision::pareto;
use crate::runner::{Repeat, Runner, RunnerOptions, Timed};
use crate::vary::{VARIANT, Vary, combinations};

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
    /// How often each run is timed.
    pub repeat: Repeat,
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
    let timed = runner.timed(&design.cases, options.repeat)?;
    let rows = design.rows(&runner, timed)?;
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

    fn rows(&self, runner: &Runner, timed: Vec<Timed>) -> Result<Vec<Row>, StudyError> {
        let mut rows: Vec<Row> = self
            .cases
            .iter()
            .zip(timed)
            .map(|(case, timed)| Row {
                run: runner.name(case),
                curve: case.label(&self.along),
                resolution: case.number(&self.resolution),
                value: None,
                error: None,
                finest: false,
                pareto_cpu: false,
                pareto_wall: false,
                case: case.clone(),
                timed,
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
        self.measure.take(&mut rows, runner)?;
        let front = |cost: fn(&Outcome) -> f64| {
            let points: Vec<(f64, f64)> = rows
                .iter()
                .map(|row| (cost(row.outcome()), row.error.unwrap_or(f64::NAN)))
                .collect();
            pareto(&points)
        };
        let (cpu, wall) = (
            front(Outcome::stepping_cpu),
            front(|outcome| outcome.stepping_wall_s),
        );
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

#[cfg(test)]
mod tests {
    use super::*;

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
