//! The command line.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use coupler::scene::BUILT_IN;
use study::case::Source;
use study::plot_options::PlotOptions;
use study::stability::StabilityOptions;
use study::work::StudyOptions;

/// Couples a material point continuum to spheropolygon rigid bodies, each in its own process.
#[derive(Debug, Parser)]
#[command(version, arg_required_else_help = true)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run a scene and evaluate its checks.
    Run(RunArgs),
    /// Continue a run from its newest checkpoint.
    Resume(ResumeArgs),
    /// Repeat a recorded run with one solver and compare its answers.
    Replay(ReplayArgs),
    /// Validate scene files without running them.
    Check(CheckArgs),
    /// Show what a run will do and what it leaves out.
    Plan(PlanArgs),
    /// Write a scene to start from.
    New(NewArgs),
    /// Print a JSON Schema: of scene files, or of what a solver is sent.
    Schema {
        /// What it describes.
        #[arg(value_enum, default_value_t)]
        of: SchemaOf,
    },
    /// Run a scene for several resolutions and methods: error against run time, as study.csv and study.svg.
    Study(StudyOptions),
    /// Find the steps at which scenes become unstable, beside those of criteria: stability.csv and edges.csv.
    Stability(StabilityOptions),
    /// Test a solver against every clause of the protocol that can be observed from outside.
    Conformance(ConformanceArgs),
    /// Write one run, or several side by side, as one page for a browser.
    Report(ReportArgs),
    /// Keep the page of a run in progress up to date.
    Watch(WatchArgs),
    /// Draw curves from runs and tables, and pictures of points and bodies.
    Plot(PlotOptions),
    /// Remove the files that dead runs have left in shared memory.
    Clean,
    /// The continuum solver's process; started by `run`.
    Mpm(JoinArgs),
    /// The rigid-body solver's process; started by `run`.
    Dem(JoinArgs),
}

/// Arguments of `plan`.
#[derive(Debug, Args)]
pub struct PlanArgs {
    /// The scene.
    #[command(flatten)]
    pub scene: Source,
    /// Wall time for which the scene is run to estimate the run time on this machine; 0 skips this.
    #[arg(long, value_name = "SECONDS", default_value_t = 1.0, value_parser = seconds)]
    pub measure: f64,
    /// How it would be run.
    #[command(flatten)]
    pub how: HowArgs,
}

/// What `schema` describes.
#[derive(Debug, Clone, Copy, Default, clap::ValueEnum)]
pub enum SchemaOf {
    /// Scene files.
    #[default]
    Scene,
    /// The configuration of the continuum's solver.
    Mpm,
    /// The configuration of the bodies' solver.
    Dem,
}

/// Arguments of `new`.
#[derive(Debug, Args)]
pub struct NewArgs {
    /// What to write.
    #[command(subcommand)]
    pub what: NewCommand,
}

/// What `new` writes.
#[derive(Debug, Subcommand)]
pub enum NewCommand {
    /// A scene that runs, with a comment at every key: NAME.toml, and the schema with which editors check it.
    Scene {
        /// Name of the scene.
        name: String,
    },
    /// A solver for bodies that runs and passes the kit's smallest profile, with tests: the folder NAME.
    Solver {
        /// Name of the solver.
        name: String,
        /// The language to write it in.
        #[arg(long, value_enum)]
        lang: Language,
        /// Checkout of Tandem that the solver uses; by default the one that this program was built from.
        #[arg(long, value_name = "DIR")]
        tree: Option<PathBuf>,
    },
}

/// A language for a solver.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Language {
    /// On `tandem_solver`, which needs iceoryx2's wheel.
    Python,
    /// On the crates `interface` and `mechanics`.
    Rust,
}

/// Arguments of `check`.
#[derive(Debug, Args)]
pub struct CheckArgs {
    /// Scene files.
    #[arg(required = true)]
    pub scenes: Vec<PathBuf>,
    /// Named variant of the scenes.
    #[arg(long, value_name = "NAME")]
    pub variant: Option<String>,
    /// Override a scene key; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
}

/// Arguments of `run`.
#[derive(Debug, Args)]
#[expect(clippy::struct_excessive_bools, reason = "each is an option")]
pub struct RunArgs {
    /// The scene.
    #[command(flatten)]
    pub scene: Source,
    /// Run directory; `runs/NAME` by default.
    #[arg(long, alias = "output", value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// How it is run.
    #[command(flatten)]
    pub how: HowArgs,
    /// Another rigid-body solver: a command that joins the run when called with `--join RUN`, or `built-in`; overrides
    /// the scene's `solvers.dem`.
    #[arg(long, value_name = "COMMAND", conflicts_with = "in_process")]
    pub dem: Option<String>,
    /// Another continuum solver, in the same way.
    #[arg(long, value_name = "COMMAND", conflicts_with = "in_process")]
    pub mpm: Option<String>,
    /// Write report.html at the end, a page with the results of the run; the same as `--set output.report=true`.
    #[arg(long)]
    pub report: bool,
    /// Keep a page of the run for a browser up to date while it runs; `tandem watch DIR` does the same from another terminal.
    #[arg(long)]
    pub watch: bool,
    /// Record every message between the processes in the run directory, for `tandem replay`.
    #[arg(long)]
    pub record: bool,
    /// Do nothing if the run directory has the result of this scene and its solvers; the exit status is that of the run.
    #[arg(long)]
    pub unless_done: bool,
}

