//! The built-in solvers: in processes and threads of their own, or for this thread.

use std::process::ExitCode;

use interface::session::process;
use interface::session::{SessionError, serve_dem, serve_mpm};
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

/// The continuum solver in a process of its own.
pub fn mpm_process(domain: &Domain) -> Result<(), SessionError> {
    serve_mpm(domain, &mut *mpm())
}

/// The rigid-body solver in a process of its own.
pub fn dem_process(domain: &Domain) -> Result<(), SessionError> {
    serve_dem(domain, &mut *dem())
}

/// Joins a run as a solver.
pub fn join(args: &JoinArgs, serve: fn(&Domain) -> Result<(), SessionError>) -> ExitCode {
    logging::of_solver();
    process::join(&args.join, serve)
}
