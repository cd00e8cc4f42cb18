//! `tandem run`: this process becomes the coupler.

use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use coupler::record::Summary;
use coupler::record::background::LogFile;
use coupler::record::rundir::{RunDir, RunDirError, SCENE};
use coupler::record::summary::Status;
use coupler::run::checkpoint::branch::Branch;
use coupler::run::checkpoint::file::{CheckpointError, as_word, is_in};
use coupler::run::killed::Killed;
use coupler::run::resources;
use coupler::run::{Finished, Resumed, RunOptions, Solvers, run as run_scene};
use coupler::scene::{Scene, refuse_points_within_bodies, solver_override};
use interface::trace;
use interface::transport::remains::sweep;
use signal_hook::consts::SIGUSR1;
use study::case::Source;

use crate::cli::{HowArgs, LogFormat, ResumeArgs, RunArgs};
use crate::exit::{Failed, bad_input};
use crate::signals::{interrupt, on_signal};
use crate::terminal::{complain, say};
use crate::{logging, machine, outcome, report, solvers, terminal, watch};

/// Longest name of a default run directory in bytes; file systems allow 255.
const DIRECTORY_MAX: usize = 120;

/// Runs a scene from the command line.
///
/// # Errors
/// Why nothing was started.
pub fn run(args: &RunArgs) -> Result<ExitCode, Failed> {
    let solvers = [("mpm", &args.mpm), ("dem", &args.dem)]
        .into_iter()
        .filter_map(|(side, command)| Some(solver_override(side, command.as_ref()?)));
    let page = args.report.then(|| Ok("output.report=true".to_owned()));
    let more: Result<Vec<_>, _> = solvers.chain(page).collect();
    let scene = args.scene.load_with(&more.map_err(bad_input)?);
    let mut scene = scene.map_err(|errors| errors.to_string())?;
    let branch = Branch::find(&mut scene).map_err(|errors| errors.to_string())?;
    trusted(&scene, &args.how).map_err(bad_input)?;
    let mut options = options(&args.how, args.record, &scene).map_err(bad_input)?;
    refuse_points_within_bodies(&scene).map_err(|errors| errors.to_string())?;
    let out = args
        .out
        .clone()
        .unwrap_or_else(|| default_out(&args.scene, &scene.name, &scene.hash));
    let done = || Summary::read(&out).ok().filter(Summary::settled);
    let same =
        |done: &Summary| done.scene_hash == scene.hash && done.solver_files == scene.solver_files();
    if args.unless_done
        && let Some(done) = done().filter(same)
    {
        say(format_args!("results in {}", out.display()));
        return Ok(done.status.exit_code().into());
    }
    if let Some(start) = &scene.start
        && same_directory(&start.run, &out)
    {
        let why = "the run would replace the one whose state it begins with; give another `--out`";
        return Err(bad_input(why));
    }
    let killed = Killed::find(&out);
    let dir = RunDir::create(&out, &scene.resolved_toml).map_err(|e| with_advice(&e))?;
    let trace = timeline(&args.how).inspect_err(|_| dir.discard());
    options.trace = trace.map_err(bad_input)?;
    let log = LogFile::of(&dir, false).map_err(|e| with_advice(&e))?;
    logging::of_run(&log, args.how.log);
    if args.watch {
        watch::beside(&out);
    }
    begin(&scene, &args.how, &out);
    if let Some(killed) = killed {
        tracing::info!("the earlier run in {}: {}", out.display(), killed.words());
    }
    if let (Some(start), Some(branch)) = (&scene.start, &branch) {
        let from = start.from();
        tracing::info!(from, step = branch.about().step, "begins with another run");
    }
    let finished = run_scene(&scene, &options, &dir, branch);
    Ok(finish(args.how.log, &scene, &dir, &out, &finished))
}

