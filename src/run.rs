//! `tandem run`: this process becomes the coupler.

use std::io;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use coupler::run::{RunOptions, Solvers, run as run_scene};
use coupler::rundir::RunDir;
use coupler::scene::{Scene, solver_override};
use coupler::summary::{Status, Summary};
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

use crate::cli::{LogFormat, RunArgs};
use crate::terminal::{complain, say};
use crate::{BAD_INPUT, logging, solvers};

/// Runs a scene from the command line.
pub fn run(args: &RunArgs) -> ExitCode {
    let solvers = [("mpm", &args.mpm), ("dem", &args.dem)]
        .into_iter()
        .filter_map(|(side, command)| Some(solver_override(side, command.as_ref()?)));
    let scene = match solvers.collect::<Result<Vec<_>, _>>() {
        Ok(solvers) => args.scene.load_with(&solvers),
        Err(error) => return refuse(&error),
    };
    let scene = match scene {
        Ok(scene) => scene,
        Err(errors) => {
            complain(errors);
            return ExitCode::from(BAD_INPUT);
        }
    };
    let options = match options(args, &scene) {
        Ok(options) => options,
        Err(error) => return refuse(&error),
    };
    let out = args
        .out
        .clone()
        .unwrap_or_else(|| default_out(&scene, args.scene.variant.as_deref()));
    let dir = match RunDir::create(&out) {
        Ok(dir) => dir,
        Err(error) => return refuse(&error.to_string()),
    };
    match dir.log() {
        Ok(file) => logging::of_run(file, args.log),
        Err(error) => return refuse(&error.to_string()),
    }
    for id in interface::domain::sweep() {
        tracing::info!("removed what the dead run {id} had left");
    }
    for warning in &scene.warnings {
        tracing::warn!("{warning}");
    }
    tracing::info!(pid = std::process::id(), scene = scene.name, out = %out.display(), "coupler");
    match run_scene(&scene, &options, &dir) {
        Ok(summary) => {
            if let Some(reason) = &summary.reason {
                give_reason(args.log, reason);
            }
            if args.log == LogFormat::Text {
                show(&summary);
            }
            say(format_args!("results in {}", out.display()));
            ExitCode::from(summary.status.exit_code())
        }
        Err(error) => {
            give_reason(args.log, &error.to_string());
            ExitCode::from(Status::Failed.exit_code())
        }
    }
}

/// Why the run has not reached its end: in its log, and on standard error as the rest of what is there.
fn give_reason(log: LogFormat, reason: &str) {
    match log {
        LogFormat::Json => tracing::error!("{reason}"),
        LogFormat::Text => {
            // For the log only: standard error shows what is more important than this.
            tracing::debug!("{reason}");
            complain(format_args!("error: {reason}"));
        }
    }
}

fn refuse(error: &str) -> ExitCode {
    complain(format_args!("error: {error}"));
    ExitCode::from(BAD_INPUT)
}

fn default_out(scene: &Scene, variant: Option<&str>) -> PathBuf {
    let mut name = scene.name.clone();
    if let Some(variant) = variant {
        name = format!("{name}-{variant}");
    }
    PathBuf::from("runs").join(name)
}

fn options(args: &RunArgs, scene: &Scene) -> Result<RunOptions, String> {
    let solvers = if args.in_process {
        let others = [("mpm", &scene.solvers.mpm), ("dem", &scene.solvers.dem)];
        if let Some((side, _)) = others.iter().find(|(_, command)| command.is_some()) {
            return Err(format!(
                "--in-process: the scene has a solver that is a process; `--set solvers.{side}=built-in` leaves it out"
            ));
        }
        Solvers::Here {
            mpm: solvers::mpm,
            dem: solvers::dem,
        }
    } else {
        Solvers::Processes {
            mpm: process(scene.solvers.mpm.as_ref(), "mpm")?,
            dem: process(scene.solvers.dem.as_ref(), "dem")?,
        }
    };
    Ok(RunOptions {
        solvers,
        threads: args.threads.into(),
        window: args.window,
        record: args.record,
        progress: args.log == LogFormat::Text,
        interrupt: interrupt()?,
    })
}

/// A flag that Ctrl-C and SIGTERM set; the second of them does not wait for an orderly end.
pub fn interrupt() -> Result<Arc<AtomicBool>, String> {
    let interrupt = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        flag::register_conditional_shutdown(
            signal,
            i32::from(Status::Interrupted.exit_code()),
            interrupt.clone(),
        )
        .and_then(|_| flag::register(signal, interrupt.clone()))
        .map_err(|e| format!("cannot handle signals: {e}"))?;
    }
    Ok(interrupt)
}

/// The command of a solver: the scene's, or this program again.
fn process(command: Option<&Vec<String>>, subcommand: &str) -> Result<Vec<String>, String> {
    match command {
        Some(command) => Ok(command.clone()),
        None => this_program(subcommand),
    }
}

/// The command of a built-in solver in a process of its own: this program again.
pub fn this_program(subcommand: &str) -> Result<Vec<String>, String> {
    let this =
        std::env::current_exe().map_err(|e: io::Error| format!("cannot find this program: {e}"))?;
    Ok(vec![
        this.to_string_lossy().into_owned(),
        subcommand.to_string(),
    ])
}

/// The result for people.
fn show(summary: &Summary) {
    for check in &summary.checks {
        let verdict = if check.pass { "pass" } else { "FAIL" };
        say(format_args!(
            "  {verdict}  {:<44} {:>13.6e}  expected {:.6e}  ({})",
            check.name, check.value, check.reference, check.source
        ));
    }
    let bound: Vec<String> = summary
        .dt_bound_by
        .iter()
        .map(|(name, steps)| format!("{name} {steps}"))
        .collect();
    let gap = summary.energy.work_gap;
    let gap = gap.map(|gap| format!(", work not stored {gap:.1e}"));
    say(format_args!(
        "{}: {} steps to t = {:.6} s in {:.2} s; dt bound by: {}; momentum error {:.1e}, energy residual {:.1e}{}",
        summary.scene,
        summary.steps,
        summary.time,
        summary.wall_s,
        bound.join(", "),
        summary.momentum_error,
        summary.energy.residual_max,
        gap.unwrap_or_default()
    ));
}
