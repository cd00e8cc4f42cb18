//! `tandem study`: the error of a scene over its resolution and methods, against the time that it takes; where there is
//! nothing to compare with, the values of its checks and columns over what was varied, or their statistics over a sample.

mod errors;
mod measure;
mod row;
mod sample;
mod sweep;

use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use clap::Args;
use coupler::scene::{Measurand, Study};

pub use self::row::Row;
pub(crate) use self::row::{column, write_rows};

use self::measure::Measurement;
use self::row::count;
use crate::StudyError;
use crate::case::{Case, Source, scene_title};
use crate::figure::chart::Chart;
use crate::output::write;
use crate::precision::pareto;
use crate::runner::{Found, Runner, RunnerOptions, Timed};
use crate::sample::{Over, Sample};
use crate::vary::{VARIANT, Vary, combinations};

/// Most times that a run is timed, unless the command line gives a number.
const MOST: usize = 7;

/// What is studied, and how.
#[derive(Debug, Args)]
pub struct StudyOptions {
    /// The scene.
    #[command(flatten)]
    pub source: Source,
    /// The runs.
    #[command(flatten)]
    pub runs: RunnerOptions,
    /// Start nothing: write the command of each run that is missing as a line of FILE, for another queue. The same command
    /// without this option makes the table of what is there.
    #[arg(long, value_name = "FILE")]
    pub commands: Option<PathBuf>,
    /// Values of a scene key, or of `variant`; every combination with the values of other keys is run. May be repeated.
    /// By default those of the scene's `[study]`.
    #[arg(long, value_name = "KEY=V1,V2,...")]
    pub vary: Vec<String>,
    /// Draw the values of N runs from the ranges of `--over`, as a Latin hypercube, in place of combinations.
    #[arg(
        long,
        value_name = "N",
        value_parser = clap::value_parser!(u16).range(2..),
        requires = "over",
        conflicts_with_all = ["vary", "error", "finer", "resolution"]
    )]
    pub sample: Option<u16>,
    /// Range of a scene key: `uniform(A,B)`, `log_uniform(A,B)`, or `integer(A,B)` for whole numbers. May be repeated.
    #[arg(long, value_name = "KEY=uniform(A,B),...", requires = "sample")]
    pub over: Vec<String>,
    /// Seed of the sample.
    #[arg(long, value_name = "N", default_value_t = 0, requires = "sample")]
    pub seed: u64,
    /// Check whose error is used.
    #[arg(long, value_name = "CHECK", conflicts_with = "finer")]
    pub error: Option<String>,
    /// Column or check that is compared with the finest run, in place of a check's error; may be repeated.
    #[arg(long, value_name = "NAME")]
    pub finer: Vec<String>,
    /// Scene key whose number is the resolution of a run.
    #[arg(long, value_name = "KEY")]
    pub resolution: Option<String>,
    /// Check or column whose value is shown for each combination, in place of an error; may be repeated. If no check
    /// has a reference, the default is all checks, or all columns of a scene without checks.
    #[arg(long, value_name = "NAME", conflicts_with_all = ["error", "finer"])]
    pub value: Vec<String>,
    /// Largest number of times that each run is timed, 7 by default; the smallest CPU time of stepping counts.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub repeat: Option<u16>,
}

