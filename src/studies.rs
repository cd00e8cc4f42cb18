//! `tandem study` and `tandem stability`: many runs of this program; `tandem plot`: curves out of what they wrote.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use coupler::record::summary::Status;
use coupler::run::killed::Killed;
use coupler::scene::{Measurand, Scene};
use study::StudyError;
use study::case::Source;
use study::engine::Engine;
use study::figure::axis::Scale;
use study::plot::{Labelled, PlotOptions};
use study::runner::RunnerOptions;
use study::sample::{Over, Sample};
use study::snapshots::SnapshotOptions;
use study::stability::edge::Search;
use study::stability::{MapOptions, maps, table};
use study::vary::Vary;
use study::work::StudyOptions;

use crate::cli::{EngineArg, PlotArgs, RunsArgs, StabilityArgs, StudyArgs};
use crate::logging;
use crate::signals::interrupt;
use crate::terminal::{complain, say};

/// Maps that `tandem stability` makes when no scene is named: scene, column, values.
const MAPS: [(&str, &str); 3] = [
    (
        "jiang2020/collision_hard",
        "contact.linear.normal_stiffness=6e3,6e4,6e5,6e6,6e7,6e8,6e9,6e10",
    ),
    (
        "jiang2020/collision_hard",
        "dem.body.0.density=0.2,2,20,200,2000,20000,200000,2000000",
    ),
    (
        "verification/bar_on_grain",
        "contact.linear.normal_stiffness=1e3,1e4,1e5,1e6,1e7,1e8,1e9",
    ),
];
/// Columns of a scene's map unless others are asked for: decades of its own stiffness, from itself up.
const STIFFNESS: &str = "contact.linear.normal_stiffness";
/// How many.
const DECADES: i32 = 7;

/// Studies a scene.
pub fn study(args: &StudyArgs) -> ExitCode {
    let result = || {
        let vary = args.vary.iter().map(|v| Vary::parse(v));
        let over: Vec<Vec<Over>> = args
            .over
            .iter()
            .map(|o| Over::parse(o))
            .collect::<Result<_, _>>()?;
        let options = StudyOptions {
            source: Source {
                path: args.scene.scene.clone(),
                variant: args.scene.variant.clone(),
                set: args.scene.set.clone(),
            },
            vary: vary.collect::<Result<_, _>>()?,
            sample: args.sample.map(|count| Sample {
                over: over.into_iter().flatten().collect(),
                count: count.into(),
                seed: args.seed,
            }),
            error: match (&args.error, &args.finer[..]) {
                (Some(name), _) => Some(Measurand::Check(name.clone())),
                (None, []) => None,
                (None, names) => Some(Measurand::Finer(names.to_vec())),
            },
            resolution: args.resolution.clone(),
            along: args.along.clone(),
            values: args.value.clone(),
            repeat: args.repeat.map(usize::from),
            scatter: args.scatter,
        };
        let runner = RunnerOptions {
            engine: match args.engine {
                EngineArg::Local => Engine::Local,
                EngineArg::Hyperqueue => Engine::HyperQueue,
                EngineArg::Slurm => Engine::Slurm,
            },
            cores: args.cores.map(usize::from),
            memory: args.memory.map(|mib| mib as usize),
            ..runner(&args.runs)?
        };
        let out = &args.runs.out;
        match &args.commands {
            Some(file) => study::work::commands(&options, runner, out, file).map(Err),
            None => study::work::study(&options, runner, out).map(Ok),
        }
    };
    logging::of_study();
    match result() {
        Ok(Err(missing)) => {
            say(missing);
            ExitCode::SUCCESS
        }
        Ok(Ok(report)) => {
            say(&report);
            say(format_args!("results in {}", args.runs.out.display()));
            if report.failed() {
                return ExitCode::from(Status::Failed.exit_code());
            }
            ExitCode::SUCCESS
        }
        Err(error) => ended(&error),
    }
}

/// Maps the stability of scenes.
pub fn stability(args: &StabilityArgs) -> ExitCode {
    logging::of_study();
    let made = if args.table { compare(args) } else { map(args) };
    match made {
        Ok(text) => {
            say(text.trim_end());
            say(format_args!("results in {}", args.runs.out.display()));
            ExitCode::SUCCESS
        }
        Err(error) => ended(&error),
    }
}

/// Draws curves out of tables.
pub fn plot(args: &PlotArgs) -> ExitCode {
    let labelled =
        |all: &[String]| -> Vec<Labelled> { all.iter().map(|one| Labelled::parse(one)).collect() };
    for run in labelled(&args.data) {
        if let Some(killed) = Killed::find(Path::new(&run.what)) {
            complain(format_args!("note: {}: {}", run.what, killed.words()));
        }
    }
    let named_after = || {
        let name = args.out.file_stem();
        name.map(|name| name.to_string_lossy().into_owned())
    };
    let title = args.title.clone();
    if !args.frames.is_empty() {
        let options = SnapshotOptions {
            runs: labelled(&args.data),
            at: args.frames.clone(),
            colour: Labelled::parse(&args.colour),
            between: args.clim,
            forces: args.forces,
            limits: [args.xlim, args.ylim].map(Option::unwrap_or_default),
            columns: args.columns,
            rate: args.rate,
            // Each picture has its time above it.
            title: title.unwrap_or_default(),
        };
        return drawn(args, study::snapshots::snapshots(&options, &args.out));
    }
    let scale = |log: bool| if log { Scale::Log } else { Scale::Linear };
    let options = PlotOptions {
        data: labelled(&args.data),
        x: args.x.clone(),
        y: labelled(&args.y),
        expected: labelled(&args.expected),
        by: args.by.clone(),
        slope: args.slope,
        scales: [scale(args.xlog), scale(args.ylog)],
        limits: [args.xlim, args.ylim].map(Option::unwrap_or_default),
        dots: args.dots,
        title: title.or_else(named_after).unwrap_or_default(),
        words: [args.xlabel.clone(), args.ylabel.clone()],
    };
    drawn(args, study::plot::plot(&options, &args.out))
}

