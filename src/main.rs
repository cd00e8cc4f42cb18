//! Tandem: one program, one subcommand per process. Knows every part and computes nothing itself.
#![forbid(unsafe_code)]
#![warn(clippy::print_stdout, clippy::print_stderr)] // a reader may have left: see `terminal`

mod chaos;
mod cli;
mod conformance;
mod exit;
mod logging;
mod machine;
mod replay;
mod report;
mod run;
mod solvers;
mod studies;
mod terminal;

use std::process::ExitCode;

use clap::Parser;
use cli::{Cli, Command};
use coupler::run::room;
use coupler::scene::{Scene, schema};
use exit::BAD_INPUT;
use signal_hook::consts::SIGXFSZ;
use terminal::{complain, say};

fn main() -> ExitCode {
    // A file that may grow no further is an error of that file and not the end of the process.
    if let Err(error) = run::ignore(SIGXFSZ) {
        complain(format_args!("warning: {error}"));
    }
    terminal::settled(obey(Cli::parse().command))
}

fn obey(command: Command) -> ExitCode {
    match command {
        Command::Run(args) => run::run(&args),
        Command::Resume(args) => run::resume(&args),
        Command::Replay(args) => replay::play(&args),
        Command::Report(args) => report::report(&args),
        Command::Check(args) => check(&args),
        Command::Plan(args) => with_scene(&args, |scene| {
            say(scene.plan());
            say(format_args!("  shared   {}", room::in_words(scene)));
        }),
        Command::Schema => {
            say(format_args!("{:#}", schema()));
            ExitCode::SUCCESS
        }
        Command::Study(args) => studies::study(&args),
        Command::Stability(args) => studies::stability(&args),
        Command::Chaos(args) => chaos::chaos(&args),
        Command::Conformance(args) => conformance::judge(&args),
        Command::Plot(args) => studies::plot(&args),
        Command::Clean => {
            let swept = interface::transport::domain::sweep();
            say(format_args!(
                "removed what {} dead run(s) had left",
                swept.len()
            ));
            ExitCode::SUCCESS
        }
        Command::Mpm(args) => solvers::join(&args, solvers::mpm_process),
        Command::Dem(args) => solvers::join(&args, solvers::dem_process),
        Command::Mutant(args) => conformance::mutate(&args),
    }
}

/// Validates scenes, each with all of its variants unless one is asked for.
fn check(args: &cli::CheckArgs) -> ExitCode {
    let mut code = ExitCode::SUCCESS;
    for path in &args.scenes {
        let mut variants = vec![args.variant.clone()];
        while let Some(variant) = variants.pop() {
            match Scene::load(path, variant.as_deref(), &args.set) {
                Ok(scene) => {
                    for warning in &scene.warnings {
                        say(format_args!("warning: {}: {warning}", path.display()));
                    }
                    let which = variant
                        .as_ref()
                        .map(|name| format!(", variant {name}"))
                        .unwrap_or_default();
                    say(format_args!(
                        "{}: {} is a valid scene{which}",
                        path.display(),
                        scene.name
                    ));
                    if variant.is_none() {
                        variants.extend(scene.variants.into_iter().rev().map(Some));
                    }
                }
                Err(errors) => {
                    complain(errors);
                    code = ExitCode::from(BAD_INPUT);
                }
            }
        }
    }
    code
}

fn with_scene(args: &cli::SceneArgs, show: impl FnOnce(&Scene)) -> ExitCode {
    match args.load() {
        Ok(scene) => {
            show(&scene);
            ExitCode::SUCCESS
        }
        Err(errors) => {
            complain(errors);
            ExitCode::from(BAD_INPUT)
        }
    }
}
