//! `tandem run`: this process becomes the coupler.

use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use coupler::record::rundir::{RunDir, RunDirError};
use coupler::record::summary::{Status, Summary};
use coupler::run::aftermath::Killed;
use coupler::run::checkpoint::file::CheckpointError;
use coupler::run::room;
use coupler::run::{Finished, Resumed, RunOptions, Solvers, run as run_scene};
use coupler::scene::{Scene, solver_override};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGUSR1, SIGXCPU};
use signal_hook::flag;

use crate::cli::{HowArgs, LogFormat, ResumeArgs, RunArgs};
use crate::exit::BAD_INPUT;
use crate::terminal::{complain, say};
use crate::{logging, machine, report, solvers, terminal};

/// Runs a scene from the command line.
pub fn run(args: &RunArgs) -> ExitCode {
    let solvers = [("mpm", &args.mpm), ("dem", &args.dem)]
        .into_iter()
        .filter_map(|(side, command)| Some(solver_override(side, command.as_ref()?)));
    let page = args.report.then(|| Ok("output.report=true".to_owned()));
    let scene = match solvers.chain(page).collect::<Result<Vec<_>, _>>() {
        Ok(more) => args.scene.load_with(&more),
        Err(error) => return refuse(&error),
    };
    let scene = match scene {
        Ok(scene) => scene,
        Err(errors) => {
            complain(errors);
            return ExitCode::from(BAD_INPUT);
        }
    };
    let options = match options(&args.how, args.record, &scene) {
        Ok(options) => options,
        Err(error) => return refuse(&error),
    };
    let out = args
        .out
        .clone()
        .unwrap_or_else(|| default_out(&scene, args.scene.variant.as_deref()));
    let killed = Killed::find(&out);
    let created = RunDir::create(&out, &scene.resolved_toml);
    let (dir, log) = match created.and_then(|dir| Ok((dir.clone(), dir.log(false)?))) {
        Ok(opened) => opened,
        Err(error) => return refuse(&with_advice(&error)),
    };
    logging::of_run(&log, args.how.log);
    begin(&scene, &out);
    if let Some(killed) = killed {
        tracing::info!("the earlier run in {}: {}", out.display(), killed.words());
    }
    let finished = run_scene(&scene, &options, &dir);
    finish(args.how.log, &scene, &dir, &out, &finished)
}

/// Goes on with a run from its newest checkpoint.
pub fn resume(args: &ResumeArgs) -> ExitCode {
    let scene = match Scene::load(&args.dir.join("scene.toml"), None, &[]) {
        Ok(scene) => scene,
        Err(errors) => {
            complain(errors);
            return ExitCode::from(BAD_INPUT);
        }
    };
    let killed = Killed::find(&args.dir);
    let dir = match RunDir::reopen(&args.dir) {
        Ok(dir) => dir,
        Err(error) => return refuse(&with_advice(&error)),
    };
    let resumed = match Resumed::find(&scene, &dir) {
        Ok(resumed) => resumed,
        Err(error) => return cannot_resume(&scene, &dir, killed.as_ref(), &error),
    };
    let log = match dir.log(true) {
        Ok(log) => log,
        Err(error) => return refuse(&with_advice(&error)),
    };
    let options = match options(&args.how, false, &scene) {
        Ok(options) => options,
        Err(error) => return refuse(&error),
    };
    logging::of_run(&log, args.how.log);
    begin(&scene, &args.dir);
    for damaged in resumed.passed_over() {
        tracing::warn!("{damaged}: passed over");
    }
    let about = resumed.about();
    if about.recorded {
        tracing::warn!(
            "recording.tandem ends before the checkpoint's window: what follows is not recorded"
        );
    }
    tracing::info!(
        checkpoint = %resumed.path().display(),
        step = about.step,
        time = about.time,
        "resumed"
    );
    let finished = resumed.run(&scene, &options, &dir);
    finish(args.how.log, &scene, &dir, &args.dir, &finished)
}

