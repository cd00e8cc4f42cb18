//! Mutants: solvers that are right but for one rule, to prove that each clause can fail.
//!
//! A mutant is a right solver that talks through a transport of its own. That passes every message on as it is, but for
//! what its [`Flaw`] does.

pub mod change;
pub mod flaw;
mod transport;

use interface::hosted::Host;
use interface::session::{Clocked, SessionError, drive};
use interface::transport::domain::Domain;
use interface::transport::iceoryx::{SEND_TIMEOUT, join};

pub use flaw::{Flaw, Mutant, Pass, ProcessFlaws};

use crate::part::notes;
pub use transport::Flawed;

/// Joins the run of `domain` as the hosted solver with a flaw, and serves until its session is over; returns its exit
/// status.
pub fn serve(domain: &Domain, host: Host, flaw: Flaw) -> u8 {
    let process = flaw.process;
    let served = served(domain, host, flaw);
    if process.removes_the_lock {
        let _ = std::fs::remove_file(domain.directory().join("lock"));
    }
    match served {
        Ok(()) => process.status_closed.unwrap_or(0),
        Err(_) => process.status_failed.unwrap_or(3),
    }
}

fn served(domain: &Domain, mut host: Host, flaw: Flaw) -> Result<(), SessionError> {
    let party = host.party();
    let ends = join(domain, party, &[], SEND_TIMEOUT)?;
    if flaw.process.joins_without_note {
        for note in notes(domain).filter(|note| note.pid == std::process::id()) {
            let _ = std::fs::remove_file(note.path);
        }
    }
    let mut flawed = Flawed::new(ends, party, flaw);
    drive(host.session(&mut flawed, Clocked::Process))
}
