//! The built-in solvers: in processes and threads of their own, or for this thread.

use std::process::ExitCode;

use interface::session::SessionError;
use interface::session::process;
use interface::solver::{DemSolver, MpmSolver};
use interface::transport::domain::Domain;

use crate::cli::JoinArgs;
use crate::logging;

/// The continuum solver.
pub fn mpm() -> Box<dyn MpmSolver> {
    Box::new(mpm_proc::Mpm::default())
}

/// The rigid-body solver.
pub fn dem() -> Box<dyn DemSolver> {
    Box::new(dem_proc::Sdem::default())
}

/// Joins a run as a solver.
pub fn join(args: &JoinArgs, serve: fn(&Domain) -> Result<(), SessionError>) -> ExitCode {
    logging::of_solver();
    process::join(&args.join, serve)
}
