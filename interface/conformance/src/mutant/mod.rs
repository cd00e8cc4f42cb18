//! Mutants: solvers that are right but for one rule, to prove that each clause can fail.
//!
//! A mutant is a right solver that talks through a transport of its own. That passes every message on as it is, but for
//! what its [`Flaw`] does.

pub mod change;
pub mod flaw;
mod transport;

use interface::core::SessionError;
use interface::session::solver::{Clocked, Perform, Side};
use interface::session::turns::drive;
use interface::session::{DemSide, MpmSide};
use interface::solver::{DemSolver, MpmSolver};
use interface::transport::domain::Domain;
use interface::transport::iceoryx::{SEND_TIMEOUT, join};
use interface::transport::raw::Medium;

pub use flaw::{Flaw, Mutant, Pass, ProcessFlaws, nap_for_many};

use crate::part::notes;
use transport::Flawed;

/// Makes the right solver that a mutant is but for its flaw.
#[derive(Clone, Copy)]
pub enum Host {
    /// A continuum.
    Mpm(fn() -> Box<dyn MpmSolver>),
    /// A bodies' side.
    Dem(fn() -> Box<dyn DemSolver>),
}

/// Joins the run of `domain` as the hosted solver with a flaw, and serves until its session is over; returns its exit
/// status.
pub fn serve(medium: Medium, domain: &Domain, host: Host, flaw: Flaw) -> u8 {
    let process = flaw.process;
    let served = match host {
        Host::Mpm(make) => {
            let mut solver = make();
            let side = MpmSide::new(&mut *solver, Clocked::Thread);
            through(medium, domain, side, flaw)
        }
        Host::Dem(make) => {
            let mut solver = make();
            let side = DemSide::new(&mut *solver, Clocked::Thread);
            through(medium, domain, side, flaw)
        }
    };
    if process.removes_the_lock {
        let _ = std::fs::remove_file(domain.directory().join("lock"));
    }
    match served {
        Ok(()) => process.status_closed.unwrap_or(0),
        Err(_) => process.status_failed.unwrap_or(3),
    }
}

fn through<P: Perform>(
    medium: Medium,
    domain: &Domain,
    mut side: Side<P>,
    flaw: Flaw,
) -> Result<(), SessionError> {
    let party = side.party();
    let ends = join(medium, domain, party, &[], SEND_TIMEOUT)?;
    if flaw.process.joins_without_note {
        for note in notes(domain).filter(|note| note.pid == std::process::id()) {
            let _ = std::fs::remove_file(note.path);
        }
    }
    drive(&mut side, &mut Flawed::new(ends, party, flaw));
    side.take_verdict()
}