fn same_directory(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

/// Goes on with a run from its newest checkpoint.
///
/// # Errors
/// Why nothing was started.
pub fn resume(args: &ResumeArgs) -> Result<ExitCode, Failed> {
    let scene = Scene::of_run(&args.dir).map_err(|errors| errors.to_string())?;
    trusted(&scene, &args.how).map_err(bad_input)?;
    let killed = Killed::find(&args.dir);
    let dir = RunDir::reopen(&args.dir).map_err(|e| with_advice(&e))?;
    let resumed = Resumed::find(&scene, &dir, args.new_tables)
        .map_err(|error| cannot_resume(&scene, &dir, killed.as_ref(), &error))?;
    let log = LogFile::of(&dir, true).map_err(|e| with_advice(&e))?;
    let mut options = options(&args.how, false, &scene).map_err(bad_input)?;
    options.trace = timeline(&args.how).map_err(bad_input)?;
    logging::of_run(&log, args.how.log);
    begin(&scene, &args.how, &args.dir);
    for damaged in &resumed.passed_over {
        tracing::warn!("{damaged}: passed over");
    }
    for table in &resumed.aside {
        tracing::warn!("{table}");
    }
    let about = resumed.about();
    tracing::info!(
        checkpoint = %resumed.path.display(),
        step = about.step,
        time = about.time,
        "resumed"
    );
    let finished = resumed.run(&scene, &options, &dir);
    Ok(finish(args.how.log, &scene, &dir, &args.dir, &finished))
}

/// Why a run cannot go on, and what to do instead; of one whose coupler was killed also how far it came, which becomes
/// its summary.
fn cannot_resume(
    scene: &Scene,
    dir: &RunDir,
    killed: Option<&Killed>,
    why: &CheckpointError,
) -> Failed {
    if let Some(killed) = killed {
        complain(format_args!("{}: {}", dir.path().display(), killed.words()));
        match killed.write_summary(scene, dir) {
            Ok(_) => complain("summary.json now says so"),
            Err(error) => complain(with_advice(&error)),
        }
    }
    let CheckpointError::None { .. } = why else {
        return bad_input(why);
    };
    let (dir, trust) = (dir.path(), trust_of(scene));
    bad_input(format_args!(
        "{why}\n  `tandem run {} --out OTHER{trust}` starts it again and leaves {} as it is; \
         `--out {}` replaces what is there",
        as_word(&dir.join(SCENE)),
        dir.display(),
        as_word(dir)
    ))
}

/// The option without which a scene that names programs as solvers is not run.
fn trust_of(scene: &Scene) -> &'static str {
    let others = [&scene.solvers.mpm, &scene.solvers.dem];
    if others.iter().any(|command| command.is_some()) {
        " --trust"
    } else {
        ""
    }
}

fn with_advice(why: &RunDirError) -> String {
    format!("error: {why} ({})", why.advice())
}

/// Messages and actions before any run.
fn begin(scene: &Scene, how: &HowArgs, out: &Path) {
    for id in sweep(Duration::ZERO).removed {
        tracing::info!("removed the files of the dead run {id}");
    }
    for warning in &scene.warnings {
        tracing::warn!("{warning}");
    }
    for note in scene.notes() {
        tracing::info!("{note}");
    }
    if let Some(shortage) = machine::shortage(scene, how) {
        tracing::warn!("{shortage}");
    }
    machine::log();
    tracing::info!(pid = std::process::id(), scene = scene.name, out = %out.display(), "coupler");
}