/// Why a run cannot go on; of one whose coupler was killed also how far it came, which becomes its summary.
fn cannot_resume(
    scene: &Scene,
    dir: &RunDir,
    killed: Option<&Killed>,
    error: &CheckpointError,
) -> ExitCode {
    if let Some(killed) = killed {
        complain(format_args!("{}: {}", dir.path().display(), killed.words()));
        match killed.write_summary(scene, dir) {
            Ok(_) => complain("summary.json now says so"),
            Err(error) => complain(format_args!("error: {}", with_advice(&error))),
        }
    }
    refuse(&error.to_string())
}

fn with_advice(error: &RunDirError) -> String {
    format!("{error} ({})", error.advice())
}

/// What is said and done before any run.
fn begin(scene: &Scene, out: &Path) {
    for id in interface::transport::domain::sweep() {
        tracing::info!("removed what the dead run {id} had left");
    }
    for warning in &scene.warnings {
        tracing::warn!("{warning}");
    }
    machine::log();
    tracing::info!(pid = std::process::id(), scene = scene.name, out = %out.display(), "coupler");
}

/// What is said after any run.
fn finish(
    log: LogFormat,
    scene: &Scene,
    dir: &RunDir,
    out: &Path,
    finished: &Finished,
) -> ExitCode {
    let Finished {
        summary,
        place,
        unwritten,
    } = finished;
    if let Some(reason) = &summary.reason {
        give_reason(log, reason);
    }
    if log == LogFormat::Text {
        show(summary);
    }
    if let Some(error) = unwritten {
        give_reason(log, &with_advice(error));
    }
    if place != out {
        say(format_args!(
            "the earlier result in {} is as it was",
            out.display()
        ));
    }
    say(format_args!("results in {}", place.display()));
    if scene.output.report {
        logging::settle();
        match dir.report() {
            Ok(_) => report::at_the_end_of(place),
            Err(error) => complain(format_args!("warning: no report: {error}")),
        }
    }
    let cut_short = matches!(summary.status, Status::Interrupted | Status::Failed);
    if cut_short && place == out && coupler::run::checkpoint::file::is_in(out) {
        say(format_args!(
            "`tandem resume {}` goes on from its last checkpoint",
            out.display()
        ));
    }
    match (unwritten, summary.status) {
        (Some(_), Status::Done | Status::CheckFailed) => Status::Failed.exit_code().into(),
        (_, status) => status.exit_code().into(),
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

fn options(args: &HowArgs, record: bool, scene: &Scene) -> Result<RunOptions, String> {
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
        room::look(scene).map_err(|error| format!("{error} ({})", error.advice()))?;
        Solvers::Processes {
            mpm: process(scene.solvers.mpm.as_ref(), "mpm")?,
            dem: process(scene.solvers.dem.as_ref(), "dem")?,
        }
    };
    Ok(RunOptions {
        solvers,
        threads: args.threads.into(),
        window: args.window,
        record,
        progress: args.log == LogFormat::Text,
        screen: Some(terminal::screen().clone()),
        patience: Duration::from_secs_f64(args.patience),
        interrupt: interrupt()?,
        save: on_signal(SIGUSR1)?,
    })
}

/// A flag that ends a run in order: set by Ctrl-C and SIGTERM, of which the second does not wait for that, by the end of
/// the terminal (SIGHUP), and by a queue's warning (SIGXCPU).
pub fn interrupt() -> Result<Arc<AtomicBool>, String> {
    let interrupt = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        let code = i32::from(Status::Interrupted.exit_code());
        flag::register_conditional_shutdown(signal, code, interrupt.clone()).map_err(no_signals)?;
    }
    for signal in [SIGINT, SIGTERM, SIGHUP, SIGXCPU] {
        flag::register(signal, interrupt.clone()).map_err(no_signals)?;
    }
    Ok(interrupt)
}

/// A flag that this signal sets.
fn on_signal(signal: i32) -> Result<Arc<AtomicBool>, String> {
    let set = Arc::new(AtomicBool::new(false));
    flag::register(signal, set.clone()).map_err(no_signals)?;
    Ok(set)
}

/// From now on this signal ends nothing.
pub fn ignore(signal: i32) -> Result<(), String> {
    on_signal(signal).map(drop)
}

#[expect(clippy::needless_pass_by_value, reason = "the shape of `map_err`")]
fn no_signals(error: io::Error) -> String {
    format!("cannot handle signals: {error}")
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
