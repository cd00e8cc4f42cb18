//! The built-in solvers, as processes and as threads.

use std::process::ExitCode;

use interface::domain::Domain;
use interface::process;
use interface::session::{SessionError, dem, mpm};
use interface::{OneProcess, SharedMemory};

use crate::cli::JoinArgs;
use crate::logging;

/// The continuum solver in a process of its own.
pub fn mpm_process(domain: &Domain) -> Result<(), SessionError> {
    mpm::run::<SharedMemory, _>(domain, &mut mpm_proc::Mpm::default(), true)
}

/// The continuum solver in a thread.
pub fn mpm_thread(domain: &Domain) -> Result<(), SessionError> {
    mpm::run::<OneProcess, _>(domain, &mut mpm_proc::Mpm::default(), false)
}

/// The rigid-body solver in a process of its own.
pub fn dem_process(domain: &Domain) -> Result<(), SessionError> {
    dem::run::<SharedMemory, _>(domain, &mut dem_proc::Sdem::default(), true)
}

/// The rigid-body solver in a thread.
pub fn dem_thread(domain: &Domain) -> Result<(), SessionError> {
    dem::run::<OneProcess, _>(domain, &mut dem_proc::Sdem::default(), false)
}

/// Joins a run as a solver.
pub fn join(args: &JoinArgs, serve: fn(&Domain) -> Result<(), SessionError>) -> ExitCode {
    logging::of_solver();
    process::join(&args.join, serve)
}