/// Messages after any run.
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
        refused,
    } = finished;
    // A solver of a killed run may still have lived when this run began.
    let _ = sweep(Duration::ZERO);
    if let Some(errors) = refused {
        match log {
            LogFormat::Json => tracing::error!("{errors}"),
            LogFormat::Text => complain(errors),
        }
        return summary.status.exit_code().into();
    }
    if let Some(reason) = &summary.reason {
        give_reason(log, reason);
    }
    if log == LogFormat::Text {
        outcome::show(summary, scene);
    }
    if let Some(error) = unwritten {
        give_reason(log, &format!("{error} ({})", error.advice()));
    }
    if place != out {
        say(format_args!(
            "the earlier result in {} is unchanged",
            out.display()
        ));
    }
    say(format_args!("results in {}", place.display()));
    tracing::debug!("ends");
    if scene.output.report {
        logging::sync();
        match dir.report() {
            Ok(()) => report::at_the_end_of(place),
            Err(error) => complain(format_args!("warning: no report: {error}")),
        }
    }
    let cut_short = matches!(summary.status, Status::Interrupted | Status::Failed);
    if cut_short && place == out && is_in(out) {
        let (out, trust) = (as_word(out), trust_of(scene));
        say(format_args!(
            "`tandem resume {out}{trust}` continues from its last checkpoint"
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

/// Refuses a scene that names programs as solvers: it may come from anybody, and they would run as the user.
///
/// # Errors
/// Why it is not run.
pub fn trusted(scene: &Scene, how: &HowArgs) -> Result<(), String> {
    let programs = scene.programs();
    let Some((first, _)) = programs.first().filter(|_| !how.trust) else {
        return Ok(());
    };
    let each = programs
        .iter()
        .map(|(side, command)| format!("\n  as its {side}: {command}"));
    Err(format!(
        "the scene would start a program of its own, with all that you may do{}\n  \
         `--trust` starts it; `--set solvers.{first}=built-in` runs without it; nothing was started",
        each.collect::<String>()
    ))
}

/// `runs/NAME`, with the variant and the overrides behind it: a scene that was changed is another run.
fn default_out(args: &Source, name: &str, hash: &str) -> PathBuf {
    let mut name = name.to_owned();
    if let Some(variant) = &args.variant {
        name = format!("{name}-{variant}");
    }
    for change in &args.set {
        name = format!("{name},{change}");
    }
    let plain = |c: char| {
        if c.is_alphanumeric() || "-_.,=".contains(c) {
            c
        } else {
            '_'
        }
    };
    let mut file: String = name.chars().map(plain).collect();
    if file.len() > DIRECTORY_MAX {
        file = file.chars().take(DIRECTORY_MAX / 4).collect();
        file = format!("{file}-{}", &hash[..8]);
    }
    PathBuf::from("runs").join(file)
}

/// How `scene` is run, without the [`timeline`].
///
/// # Errors
/// Why it cannot be run so.
pub fn options(args: &HowArgs, record: bool, scene: &Scene) -> Result<RunOptions, String> {
    let solvers = if args.in_process {
        let others = [("mpm", &scene.solvers.mpm), ("dem", &scene.solvers.dem)];
        if let Some((side, _)) = others.iter().find(|(_, command)| command.is_some()) {
            return Err(format!(
                "--in-process: the scene names a solver that is a separate process; `--set solvers.{side}=built-in` selects the built-in one"
            ));
        }
        resources::check_memory(scene).map_err(|error| error.to_string())?;
        Solvers::InProcess {
            mpm: solvers::mpm,
            dem: solvers::dem,
        }
    } else {
        resources::check_memory(scene)
            .and_then(|()| resources::check(scene))
            .map_err(|error| error.to_string())?;
        let named = scene.solvers.clone();
        Solvers::Processes {
            mpm: named.mpm.map_or_else(|| this_program("mpm"), Ok)?,
            dem: named.dem.map_or_else(|| this_program("dem"), Ok)?,
        }
    };
    // In this thread there is nobody to wait for: a solver that hangs hears nothing.
    let asked = interrupt(!args.in_process)?;
    Ok(RunOptions {
        solvers,
        threads: args.threads.into(),
        window: args.window,
        record,
        trace: None,
        progress: args.log == LogFormat::Text,
        screen: Some(terminal::screen().clone()),
        patience: Duration::from_secs_f64(args.patience),
        stepping: None,
        interrupt: asked.to_end,
        at_once: asked.at_once,
        save: on_signal(SIGUSR1)?,
    })
}

/// Begins the timeline that is asked for. It replaces an earlier one, so nothing may refuse the run any more.
///
/// # Errors
/// Why it cannot be written.
pub fn timeline(how: &HowArgs) -> Result<Option<PathBuf>, String> {
    let begun = how.trace.as_ref().map(|path| {
        trace::begin(path)?;
        std::path::absolute(path)
    });
    begun.transpose().map_err(|e| format!("--trace: {e}"))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_changed_scene_has_a_directory_of_its_own() {
        let out = |variant: Option<&str>, set: &[&str]| {
            let scene = Source {
                path: PathBuf::from("silo.toml"),
                variant: variant.map(str::to_owned),
                set: set.iter().map(|&s| s.to_owned()).collect(),
            };
            default_out(&scene, "silo", "0123456789abcdef")
                .display()
                .to_string()
        };
        assert_eq!(out(None, &[]), "runs/silo");
        assert_eq!(out(Some("quick"), &[]), "runs/silo-quick");
        let finer = out(Some("quick"), &["mpm.cell=0.002"]);
        assert_eq!(finer, "runs/silo-quick,mpm.cell=0.002");
        let strange = out(None, &["a=\"../b c\""]);
        assert_eq!(strange, "runs/silo,a=_.._b_c_");
        let long = out(None, &[&format!("a={}", "9".repeat(300))]);
        assert_eq!(long, format!("runs/silo,a={}-01234567", "9".repeat(23)));
    }
}
