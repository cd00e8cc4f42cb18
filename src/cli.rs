//! The command line.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use coupler::scene::Scene;
use coupler::scene::diagnostic::SceneErrors;
use study::snapshots::Which;

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
    Study(StudyArgs),
    /// Find the steps at which scenes become unstable, and compare them with criteria: stability.csv and stability.svg.
    Stability(StabilityArgs),
    /// Test a solver against every clause of the protocol that can be observed from outside.
    Conformance(ConformanceArgs),
    /// Write one run, or several side by side, as one page for a browser.
    Report(ReportArgs),
    /// Show a run in progress in a browser on this machine.
    Watch(WatchArgs),
    /// Draw curves from runs and tables, and pictures of points and bodies.
    Plot(PlotArgs),
    /// Remove the files that dead runs have left in shared memory.
    Clean,
    /// The continuum solver's process; started by `run`.
    Mpm(JoinArgs),
    /// The rigid-body solver's process; started by `run`.
    Dem(JoinArgs),
}

/// A scene with overrides.
#[derive(Debug, Args)]
pub struct SceneArgs {
    /// Scene file.
    pub scene: PathBuf,
    /// Named variant of the scene, such as `quick`.
    #[arg(long, value_name = "NAME")]
    pub variant: Option<String>,
    /// Override a scene key, such as `mpm.cell=0.002`; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
}

impl SceneArgs {
    /// The scene.
    pub fn load(&self) -> Result<Scene, SceneErrors> {
        self.load_with(&[])
    }

    /// The scene with more keys set, after those of the user.
    pub fn load_with(&self, more: &[String]) -> Result<Scene, SceneErrors> {
        let set: Vec<String> = self.set.iter().chain(more).cloned().collect();
        Scene::load(&self.scene, self.variant.as_deref(), &set)
    }
}

/// Arguments of `plan`.
#[derive(Debug, Args)]
pub struct PlanArgs {
    /// The scene.
    #[command(flatten)]
    pub scene: SceneArgs,
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
    pub scene: SceneArgs,
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
    /// Show the run in a browser on this machine while it runs; `tandem watch DIR` does the same from another terminal.
    #[arg(long)]
    pub watch: bool,
    /// Record every message between the processes in the run directory, for `tandem replay`.
    #[arg(long)]
    pub record: bool,
    /// Do nothing if the run directory has the result of this scene; the exit status is that of the run.
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
    #[arg(long, alias = "output", value_name = "FILE")]
    pub out: Option<PathBuf>,
}

/// Arguments of `watch`.
#[derive(Debug, Args)]
pub struct WatchArgs {
    /// Run directory of a run in progress.
    pub dir: PathBuf,
    /// Port of the loopback interface; a free one by default.
    #[arg(long, value_name = "PORT", default_value_t = 0)]
    pub port: u16,
    /// Started by the run itself; ends with the run and not before.
    #[arg(long, hide = true)]
    pub of_run: bool,
}

/// Arguments of `replay`.
#[derive(Debug, Args)]
#[expect(
    clippy::option_option,
    reason = "clap's form of an option whose value may be left out"
)]
pub struct ReplayArgs {
    /// The recording: `recording.tandem` of a run with `--record`.
    pub recording: PathBuf,
    /// Repeat it with a rigid-body solver: the built-in one, or this command.
    #[arg(long, value_name = "COMMAND", num_args = 0..=1, required_unless_present = "mpm", conflicts_with = "mpm")]
    pub dem: Option<Option<String>>,
    /// Repeat it with a continuum solver, in the same way.
    #[arg(long, value_name = "COMMAND", num_args = 0..=1)]
    pub mpm: Option<Option<String>>,
    /// Repeat it with the built-in solver in this process.
    #[arg(long)]
    pub in_process: bool,
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

/// How the runs of a study are started.
#[derive(Debug, Args)]
pub struct RunsArgs {
    /// Directory of the results; runs that it already contains are not repeated.
    #[arg(long, alias = "output", value_name = "DIR")]
    pub out: PathBuf,
    /// Largest number of runs at the same time: by default 1 on this machine, 100 in Slurm. With more than one their times are
    /// those of runs that share the machine.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub jobs: Option<u16>,
    /// Threads of each solver.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    pub threads: u16,
    /// Run both solvers of a run in one thread of one process.
    #[arg(long)]
    pub in_process: bool,
    /// Start the programs that the scene names as solvers; without it a scene that names any is refused.
    #[arg(long)]
    pub trust: bool,
}

/// What starts the runs of a study.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum EngineArg {
    /// Processes of this machine, `--jobs` at once.
    Local,
    /// HyperQueue's Python package; of the server that `HQ_SERVER_DIR` names, or on this machine.
    Hyperqueue,
    /// One job array of Slurm.
    Slurm,
}

