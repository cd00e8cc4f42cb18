//! A solver joins a run and serves until the session is closed.

use std::time::Duration;

use super::error::{SessionError, broken};
use super::process::started_as;
use super::stopwatch::Clocked;
use super::{Session, drive};
use crate::hosted::Host;
use crate::message::control::{Hello, Notice};
use crate::message::{Channel, Kind, Message};
use crate::transport::domain::Domain;
use crate::transport::iceoryx::{self, SEND_TIMEOUT};
use crate::transport::wait::until;

/// Longest wait of a solver on the wrong side for the end of the session.
const GRACE: Duration = Duration::from_secs(2);
const LOOK: Duration = Duration::from_millis(10);

/// Joins the run of `domain` and serves until the session is closed.
///
/// # Errors
/// Any [`SessionError`]; it was sent to the coupler.
pub fn serve(domain: &Domain, solver: Host) -> Result<(), SessionError> {
    let party = solver.party();
    check_side(domain, solver.hello())?;
    let ends = iceoryx::join(domain, party, &[], SEND_TIMEOUT)?;
    let session = Session::solver(solver, ends, Clocked::Process);
    drive(session.traced(domain, party))
}

/// Refuses to serve if the process was started as another party. Then it sends Hello on the channel on which the coupler
/// expects that party, and waits until the session has ended (O-1, D-2).
fn check_side(domain: &Domain, hello: Hello) -> Result<(), SessionError> {
    let own = hello.party;
    let Some(expected) = started_as().filter(|&expected| expected != own) else {
        return Ok(());
    };
    let hello = Message::notice(0, &Notice::Hello(hello));
    let mut ends = iceoryx::join(domain, expected, &[], SEND_TIMEOUT)?;
    ends.send_and_wake(Channel::of(expected, Kind::Notice), &hello)?;
    until(GRACE, LOOK, || (!domain.coupler_lives()).then_some(()));
    let message = format!("started as the {expected}");
    Err(broken(own, "O-1", 0, message))
}
