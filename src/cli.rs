//! The command line (DESIGN.md section 5).

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use coupler::diagnostic::SceneErrors;
use coupler::scene::Scene;

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
    /// Run a scene and check what it must show.
    Run(RunArgs),
    /// Validate scene files without running them.
    Check(CheckArgs),
    /// Show what a run will do and what it leaves out.
    Plan(SceneArgs),
    /// Print the JSON Schema of scene files.
    Schema,
    /// Remove what dead runs have left behind.
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
        Scene::load(&self.scene, self.variant.as_deref(), &self.set)
    }
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
pub struct RunArgs {
    /// The scene.
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Run directory; `runs/NAME` by default.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Threads of each solver.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    pub threads: u16,
    /// Run both solvers as threads of this process: the same code over process-local memory.
    #[arg(long)]
    pub in_process: bool,
    /// Most steps granted at once; 1 is the strict mode. The result is the same to the bit.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub window: Option<u32>,
    /// Another rigid-body solver: a command that joins the run when called with `--join RUN`.
    #[arg(long, value_name = "COMMAND", conflicts_with = "in_process")]
    pub dem: Option<String>,
    /// Another continuum solver, likewise.
    #[arg(long, value_name = "COMMAND", conflicts_with = "in_process")]
    pub mpm: Option<String>,
    /// What standard error shows.
    #[arg(long, value_enum, default_value_t = LogFormat::Text)]
    pub log: LogFormat,
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
