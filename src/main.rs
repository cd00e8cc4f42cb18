//! Tandem: one program, one subcommand per process. Knows every part and computes nothing itself.
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]
#![warn(clippy::print_stdout, clippy::print_stderr)] // a reader may have left: see `terminal`

mod check;
mod cli;
mod conformance;
mod cost;
mod exit;
mod logging;
mod machine;
mod new;
mod outcome;
mod replay;
mod report;
mod run;
mod signals;
mod solvers;
mod studies;
mod terminal;
mod watch;

use std::process::ExitCode;
use std::time::Duration;

use clap::Parser;
use cli::{Cli, Command, SchemaOf};
use coupler::run::resources::check_addresses;
use coupler::scene;
use exit::Failed;
use interface::hosted::Host;
use interface::session::serve;
use interface::transport::remains::sweep;
use interface::{config, processor};
use signal_hook::consts::SIGXFSZ;
use terminal::{complain, say};

/// How long `tandem clean` waits for the solvers of a dead run to end.
const ENDING: Duration = Duration::from_secs(2);

fn main() -> ExitCode {
    processor::assert_checked();
    // A file that may grow no further is an error of that file and not the end of the process.
    if let Err(error) = signals::ignore(SIGXFSZ) {
        complain(format_args!("warning: {error}"));
    }
    let ended = check_addresses()
        .map_err(exit::bad_input)
        .and_then(|()| obey(Cli::parse().command));
    let code = ended.unwrap_or_else(|failed| failed.say());
    logging::sync();
    terminal::settled(code)
}

fn obey(command: Command) -> Result<ExitCode, Failed> {
    match command {
        Command::Run(args) => run::run(&args),
        Command::Resume(args) => run::resume(&args),
        Command::Replay(args) => replay::run(&args),
        Command::Report(args) => report::report(&args),
        Command::Watch(args) => watch::watch(&args),
        Command::Check(args) => Ok(check::check(&args)),
        Command::Plan(args) => check::plan(&args),
        Command::New(args) => new::new(&args),
        Command::Schema { of } => {
            let schema = match of {
                SchemaOf::Scene => scene::schema(),
                SchemaOf::Mpm => config::schema::of::<config::MpmConfig>(),
                SchemaOf::Dem => config::schema::of::<config::DemConfig>(),
            };
            say(format_args!("{schema:#}"));
            Ok(ExitCode::SUCCESS)
        }
        Command::Study(args) => studies::study(&args),
        Command::Stability(args) => studies::stability(&args),
        Command::Conformance(args) => conformance::judge(&args),
        Command::Plot(args) => studies::plot(&args),
        Command::Clean => {
            let swept = sweep(ENDING);
            say(format_args!(
                "removed the files of {} dead run(s)",
                swept.removed.len()
            ));
            if !swept.inhabited.is_empty() {
                complain(format_args!(
                    "{} dead run(s) still have a solver that lives; clean again when it has ended",
                    swept.inhabited.len()
                ));
            }
            Ok(ExitCode::SUCCESS)
        }
        Command::Mpm(args) => Ok(solvers::join(&args, |run| {
            serve(run, Host::Mpm(solvers::mpm()))
        })),
        Command::Dem(args) => Ok(solvers::join(&args, |run| {
            serve(run, Host::Dem(solvers::dem()))
        })),
    }
}
