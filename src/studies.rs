//! `tandem study` and `tandem stability`: many runs of this program; `tandem plot`: curves out of what they wrote.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use coupler::record::summary::Status;
use coupler::run::killed::Killed;
use coupler::scene::Scene;
use study::StudyError;
use study::case::Source;
use study::plot_options::PlotOptions;
use study::stability::edge::Search;
use study::stability::{StabilityOptions, maps};
use study::vary::Vary;
use study::work::StudyOptions;

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
pub fn study(args: &StudyOptions) -> ExitCode {
    logging::of_study();
    let result = asked_to_end().and_then(|interrupt| match &args.commands {
        Some(file) => study::work::commands(args, interrupt, file).map(Err),
        None => study::work::study(args, interrupt).map(Ok),
    });
    match result {
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
pub fn stability(args: &StabilityOptions) -> ExitCode {
    logging::of_study();
    match map(args) {
        Ok(text) => {
            say(text.trim_end());
            say(format_args!("results in {}", args.runs.out.display()));
            ExitCode::SUCCESS
        }
        Err(error) => ended(&error),
    }
}

/// Draws curves out of tables, and pictures of frames.
pub fn plot(args: &PlotOptions) -> ExitCode {
    for run in &args.data {
        if let Some(killed) = Killed::find(Path::new(&run.what)) {
            complain(format_args!("note: {}: {}", run.what, killed.words()));
        }
    }
    match study::plot::plot(args) {
        Ok(()) => {
            say(args.out.display());
            ExitCode::SUCCESS
        }
        Err(error) => ended(&error),
    }
}

fn map(args: &StabilityOptions) -> Result<String, StudyError> {
    assert_sound(&args.search)?;
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
    let with_column = |(path, vary)| {
        let source = source(args, path)?;
        let column = match vary {
            Some(vary) => Vary::parse(vary)?,
            None => decades(&source)?,
        };
        Ok((source, column))
    };
    let wanted: Vec<(Source, Vary)> = wanted
        .into_iter()
        .map(with_column)
        .collect::<Result<_, StudyError>>()?;
    let reports = maps(&wanted, args, asked_to_end()?)?;
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

/// A scene with the variant that is asked for, or its quick one.
fn source(args: &StabilityOptions, path: PathBuf) -> Result<Source, StudyError> {
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

fn assert_sound(search: &Search) -> Result<(), StudyError> {
    let wrong = |what: &str, help: &str| Err(StudyError::Asked(what.into(), help.into()));
    let [low, high] = search.between;
    if !(low > 0.0 && high > low && high.is_finite()) {
        return wrong(
            &format!("--between {low},{high}: the search is logarithmic"),
            "give two numbers above 0, the smaller first",
        );
    }
    if search.ratio.is_nan() || search.ratio <= 1.0 {
        return wrong(&format!("--ratio {}", search.ratio), "a ratio is above 1");
    }
    Ok(())
}

/// Set when the user asks to end.
fn asked_to_end() -> Result<Arc<AtomicBool>, StudyError> {
    let interrupt = interrupt(false)
        .map_err(|e| StudyError::Asked(e, "start it where signals are allowed".to_owned()))?;
    Ok(interrupt.to_end)
}

fn ended(error: &StudyError) -> ExitCode {
    complain(error.to_string().trim_end());
    ExitCode::from(error.exit_code())
}