fn drawn(args: &PlotArgs, drawn: Result<(), StudyError>) -> ExitCode {
    match drawn {
        Ok(()) => {
            say(args.out.display());
            ExitCode::SUCCESS
        }
        Err(error) => ended(&error),
    }
}

fn map(args: &StabilityArgs) -> Result<String, StudyError> {
    let search = search(args)?;
    let given = args.vary.as_deref();
    let wanted: Vec<(PathBuf, Option<&str>)> = if args.scenes.is_empty() {
        let of_catalogue = |name: &str| Path::new("scenes").join(name).with_extension("toml");
        let maps = MAPS.into_iter();
        maps.map(|(name, vary)| (of_catalogue(name), given.or(Some(vary))))
            .collect()
    } else {
        let scenes = args.scenes.iter().cloned();
        scenes.map(|scene| (scene, given)).collect()
    };
    let mut options: Vec<MapOptions> = Vec::new();
    for (path, vary) in wanted {
        let source = source(args, path)?;
        let column = match vary {
            Some(vary) => Vary::parse(vary)?,
            None => decades(&source)?,
        };
        options.push(MapOptions {
            source,
            column,
            along: args.edge.clone(),
            search,
            residual: args.residual,
        });
    }
    let reports = maps(&options, runner(&args.runs)?, &args.runs.out)?;
    Ok(reports.iter().map(ToString::to_string).collect())
}

/// The stiffness of a scene's contact and decades above it.
fn decades(source: &Source) -> Result<Vary, StudyError> {
    let own = source.case(&[])?.number(STIFFNESS).ok_or_else(|| {
        StudyError::Asked(
            format!("{} has no `{STIFFNESS}` to vary", source.path.display()),
            "name the columns: `--vary KEY=N1,N2,...`".to_owned(),
        )
    })?;
    let values = (0..DECADES).map(|k| (own * 10f64.powi(k)).to_string());
    Ok(Vary {
        key: STIFFNESS.to_owned(),
        values: values.collect(),
    })
}

fn compare(args: &StabilityArgs) -> Result<String, StudyError> {
    let scenes = if args.scenes.is_empty() {
        catalogue(Path::new("scenes")).map_err(|source| StudyError::File {
            action: "look for scenes in",
            path: "scenes".into(),
            source,
        })?
    } else {
        args.scenes.clone()
    };
    let sources: Vec<Source> = scenes
        .into_iter()
        .map(|path| source(args, path))
        .collect::<Result<_, _>>()?;
    let report = table(
        &sources,
        search(args)?,
        args.residual,
        runner(&args.runs)?,
        &args.runs.out,
    )?;
    Ok(report.to_string())
}

/// A scene with the variant that is asked for, or its quick one.
fn source(args: &StabilityArgs, path: PathBuf) -> Result<Source, StudyError> {
    let plain = Scene::load(&path, None, &args.set).map_err(StudyError::Scene)?;
    let quick = || {
        let mut variants = plain.variants.iter();
        variants.find(|name| *name == "quick").cloned()
    };
    Ok(Source {
        path,
        variant: args.variant.clone().or_else(quick),
        set: args.set.clone(),
    })
}

fn search(args: &StabilityArgs) -> Result<Search, StudyError> {
    let wrong = |what: &str, help: &str| Err(StudyError::Asked(what.into(), help.into()));
    let [low, high] = args.between;
    if !(low > 0.0 && high > low && high.is_finite()) {
        return wrong(
            &format!("--between {low},{high}: the search is logarithmic"),
            "give two numbers above 0, the smaller first",
        );
    }
    if args.ratio.is_nan() || args.ratio <= 1.0 {
        return wrong(&format!("--ratio {}", args.ratio), "a ratio is above 1");
    }
    Ok(Search {
        range: args.between,
        grid: args.grid.into(),
        ratio: args.ratio,
    })
}

/// Every scene file below a folder, sorted.
fn catalogue(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            files.extend(catalogue(&path)?);
        } else if path.extension().is_some_and(|e| e == "toml") {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

fn runner(args: &RunsArgs) -> Result<RunnerOptions, StudyError> {
    let program = std::env::current_exe().map_err(|source| StudyError::File {
        action: "find",
        path: "this program".into(),
        source,
    })?;
    let interrupt = interrupt(false)
        .map_err(|e| StudyError::Asked(e, "start it where signals are allowed".to_owned()))?;
    Ok(RunnerOptions {
        program,
        engine: Engine::Local,
        threads: args.threads,
        in_process: args.in_process,
        trust: args.trust,
        jobs: args.jobs.map(usize::from),
        cores: None,
        memory: None,
        interrupt: interrupt.to_end,
    })
}

fn ended(error: &StudyError) -> ExitCode {
    complain(error.to_string().trim_end());
    ExitCode::from(error.exit_code())
}
