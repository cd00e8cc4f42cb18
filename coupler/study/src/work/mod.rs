//! `tandem study`: the error of a scene over its resolution and methods, against the time that it takes; where there is
//! nothing to compare with, the values of its checks and columns over what was varied.

mod measure;
mod report;
mod row;
mod sweep;

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

use coupler::record::Summary;
use coupler::scene::{Measurand, Study};

pub use self::report::WorkReport;
pub use self::row::Row;
pub use self::sweep::SweepReport;

use self::measure::{Measurement, Value};
use crate::StudyError;
use crate::case::{Case, Source, scene_title};
use crate::precision::pareto;
use crate::runner::{Repeat, Runner, RunnerOptions, Timed};
use crate::vary::{VARIANT, Vary, combinations};

/// Most times that a run is timed, unless it is said.
pub const MOST: usize = 7;

/// What is studied.
#[derive(Debug, Clone)]
pub struct StudyOptions {
    /// The scene.
    pub source: Source,
    /// Replaces what the scene varies, unless empty.
    pub vary: Vec<Vary>,
    /// Replaces what the scene takes for the error.
    pub error: Option<Measurand>,
    /// Replaces the key of the resolution.
    pub resolution: Option<String>,
    /// Replaces the keys that lead along a curve, unless empty.
    pub along: Vec<String>,
    /// Checks and columns whose values are shown in place of an error, unless empty.
    pub values: Vec<String>,
    /// Most runs of each case for its times; by default [`MOST`], and one where times are not what is shown.
    pub repeat: Option<usize>,
    /// How near the two least times of a case are to come, as a share of the least.
    pub scatter: f64,
}

/// What a study has found.
#[derive(Debug, Clone)]
pub enum Report {
    /// Errors against run time.
    Errors(WorkReport),
    /// Values over what was varied.
    Values(SweepReport),
}

impl Report {
    /// Whether a run failed, for a reason that is not the method's.
    pub fn failed(&self) -> bool {
        let rows = match self {
            Self::Errors(report) => &report.rows,
            Self::Values(report) => &report.rows,
        };
        rows.iter().any(|row| !row.outcome().settled())
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Errors(report) => report.fmt(f),
            Self::Values(report) => report.fmt(f),
        }
    }
}

/// Runs a study, and writes `study.csv` and `study.svg` to `out`.
///
/// # Errors
/// [`StudyError`]. Nothing is started unless every run has a valid scene.
pub fn study(
    options: &StudyOptions,
    runner: RunnerOptions,
    out: &Path,
) -> Result<Report, StudyError> {
    let design = Design::new(options)?;
    let runner = Runner::new(runner, out)?;
    let (total, jobs) = (design.cases.len(), runner.jobs());
    tracing::info!("{total} runs, {jobs} at once; {}", design.measure.title());
    let usual = match &design.measure {
        Measurement::Values(_) => 1,
        _ => MOST,
    };
    let repeat = Repeat {
        most: options.repeat.unwrap_or(usual),
        scatter: options.scatter,
    };
    let timed = runner.timed(&design.cases, repeat)?;
    let rows = design.rows(&runner, timed)?;
    let (table, figure) = (out.join("study.csv"), out.join("study.svg"));
    let title = scene_title(&options.source.path);
    let (alone, started) = (jobs == 1, runner.started());
    if let Measurement::Values(values) = &design.measure {
        let report = SweepReport {
            names: design.named.as_ref().map(|vary| vary.values.clone()),
            key: design.resolution,
            values: values.iter().map(Value::header).collect(),
            rows,
            started,
        };
        report.write_csv(&table, alone)?;
        report.draw(&figure, &title)?;
        return Ok(Report::Values(report));
    }
    let report = WorkReport {
        error_of: design.measure.title(),
        resolution: design.resolution,
        rows,
        started,
    };
    report.write_csv(&table, alone)?;
    report.draw(&figure, &title, jobs)?;
    Ok(Report::Errors(report))
}