/// Arguments of `study`.
#[derive(Debug, Args)]
pub struct StudyArgs {
    /// The scene.
    #[command(flatten)]
    pub scene: SceneArgs,
    /// The runs.
    #[command(flatten)]
    pub runs: RunsArgs,
    /// What starts the runs.
    #[arg(long, value_enum, default_value_t = EngineArg::Local)]
    pub engine: EngineArg,
    /// Processors that a queue keeps for a run; by default one for each thread of its two solvers.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub cores: Option<u16>,
    /// Memory that a queue keeps for a run.
    #[arg(long, value_name = "MIB", value_parser = clap::value_parser!(u32).range(1..))]
    pub memory: Option<u32>,
    /// Start nothing: write the command of each run that is missing as a line of FILE, for another queue. The same command
    /// without this option makes the table of what is there.
    #[arg(long, value_name = "FILE")]
    pub commands: Option<PathBuf>,
    /// Values of a scene key, or of `variant`; every combination with the values of other keys is run. May be repeated.
    /// By default those of the scene's `[study]`.
    #[arg(long, value_name = "KEY=V1,V2,...")]
    pub vary: Vec<String>,
    /// Draw the values of N runs from the ranges of `--over`, as a Latin hypercube, in place of combinations.
    #[arg(
        long,
        value_name = "N",
        value_parser = clap::value_parser!(u16).range(2..),
        requires = "over",
        conflicts_with_all = ["vary", "error", "finer", "resolution", "along"]
    )]
    pub sample: Option<u16>,
    /// Range of a scene key: `uniform(A,B)`, `log_uniform(A,B)`, or `integer(A,B)` for whole numbers. May be repeated.
    #[arg(long, value_name = "KEY=uniform(A,B),...", requires = "sample")]
    pub over: Vec<String>,
    /// Seed of the sample.
    #[arg(long, value_name = "N", default_value_t = 0, requires = "sample")]
    pub seed: u64,
    /// Check whose error is used.
    #[arg(long, value_name = "CHECK", conflicts_with = "finer")]
    pub error: Option<String>,
    /// Column or check that is compared with the finest run, in place of a check's error; may be repeated.
    #[arg(long, value_name = "NAME")]
    pub finer: Vec<String>,
    /// Scene key whose number is the resolution of a run.
    #[arg(long, value_name = "KEY")]
    pub resolution: Option<String>,
    /// Varied key that changes along a curve instead of distinguishing curves; may be repeated.
    #[arg(long, value_name = "KEY")]
    pub along: Vec<String>,
    /// Check or column whose value is shown for each combination, in place of an error; may be repeated. If no check
    /// has a reference, the default is all checks, or all columns of a scene without checks.
    #[arg(long, value_name = "NAME", conflicts_with_all = ["error", "finer"])]
    pub value: Vec<String>,
    /// Largest number of times that each run is timed, 7 by default; the smallest CPU time of stepping counts.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub repeat: Option<u16>,
    /// A run is timed again until its two smallest times differ by at most this share of the smallest.
    #[arg(long, value_name = "SHARE", default_value_t = 0.05)]
    pub scatter: f64,
}

