//! A solver joins a run and serves until the session is closed.

use std::time::Duration;

use super::error::{SessionError, broken};
use super::process::started_as;
use super::solver::hello;
use super::stopwatch::Clocked;
use super::{Session, drive};
use crate::message::codec::encode;
use crate::message::control::{Hello, Notice, Party};
use crate::message::wire::StepHeader;
use crate::solver::{DemSolver, MpmSolver};
use crate::transport::domain::Domain;
use crate::transport::iceoryx::{self, SEND_TIMEOUT};
use crate::transport::wait::until;

/// Longest wait of a solver on the wrong side for the end of the session.
const GRACE: Duration = Duration::from_secs(2);
const LOOK: Duration = Duration::from_millis(10);

/// Joins the run of `domain` as the continuum and serves until the session is closed.
///
/// # Errors
/// Any [`SessionError`]; it was sent to the coupler.
pub fn serve_mpm(domain: &Domain, solver: &mut dyn MpmSolver) -> Result<(), SessionError> {
    let capabilities = solver.capabilities();
    check_side(domain, hello(Party::Mpm, solver.identity(), capabilities))?;
    let mut transport = iceoryx::join(domain, Party::Mpm, &[], SEND_TIMEOUT)?;
    let session = Session::mpm(solver, &mut *transport, Clocked::Process);
    drive(session.traced(domain, Party::Mpm))
}

/// Joins the run of `domain` as the bodies and serves until the session is closed.
///
/// # Errors
/// Any [`SessionError`]; it was sent to the coupler.
pub fn serve_dem(domain: &Domain, solver: &mut dyn DemSolver) -> Result<(), SessionError> {
    let capabilities = solver.capabilities();
    check_side(domain, hello(Party::Dem, solver.identity(), capabilities))?;
    let mut transport = iceoryx::join(domain, Party::Dem, &[], SEND_TIMEOUT)?;
    let session = Session::dem(solver, &mut *transport, Clocked::Process);
    drive(session.traced(domain, Party::Dem))
}

/// Refuses to serve if the process was started as another party. Then it sends Hello on the channel on which the coupler
/// expects that party, and waits until the session has ended (O-1, D-2).
fn check_side(domain: &Domain, hello: Hello) -> Result<(), SessionError> {
    let own = hello.party;
    let Some(expected) = started_as().filter(|&expected| expected != own) else {
        return Ok(());
    };
    let notice = encode(&Notice::Hello(hello));
    let header = StepHeader {
        count: notice.len() as u64,
        ..StepHeader::default()
    };
    let _ends = iceoryx::say_as(domain, expected, &header, &notice)?;
    until(GRACE, LOOK, || (!domain.coupler_lives()).then_some(()));
    let message = format!("started as the {expected}");
    Err(broken(own, "O-1", 0, message))
}