/// Runs a study, and writes `study.csv` and `study.svg` to its directory. Returned are the table for people, and whether every
/// run is settled ([`Summary::settled`](coupler::record::Summary::settled)).
///
/// # Errors
/// [`StudyError`]. Nothing is started unless every run has a valid scene.
pub fn study(
    options: &StudyOptions,
    interrupt: Arc<AtomicBool>,
) -> Result<(String, bool), StudyError> {
    let design = Design::new(options)?;
    let runner = Runner::new(&options.runs, interrupt)?;
    let out = &options.runs.out;
    let (total, jobs) = (design.cases.len(), runner.jobs());
    tracing::info!("{total} runs, {jobs} at once; {}", design.measure.title());
    // Times are compared where they are what is shown, and a run has the machine for itself or shares it with its like.
    let usual = match &design.measure {
        Measurement::Values(_) => 1,
        _ if !runner.is_local() => 1,
        _ => MOST,
    };
    let most = options.repeat.map_or(usual, usize::from);
    let table = out.join("study.csv");
    let mut partial = |found: &Found| {
        let timed = found.iter().cloned().map(|one| one.map(Timed::of));
        let rows = design.rows(&runner, timed);
        let written = rows.and_then(|rows| {
            let report = design.report(rows, runner.started());
            report.write_csv(&table, runner.alone())
        });
        if let Err(error) = written {
            tracing::warn!("no table of the runs so far: {error}");
        }
    };
    let timed = runner.timed(&design.cases, most, &mut partial)?;
    let rows = design.rows(&runner, timed.into_iter().map(Some))?;
    let report = design.report(rows, runner.started());
    report.write_csv(&table, runner.alone())?;
    let (figure, title) = (out.join("study.svg"), scene_title(&options.source.path));
    report.draw(&figure, title, runner.jobs())?;
    let settled = report.rows.iter().all(|row| row.outcome().settled());
    Ok((report.to_string(), settled))
}

/// Writes the commands of the runs that are missing to a file, one a line, and returns their number.
///
/// # Errors
/// [`StudyError`].
pub fn commands(
    options: &StudyOptions,
    interrupt: Arc<AtomicBool>,
    file: &Path,
) -> Result<String, StudyError> {
    let cases = Design::new(options)?.cases;
    let runner = Runner::new(&options.runs, interrupt)?;
    let lines = runner.commands(&cases)?;
    let mut text = lines.join("\n");
    if !lines.is_empty() {
        text.push('\n');
    }
    write(file, text)?;
    let (missing, all, file) = (lines.len(), cases.len(), file.display());
    Ok(format!(
        "{missing} of {all} runs are missing; their commands are in {file}"
    ))
}