/// Arguments of `stability`.
#[derive(Debug, Args)]
pub struct StabilityArgs {
    /// Scene files; by default a selection of those in `scenes/`.
    pub scenes: Vec<PathBuf>,
    /// The runs.
    #[command(flatten)]
    pub runs: RunsArgs,
    /// Named variant of the scenes; `quick` by default if they have it.
    #[arg(long, value_name = "NAME")]
    pub variant: Option<String>,
    /// Override a scene key; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Columns of the map: a scene key and its numbers. By default decades of `contact.linear.normal_stiffness`.
    #[arg(long, value_name = "KEY=N1,N2,...")]
    pub vary: Option<String>,
    /// Key that varies along a column; its limit of stability is searched for.
    #[arg(long, value_name = "KEY", default_value = study::stability::STEP_FACTOR)]
    pub edge: String,
    /// Range of the search: stable at the first value, unstable at the second.
    #[arg(long, value_name = "LOW,HIGH", default_value = "0.5,8", value_parser = numbers::<2>)]
    pub between: [f64; 2],
    /// Values of the grid along a column, before bisection.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u16).range(2..))]
    pub grid: u16,
    /// Largest ratio between an unstable value and the stable one below it, at which the search ends.
    #[arg(long, value_name = "RATIO", default_value_t = 1.1)]
    pub ratio: f64,
    /// Largest share of the energy in play that a stable run may create numerically.
    #[arg(long, value_name = "SHARE", default_value_t = 0.05)]
    pub residual: f64,
    /// Compare the steps of criteria over all scenes instead of making maps.
    #[arg(long, conflicts_with = "vary")]
    pub table: bool,
}

/// Arguments of `plot`.
#[expect(
    clippy::struct_excessive_bools,
    reason = "each is an option of its own"
)]
#[derive(Debug, Args)]
pub struct PlotArgs {
    /// Run directories, whose history.csv or frames are read, and CSV files; each may have a label for the legend.
    #[arg(required = true, value_name = "[LABEL=]DATA")]
    pub data: Vec<String>,
    /// Figure to write; with frames also a film (.gif).
    #[arg(long, alias = "output", value_name = "FILE.svg|.png")]
    pub out: PathBuf,
    /// Expression of columns; may be repeated.
    #[arg(
        long,
        required_unless_present = "frames",
        value_name = "[LABEL=]EXPRESSION",
        allow_hyphen_values = true
    )]
    pub y: Vec<String>,
    /// Draw pictures of the frames at these times in s, or of all frames.
    #[arg(long, value_name = "TIME,...|all", value_delimiter = ',', value_parser = which, conflicts_with = "y")]
    pub frames: Vec<Which>,
    /// Quantity that colours the points: an expression of `x y vx vy speed stress_xx stress_yy stress_zz stress_xy
    /// pressure shear volume mass density group id`, and of `plastic_strain` if a material of the run keeps it. Points
    /// without a number are grey.
    #[arg(
        long,
        value_name = "[LABEL=]EXPRESSION",
        default_value = "speed",
        visible_alias = "color",
        requires = "frames",
        allow_hyphen_values = true
    )]
    pub colour: String,
    /// Values of the first and the last colour; by default the smallest and the largest value of the points.
    #[arg(long, value_name = "LOW,HIGH", value_parser = numbers::<2>, requires = "frames", allow_hyphen_values = true)]
    pub clim: Option<[f64; 2]>,
    /// Also draw contact forces, as lines from centre to centre whose width is proportional to the force.
    #[arg(long, requires = "frames")]
    pub forces: bool,
    /// Pictures per second of a film.
    #[arg(long, value_name = "N", default_value_t = 10.0, requires = "frames")]
    pub rate: f64,
    /// Pictures in a row; more make each smaller. By default 2, and 1 of a single picture or a film.
    #[arg(long, value_name = "N", requires = "frames")]
    pub columns: Option<usize>,
    /// Expression of columns for the horizontal axis.
    #[arg(
        long,
        value_name = "EXPRESSION",
        default_value = "time",
        allow_hyphen_values = true
    )]
    pub x: String,
    /// Expected curve, as an expression of `x`; drawn dashed; may be repeated.
    #[arg(long, value_name = "[LABEL=]EXPRESSION", allow_hyphen_values = true)]
    pub expected: Vec<String>,
    /// Column whose values distinguish curves: one curve for each value.
    #[arg(long, value_name = "COLUMN")]
    pub by: Option<String>,
    /// Draw the slope of y over x instead, as a difference quotient over this width.
    #[arg(long, value_name = "WIDTH")]
    pub slope: Option<f64>,
    /// First and last x of the axis, in m with frames; either may be left out: `,0.5`.
    #[arg(long, value_name = "LEFT,RIGHT", value_parser = ends, allow_hyphen_values = true)]
    pub xlim: Option<Ends>,
    /// First and last y of the axis, in the same way.
    #[arg(long, value_name = "BOTTOM,TOP", value_parser = ends, allow_hyphen_values = true)]
    pub ylim: Option<Ends>,
    /// A logarithmic x axis.
    #[arg(long, conflicts_with = "frames")]
    pub xlog: bool,
    /// A logarithmic y axis.
    #[arg(long, conflicts_with = "frames")]
    pub ylog: bool,
    /// Dots instead of lines.
    #[arg(long)]
    pub dots: bool,
    /// Title; of curves the name of the file by default.
    #[arg(long)]
    pub title: Option<String>,
    /// Label of the x axis; the expression and its unit by default.
    #[arg(long, value_name = "TEXT", conflicts_with = "frames")]
    pub xlabel: Option<String>,
    /// Label of the y axis; the expression and its unit by default.
    #[arg(long, value_name = "TEXT", conflicts_with = "frames")]
    pub ylabel: Option<String>,
}