/// How a scene is run: none of these options changes a bit of the result.
#[derive(Debug, Args)]
pub struct HowArgs {
    /// Threads of each solver.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    pub threads: u16,
    /// Run both solvers in this thread, by direct calls in turns with the coupler.
    #[arg(long)]
    pub in_process: bool,
    /// Largest number of steps granted at once; 1 is the strict mode.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub window: Option<u32>,
    /// How long to wait for a solver that is stopped, such as by SIGSTOP or in a paused container.
    #[arg(long, value_name = "SECONDS", default_value_t = 600.0, value_parser = seconds)]
    pub patience: f64,
    /// Write a timeline of the processes (compute, exchange, wait) that Perfetto shows.
    #[arg(long, value_name = "FILE", conflicts_with = "in_process")]
    pub trace: Option<PathBuf>,
    /// Start the programs that the scene names as solvers; without it a scene that names any is refused.
    #[arg(long)]
    pub trust: bool,
    /// What standard error shows.
    #[arg(long, value_enum, default_value_t = LogFormat::Text)]
    pub log: LogFormat,
}

/// A time in s: finite, not negative, at most a year.
fn seconds(text: &str) -> Result<f64, String> {
    let time: f64 = text.parse().map_err(|_| "expected a number of seconds")?;
    if (0.0..=3.2e7).contains(&time) {
        Ok(time)
    } else {
        Err("expected a time of 0 s or more, at most a year".into())
    }
}

/// Arguments of `resume`.
#[derive(Debug, Args)]
pub struct ResumeArgs {
    /// Run directory of a run whose scene has `output.checkpoint`.
    pub dir: PathBuf,
    /// Begins `history.csv` or `course.csv` anew where it was changed since the checkpoint; the old one is kept beside it.
    #[arg(long)]
    pub new_tables: bool,
    /// How the rest is run.
    #[command(flatten)]
    pub how: HowArgs,
}

/// Arguments of `report`.
#[derive(Debug, Args)]
pub struct ReportArgs {
    /// Run directories.
    #[arg(required = true, value_name = "DIR")]
    pub dirs: Vec<PathBuf>,
    /// Page to write; `report.html` in the first directory by default.
    #[arg(long, alias = "output", value_name = "FILE.html", value_parser = page)]
    pub out: Option<PathBuf>,
}

/// A page replaces what has its name: a wrong name would cost a table or a scene.
fn page(text: &str) -> Result<PathBuf, &'static str> {
    let path = PathBuf::from(text);
    let end = path.extension().unwrap_or_default();
    let is_page = ["html", "htm"].iter().any(|e| end.eq_ignore_ascii_case(e));
    is_page.then_some(path).ok_or("end its name with .html")
}

/// Arguments of `watch`.
#[derive(Debug, Args)]
pub struct WatchArgs {
    /// Run directory of a run in progress.
    pub dir: PathBuf,
    /// Started by the run itself; ends with the run and not before.
    #[arg(long, hide = true)]
    pub of_run: bool,
}

/// A solver that is started alone.
#[derive(Debug, Args)]
pub struct SolverArgs {
    /// A rigid-body solver: a command that joins a run when called with `--join RUN`, or `built-in`, which is the default.
    #[arg(long, value_name = "COMMAND", num_args = 0..=1, default_missing_value = BUILT_IN, conflicts_with = "mpm")]
    pub dem: Option<String>,
    /// A continuum solver, in the same way.
    #[arg(long, value_name = "COMMAND", num_args = 0..=1, default_missing_value = BUILT_IN)]
    pub mpm: Option<String>,
    /// The built-in solver of that side, in this process.
    #[arg(long)]
    pub in_process: bool,
}

/// Arguments of `replay`.
#[derive(Debug, Args)]
pub struct ReplayArgs {
    /// The recording: `recording.tandem` of a run with `--record`.
    pub recording: PathBuf,
    /// The solver with which it is repeated.
    #[command(flatten)]
    pub solver: SolverArgs,
    /// Largest allowed difference of a number, relative to the largest value of its field so far; by default the bits
    /// must be the same.
    #[arg(long, value_name = "X", default_value_t = 0.0)]
    pub tolerance: f64,
    /// Change the recorded configuration, such as `threads=2`; may be repeated.
    #[arg(long, value_name = "KEY=JSON")]
    pub set: Vec<String>,
}

/// What standard error shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum LogFormat {
    /// A progress bar on a terminal, lines of text.
    Text,
    /// One JSON object a line.
    Json,
}

/// Arguments of a solver process.
#[derive(Debug, Args)]
pub struct JoinArgs {
    /// Id of the run to join.
    #[arg(long, value_name = "RUN")]
    pub join: String,
}

/// Arguments of `conformance`.
#[derive(Debug, Args)]
pub struct ConformanceArgs {
    /// The solver to test.
    #[command(flatten)]
    pub solver: SolverArgs,
    /// Print all clauses, and those that are not tested, without testing.
    #[arg(long)]
    pub list: bool,
    /// Fail if a SHOULD is broken, too.
    #[arg(long)]
    pub strict: bool,
    /// Fail if the solver does not reach this profile, one of docs/conformance.md, such as discs or full.
    #[arg(long, value_name = "PROFILE")]
    pub require: Option<String>,
    /// How it is tested.
    #[command(flatten)]
    pub options: conformance::Options,
    /// Write the verdicts as JSON.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Write the verdicts as JUnit XML.
    #[arg(long, value_name = "FILE")]
    pub junit: Option<PathBuf>,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `--out` is too short for clap to see a typing error in `--ouput`.
    #[test]
    fn a_misspelt_option_gets_a_suggestion() {
        for (command, option) in [
            ("run", "--ouput"),
            ("run", "--thread"),
            ("plot", "--ouptut"),
        ] {
            let error = Cli::try_parse_from(["tandem", command, "a.toml", option, "x"]);
            let words = error.expect_err("no such option").to_string();
            assert!(words.contains("a similar argument exists"), "{words}");
        }
    }
}