/// The runs of a study, before any is started.
struct Design {
    cases: Vec<Case>,
    resolution: String,
    along: Vec<String>,
    /// The key of the resolution with its values, if these are no numbers: of a sweep alone.
    named: Option<Vary>,
    /// Whether values were drawn; all keys are then along the one curve.
    sampled: bool,
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
        let asked = options.vary.iter().map(|vary| Vary::parse(vary));
        let asked: Vec<Vary> = asked.collect::<Result<_, _>>()?;
        let drawn = options.sample.map(|count| {
            let over = options.over.iter().map(|over| Over::parse(over));
            let over: Vec<Vec<Over>> = over.collect::<Result<_, _>>()?;
            let (over, count) = (over.concat(), count.into());
            let seed = options.seed;
            Sample { over, count, seed }.draw()
        });
        let drawn = drawn.transpose()?;
        let vary: Vec<Vary> = if let Some(runs) = &drawn {
            let column = |k: usize| Vary {
                key: runs[0][k].0.clone(),
                values: runs.iter().map(|run| run[k].1.clone()).collect(),
            };
            (0..runs[0].len()).map(column).collect()
        } else if asked.is_empty() {
            from_scene().collect()
        } else {
            asked
        };
        if vary.is_empty() {
            return Err(StudyError::usage(
                "there is nothing to vary",
                "give `--vary mpm.cell=0.01,0.005`, or write a `[study]` into the scene",
            ));
        }
        let sampled = drawn.is_some();
        let settings = drawn.map_or_else(|| combinations(&vary), Ok)?;
        let cases: Vec<Case> = settings
            .iter()
            .map(|settings| options.source.case(settings))
            .collect::<Result<_, _>>()?;
        let error = options.error.clone().map(Measurand::Check);
        let finer = (!options.finer.is_empty()).then(|| Measurand::Finer(options.finer.clone()));
        let wanted = error.or(finer).or_else(|| declared.error.clone());
        let wanted = wanted.filter(|_| !sampled);
        let measure = if options.value.is_empty() {
            Measurement::new(wanted, &cases)?
        } else {
            Measurement::values(&options.value, &cases[0].scene)?
        };
        let asked = options.resolution.clone();
        let resolution = match &measure {
            Measurement::Values(_) => asked.unwrap_or_else(|| along_x(&vary)),
            _ => asked.unwrap_or_else(|| resolution(&declared, &vary)),
        };
        let along = if sampled {
            vary.iter().map(|vary| vary.key.clone()).collect()
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
            sampled,
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
            return Err(StudyError::usage(
                format!(
                    "no run is the finest: `{}` is not a number in all of them",
                    self.resolution
                ),
                "name the key that has it: `--resolution KEY`",
            ));
        }
        Ok(())
    }

    fn report(&self, rows: Vec<Row>, started: usize) -> Report<'_> {
        Report {
            design: self,
            rows,
            started,
        }
    }

    /// The rows of the cases that have been run.
    fn rows(
        &self,
        runner: &Runner,
        timed: impl Iterator<Item = Option<Timed>>,
    ) -> Result<Vec<Row>, StudyError> {
        let mut rows: Vec<Row> = self
            .cases
            .iter()
            .zip(timed)
            .filter_map(|(case, timed)| Some((case, timed?)))
            .map(|(case, timed)| {
                let (curve, resolution) = (case.label(&self.along), case.number(&self.resolution));
                Row::new(runner, case.clone(), timed, curve, resolution)
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
                let number = row.resolution.unwrap_or(0.0);
                if sweep {
                    0.0
                } else if self.resolution.ends_with("per_cell") {
                    // More points are finer.
                    -number
                } else {
                    number
                }
            };
            place[&a.curve]
                .cmp(&place[&b.curve])
                .then(size(b).total_cmp(&size(a)))
        });
        self.measure.take(&mut rows, runner)?;
        let point = |row: &Row| (row.outcome().stepping_cpu(), row.error.unwrap_or(f64::NAN));
        let points: Vec<(f64, f64)> = rows.iter().map(point).collect();
        for (row, front) in rows.iter_mut().zip(pareto(&points)) {
            row.pareto = front;
        }
        Ok(rows)
    }
}

/// What a study has found: errors against run time, values over what was varied, or statistics of a sample.
struct Report<'a> {
    design: &'a Design,
    /// The runs, as [`Design::rows`] orders them.
    rows: Vec<Row>,
    /// Runs that were started for it; the others were there.
    started: usize,
}

impl Report<'_> {
    /// Writes `study.csv`, and of a sample `statistics.csv` beside it; `alone` if no run shared the machine with another.
    fn write_csv(&self, path: &Path, alone: bool) -> Result<(), StudyError> {
        let Measurement::Values(values) = &self.design.measure else {
            return write_rows(path, &self.rows, alone, errors::columns());
        };
        let columns = [sweep::columns(values), Vec::new()];
        write_rows(path, &self.rows, alone, columns)?;
        if self.design.sampled {
            sample::write_statistics(self, values, &path.with_file_name("statistics.csv"))?;
        }
        Ok(())
    }

    /// Draws `study.svg` of the runs of a scene, of which `jobs` were made at once.
    fn draw(&self, path: &Path, title: String, jobs: usize) -> Result<(), StudyError> {
        let chart = match &self.design.measure {
            Measurement::Values(values) if self.design.sampled => sample::chart(self, values),
            Measurement::Values(values) => sweep::chart(self, values),
            _ => errors::chart(self, jobs),
        };
        Chart { title, ..chart }.draw(path)
    }
}

impl fmt::Display for Report<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.design.measure {
            Measurement::Values(values) if self.design.sampled => sample::words(self, values, f),
            Measurement::Values(values) => sweep::words(self, values, f),
            _ => errors::words(self, f),
        }?;
        f.write_str(&count(&self.rows, self.started))
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
