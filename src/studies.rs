//! `tandem study` and `tandem stability`: many runs of this program; `tandem plot`: curves out of what they wrote.

use std::path::Path;
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
use study::work::StudyOptions;

use crate::exit::Failed;
use crate::logging;
use crate::signals::interrupt;
use crate::terminal::{complain, say};

/// Studies a scene.
pub fn study(args: &StudyOptions) -> Result<ExitCode, Failed> {
    logging::of_study();
    let interrupt = asked_to_end()?;
    if let Some(file) = &args.commands {
        say(study::work::commands(args, interrupt, file)?);
        return Ok(ExitCode::SUCCESS);
    }
    let (report, settled) = study::work::study(args, interrupt)?;
    say(report);
    say(format_args!("results in {}", args.runs.out.display()));
    Ok(if settled {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(Status::Failed.exit_code())
    })
}

/// Maps the stability of scenes.
pub fn stability(args: &StabilityOptions) -> Result<ExitCode, Failed> {
    logging::of_study();
    say(map(args)?.trim_end());
    say(format_args!("results in {}", args.runs.out.display()));
    Ok(ExitCode::SUCCESS)
}

/// Draws curves out of tables, and pictures of frames.
pub fn plot(args: &PlotOptions) -> Result<ExitCode, Failed> {
    for run in &args.data {
        if let Some(killed) = Killed::find(Path::new(&run.what)) {
            complain(format_args!("note: {}: {}", run.what, killed.words()));
        }
    }
    study::plot::plot(args)?;
    say(args.out.display());
    Ok(ExitCode::SUCCESS)
}

fn map(args: &StabilityOptions) -> Result<String, StudyError> {
    assert_sound(&args.search)?;
    let sources = args.scenes.iter().map(|path| source(args, path));
    let sources: Vec<Source> = sources.collect::<Result<_, _>>()?;
    let reports = maps(&sources, args, asked_to_end()?)?;
    Ok(reports.iter().map(ToString::to_string).collect())
}

/// A scene with the variant that is asked for, or its quick one.
fn source(args: &StabilityOptions, path: &Path) -> Result<Source, StudyError> {
    let plain = Scene::load(path, None, &args.set).map_err(StudyError::Scene)?;
    let quick = || {
        let mut variants = plain.variants.iter();
        variants.find(|name| *name == "quick").cloned()
    };
    Ok(Source {
        path: path.to_owned(),
        variant: args.variant.clone().or_else(quick),
        set: args.set.clone(),
    })
}

fn assert_sound(search: &Search) -> Result<(), StudyError> {
    let wrong = |what: &str, help: &str| Err(StudyError::Usage(what.into(), help.into()));
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
        .map_err(|e| StudyError::Usage(e, "start it where signals are allowed".to_owned()))?;
    Ok(interrupt.to_end)
}