/// The first and the last number of an axis, if they are given.
pub type Ends = [Option<f64>; 2];

fn ends(text: &str) -> Result<Ends, String> {
    let (low, high) = text
        .split_once(',')
        .ok_or("expected LOW,HIGH, of which one may be left out")?;
    let end = |text: &str| match text.trim() {
        "" => Ok(None),
        number => number
            .parse()
            .map(Some)
            .map_err(|e| format!("{number}: {e}")),
    };
    match [end(low)?, end(high)?] {
        [Some(low), Some(high)] if low >= high => Err("LOW is not below HIGH".to_owned()),
        ends => Ok(ends),
    }
}

fn which(text: &str) -> Result<Which, String> {
    match text.trim() {
        "all" => Ok(Which::All),
        time => time
            .parse()
            .map(Which::At)
            .map_err(|e| format!("{time}: {e}; expected times in s or `all`")),
    }
}

/// Reads numbers with commas between them.
fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let all: Result<Vec<f64>, _> = text.split(',').map(|n| n.trim().parse()).collect();
    let all = all.map_err(|e| format!("{e}"))?;
    let count = all.len();
    all.try_into()
        .map_err(|_| format!("{count} numbers, expected {N} with commas between them"))
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
    /// The rigid-body solver to test: a command that joins a run when called with `--join RUN`, or `built-in`.
    #[arg(long, value_name = "COMMAND", conflicts_with = "mpm")]
    pub dem: Option<String>,
    /// The continuum solver to test, in the same way.
    #[arg(long, value_name = "COMMAND")]
    pub mpm: Option<String>,
    /// Test the built-in solver of that side in this process instead of starting the command.
    #[arg(long)]
    pub in_process: bool,
    /// Print all clauses, and those that are not tested, without testing.
    #[arg(long)]
    pub list: bool,
    /// Test only these clauses.
    #[arg(long, value_name = "ID", value_delimiter = ',')]
    pub only: Vec<String>,
    /// Fail if a SHOULD is broken, too.
    #[arg(long)]
    pub strict: bool,
    /// Fail if the solver does not reach this profile: held, discs, discs+friction, polygons, full; for a continuum
    /// elastic, full.
    #[arg(long, value_name = "PROFILE")]
    pub require: Option<String>,
    /// Largest number of steps granted at once.
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..))]
    pub window: u32,
    /// Number of clauses tested at the same time; by default two for each core, at most eight. Clauses that measure
    /// time are tested alone.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub jobs: Option<u16>,
    /// Seed of the first random case; the next one has the next seed.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Number of random cases, at most.
    #[arg(long, value_name = "N", default_value_t = 1000)]
    pub cases: u64,
    /// Time for random cases in seconds, at most.
    #[arg(long, value_name = "SECONDS", default_value_t = 10)]
    pub time: u32,
    /// Time to make a random case that fails smaller in seconds, at most.
    #[arg(long, value_name = "SECONDS", default_value_t = 10)]
    pub shrink: u32,
    /// Longest wait for Hello and for Ready in seconds; the start-up time of a solver is not tested.
    #[arg(long, value_name = "SECONDS", default_value_t = 20, value_parser = clap::value_parser!(u16).range(1..))]
    pub startup: u16,
    /// Write the verdicts as JSON.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Write the verdicts as JUnit XML.
    #[arg(long, value_name = "FILE")]
    pub junit: Option<PathBuf>,
    /// Write the messages of every broken clause, one file for each.
    #[arg(long, value_name = "DIR")]
    pub trace: Option<PathBuf>,
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
