//! `tandem chaos`: runs of this program that are disturbed on purpose.

use std::process::ExitCode;

use chaos::Options;
use chaos::command::can_mount;
use chaos::kind::Kind;
use chaos::table::Table;
use coupler::record::summary::Status;
use coupler::scene::Scene;

use crate::cli::ChaosArgs;
use crate::exit::BAD_INPUT;
use crate::logging;
use crate::signals::interrupt;
use crate::terminal::{complain, say};

/// A scene without checkpoints gets so many, and one without frames about so many.
const CHECKPOINTS: f64 = 20.0;
const FRAMES: f64 = 8.0;

/// Runs rounds and prints their results.
pub fn chaos(args: &ChaosArgs) -> ExitCode {
    let scene = match args.scene.load() {
        Ok(scene) => scene,
        Err(errors) => {
            complain(errors);
            return ExitCode::from(BAD_INPUT);
        }
    };
    logging::of_study();
    let kinds = kinds(&args.only);
    let this = || std::env::current_exe().map_err(|error| error.to_string());
    let begun = args.program.clone().map_or_else(this, Ok);
    let begun = begun.and_then(|program| {
        Ok(Options {
            program,
            scene: words(args, &scene),
            kinds,
            rounds: args.rounds,
            first: args.first,
            seed: args.seed,
            jobs: args.jobs.into(),
            out: args.out.clone(),
            interrupt: interrupt()?,
        })
    });
    let options = match begun {
        Ok(options) => options,
        Err(error) => return failed(&error),
    };
    match chaos::run(&options) {
        Ok(table) => tell(args, &table),
        Err(error) => failed(&error.to_string()),
    }
}

fn failed(error: &str) -> ExitCode {
    complain(format_args!("error: {error}"));
    ExitCode::from(Status::Failed.exit_code())
}

/// What can happen: what is asked for, or everything that this machine allows.
fn kinds(only: &[Kind]) -> Vec<Kind> {
    if !only.is_empty() {
        return only.to_vec();
    }
    let mounts = can_mount();
    if !mounts {
        complain(
            "without `disk` and `memory`: this machine does not let the user mount file systems",
        );
    }
    let all = Kind::ALL.into_iter();
    all.filter(|kind| mounts || !kind.needs_mounts()).collect()
}

/// The scene as words of `tandem run`, with checkpoints and frames, so that there is something to resume and to compare.
fn words(args: &ChaosArgs, scene: &Scene) -> Vec<String> {
    let mut words = vec![args.scene.scene.to_string_lossy().into_owned()];
    if let Some(variant) = &args.scene.variant {
        words.extend(["--variant".to_owned(), variant.clone()]);
    }
    let mut set = args.scene.set.clone();
    let end = scene.time.end;
    if scene.output.checkpoint.is_none() {
        set.push(format!("output.checkpoint.time={:e}", end / CHECKPOINTS));
    }
    if scene.output.frames.is_none() {
        let every = scene.output.every;
        let rows = (end / every / FRAMES).ceil().max(1.0);
        set.push(format!("output.frames={:e}", rows * every));
    }
    words.extend(set.into_iter().flat_map(|set| ["--set".to_owned(), set]));
    words
}

fn tell(args: &ChaosArgs, table: &Table) -> ExitCode {
    say(table);
    if table.skipped() > 0 {
        complain(format_args!(
            "{} rounds were left out: no small disk or memory on this machine",
            table.skipped()
        ));
    }
    for left in &table.left {
        say(format_args!("left after the last clean-up: {left}"));
    }
    for failed in &table.failed {
        say(format_args!(
            "round {} ({}):",
            failed.number,
            failed.kind.name()
        ));
        for words in &failed.words {
            say(format_args!("  {words}"));
        }
        say(format_args!(
            "  again: {}",
            again(args, failed.number, failed.kind)
        ));
    }
    if table.has_failed() {
        say(format_args!(
            "the files of these rounds are in {}",
            args.out.display()
        ));
        return ExitCode::from(Status::CheckFailed.exit_code());
    }
    ExitCode::SUCCESS
}

/// A command that plays one round again.
fn again(args: &ChaosArgs, number: u64, kind: Kind) -> String {
    let mut words = vec![
        "tandem".to_owned(),
        "chaos".to_owned(),
        args.scene.scene.to_string_lossy().into_owned(),
    ];
    if let Some(variant) = &args.scene.variant {
        words.extend(["--variant".to_owned(), variant.clone()]);
    }
    words.extend(
        args.scene
            .set
            .iter()
            .flat_map(|set| ["--set".to_owned(), set.clone()]),
    );
    words.extend(["--seed".to_owned(), args.seed.to_string()]);
    words.extend(["--first".to_owned(), number.to_string()]);
    words.extend(["--rounds", "1", "--only", kind.name()].map(str::to_owned));
    let quoted = shlex::try_join(words.iter().map(String::as_str));
    quoted.expect("words of a command line have no zero byte")
}
