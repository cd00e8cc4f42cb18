//! A solver as a program: what the thin binaries of the solver crates and the subcommands of `tandem` share.

use std::process::ExitCode;

use crate::SharedMemory;
use crate::domain::Domain;
use crate::session::{SessionError, dem, mpm};
use crate::solver::{DemSolver, MpmSolver};

/// The session has failed; the coupler knows why.
const FAILED: u8 = 3;

/// Joins the run that the arguments name (`--join RUN`) as the continuum.
pub fn serve_mpm<M: MpmSolver>(mut solver: M) -> ExitCode {
    with_run(std::env::args().skip(1), |domain| {
        mpm::run::<SharedMemory, _>(domain, &mut solver, true)
    })
}

/// Joins the run that the arguments name (`--join RUN`) as the bodies.
pub fn serve_dem<D: DemSolver>(mut solver: D) -> ExitCode {
    with_run(std::env::args().skip(1), |domain| {
        dem::run::<SharedMemory, _>(domain, &mut solver, true)
    })
}

/// Joins the run `id` with `serve`, as a process does: its exit status tells whether the session was closed in order.
pub fn join(id: &str, serve: impl FnOnce(&Domain) -> Result<(), SessionError>) -> ExitCode {
    let domain = match Domain::join(id) {
        Ok(domain) => domain,
        Err(error) => {
            eprintln!("error: {error}");
            return ExitCode::from(FAILED);
        }
    };
    match serve(&domain) {
        Ok(()) => ExitCode::SUCCESS,
        // The coupler has been told and tells the user.
        Err(error) => {
            tracing::debug!("{error}");
            ExitCode::from(FAILED)
        }
    }
}

fn with_run(
    mut arguments: impl Iterator<Item = String>,
    serve: impl FnOnce(&Domain) -> Result<(), SessionError>,
) -> ExitCode {
    if let (Some("--join"), Some(id), None) = (
        arguments.next().as_deref(),
        arguments.next(),
        arguments.next(),
    ) {
        join(&id, serve)
    } else {
        eprintln!("error: a solver is started by `tandem run`, or by hand with `--join RUN`");
        ExitCode::from(2)
    }
}