/// The runs of a study, before any is started.
struct Design {
    cases: Vec<Case>,
    resolution: String,
    along: Vec<String>,
    /// The key of the resolution with its values, if these are no numbers: of a sweep alone.
    named: Option<Vary>,
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
        let wanted = options.error.clone().or_else(|| declared.error.clone());
        let measure = if options.values.is_empty() {
            Measurement::new(wanted, &cases)?
        } else {
            Measurement::values(&options.values, &cases[0].scene)?
        };
        let asked = options.resolution.clone();
        let resolution = match &measure {
            Measurement::Values(_) => asked.unwrap_or_else(|| along_x(&vary)),
            _ => asked.unwrap_or_else(|| resolution(&declared, &vary)),
        };
        let along = if !options.along.is_empty() {
            options.along.clone()
        } else if let Measurement::Values(_) = &measure {
            vec![resolution.clone()]
        } else if options.resolution.is_none() && resolution == declared.resolution {
            declared.along.clone()
        } else {
            Study::along(&resolution)
        };
        let is_number = |case: &Case| case.number(&resolution).is_some();
        let named = vary
            .iter()
            .find(|vary| vary.key == resolution && !cases.iter().all(is_number))
            .cloned();
        let design = Self {
            cases,
            resolution,
            along,
            named,
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
                values: Vec::new(),
                error: None,
                finest: false,
                pareto_cpu: false,
                pareto_wall: false,
                case: case.clone(),
                timed,
            })
            .collect();
        let sweep = matches!(self.measure, Measurement::Values(_));
        if sweep {
            for row in &mut rows {
                row.resolution = sweep::place(row, &self.resolution, self.named.as_ref());
            }
        }
        // Curves in the order of their first run; within one from coarse to fine, as costs go, or as a sweep was asked for.
        let mut place = BTreeMap::new();
        for row in &rows {
            let next = place.len();
            place.entry(row.curve.clone()).or_insert(next);
        }
        rows.sort_by(|a, b| {
            let size = |row: &Row| {
                if sweep {
                    0.0
                } else {
                    row.resolution.unwrap_or(0.0)
                }
            };
            place[&a.curve]
                .cmp(&place[&b.curve])
                .then(size(b).total_cmp(&size(a)))
        });
        self.measure.take(&mut rows, runner)?;
        let front = |cost: fn(&Summary) -> f64| {
            let points: Vec<(f64, f64)> = rows
                .iter()
                .map(|row| (cost(row.outcome()), row.error.unwrap_or(f64::NAN)))
                .collect();
            pareto(&points)
        };
        let (cpu, wall) = (
            front(Summary::stepping_cpu),
            front(|outcome| outcome.stepping_wall_s),
        );
        for (row, (cpu, wall)) in rows.iter_mut().zip(cpu.into_iter().zip(wall)) {
            (row.pareto_cpu, row.pareto_wall) = (cpu, wall);
        }
        Ok(rows)
    }
}

/// The key of the resolution: of one key that is given numbers this one; else the scene's own if it or a variant is varied,
/// else the first key that is given numbers only.
fn resolution(declared: &Study, vary: &[Vary]) -> String {
    let numbers = |v: &&Vary| v.numbers().is_some();
    match vary {
        [only] if numbers(&only) => only.key.clone(),
        _ if vary
            .iter()
            .any(|v| v.key == declared.resolution || v.key == VARIANT) =>
        {
            declared.resolution.clone()
        }
        _ => vary
            .iter()
            .find(numbers)
            .map_or_else(|| declared.resolution.clone(), |v| v.key.clone()),
    }
}

/// The key along the curves of a sweep: the first that is given numbers only, else the first.
fn along_x(vary: &[Vary]) -> String {
    let numbers = vary.iter().find(|v| v.numbers().is_some());
    let key = numbers.or(vary.first()).map(|v| v.key.clone());
    key.expect("something is varied")
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
        assert_eq!(of(&["dem.body.0.density=1,2"]), "dem.body.0.density");
    }

    #[test]
    fn a_sweep_goes_along_numbers_if_there_are_any() {
        let of = |arguments: &[&str]| {
            let vary: Vec<Vary> = arguments.iter().map(|a| Vary::parse(a).unwrap()).collect();
            along_x(&vary)
        };
        assert_eq!(of(&["mpm.shape=linear,ugimp", "mpm.cell=1,2"]), "mpm.cell");
        assert_eq!(of(&["mpm.shape=linear,ugimp", "variant=a,b"]), "mpm.shape");
    }
}
