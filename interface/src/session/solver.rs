//! A solver's side of a session, from Hello to Close (PROTOCOL.md sections 2, 5 and 9). What it does within a window
//! depends on the side: [`super::continuum`] and [`super::bodies`].

use super::connection::{Connection, Granted, LATEST, SETUP};
use super::error::{INDIRECT_WAIT_MARGIN, SessionError};
use super::pieces::{self, Mark};
use super::stopwatch::Activity;
use crate::message::codec::encode;
use crate::message::control::{Configure, Hello, Notice, Order, Ready};
use crate::message::wire::{ContactState, Ledger, PointState, Report, StepHeader, flags};
use crate::message::{Channel, Kind, Records};
use crate::solver::{Fault, Readiness, Refusal};

/// What the two sides of a session do in ways of their own.
pub(super) trait Side {
    /// Takes the configuration.
    ///
    /// # Errors
    /// Why it does not parse, or the solver's refusal.
    fn configure(
        &mut self,
        configure: &Configure,
    ) -> Result<Result<Readiness, Refusal>, serde_json::Error>;
    /// Restores the solver's state, and the driver's.
    fn restore(&mut self, saved: &[u8], driver: &[u8]) -> Result<(), Refusal>;
    /// The solver's state, and the driver's.
    fn save(&self) -> Result<(Vec<u8>, Vec<u8>), Fault>;
    /// The steps of the present grant, or as many of them as the budgets allow.
    async fn steps(&mut self, to: &mut Connection) -> Result<(), SessionError>;
    /// The ledger, and the records of groups or bodies.
    fn measurement(&self) -> (&Ledger, Records<'_>);
    /// All points, of a continuum.
    fn points(&self) -> Option<Vec<PointState>> {
        None
    }
    /// The contacts of the window's first step, which had to be a frame's, of bodies that report them.
    fn contacts(&self) -> Option<&[ContactState]> {
        None
    }
}

/// A whole session.
pub(super) async fn session(
    mut to: Connection,
    hello: Hello,
    mut side: impl Side,
) -> Result<(), SessionError> {
    match serve(&mut to, hello, &mut side).await {
        Ok(()) => Ok(()),
        Err(error) => Err(to.report_failure(error).await),
    }
}

async fn serve(
    to: &mut Connection,
    hello: Hello,
    side: &mut impl Side,
) -> Result<(), SessionError> {
    to.say(&Notice::Hello(hello)).await?;
    let items = configure(to, side).await?;
    let mut first = true;
    while let Granted::Window = to.next_grant(first).await? {
        first = false;
        window(to, side, items).await?;
        report(to, side, items).await?;
    }
    drain(to, side).await
}

/// Takes the configuration, and the saved state if there is one. Returns the number of points or bodies.
async fn configure(to: &mut Connection, side: &mut impl Side) -> Result<u64, SessionError> {
    let configure = match to.order("its part of the scene", SETUP).await? {
        Order::Configure(configure) => configure,
        order => {
            return Err(
                to.coupler_broke("S-4", format!("an order that is not Configure: {order:?}"))
            );
        }
    };
    let Some(deadline) = configure.longest_wait() else {
        let message = format!("a deadline of {} s", configure.deadline);
        return Err(to.coupler_broke("S-5", message));
    };
    to.deadline = deadline;
    to.coupled = configure.coupled;
    let state = if configure.restore {
        Some(to.state_to_restore().await?)
    } else {
        None
    };
    let configured = side.configure(&configure).map_err(|e| {
        let message = format!("a configuration that does not parse: {e}");
        to.coupler_broke("S-5", message)
    })?;
    let restored = configured.and_then(|readiness| {
        if let Some(state) = &state {
            restore(to, side, state, readiness.items)?;
        }
        Ok(readiness)
    });
    let readiness = match restored {
        Ok(readiness) => readiness,
        Err(refusal) => return Err(to.refuse(refusal).await),
    };
    let items = readiness.items;
    let channels = Channel::before_ready(to.party, configure.coupled);
    to.io().with(|transport| transport.open(&channels))?;
    let ready = Ready {
        scene_hash: configure.scene_hash,
        readiness,
    };
    to.say(&Notice::Ready(ready)).await?;
    Ok(items)
}

/// Continues from a saved state.
fn restore(
    to: &mut Connection,
    side: &mut impl Side,
    saved: &[u8],
    items: u64,
) -> Result<(), Refusal> {
    let refuse = |text| Err(Refusal::new("restore", text));
    let Some((mark, solver)) = Mark::read(saved) else {
        return refuse(format!("{} bytes are no saved state", saved.len()));
    };
    if mark.items != items {
        return refuse(format!(
            "the saved state is of {} points or bodies, the configuration has {items}",
            mark.items
        ));
    }
    if mark.step.max(mark.set) > LATEST {
        let (step, set) = (mark.step, mark.set);
        return refuse(format!("step {step} and set {set} are of no run"));
    }
    to.io().step.set(mark.step);
    (to.set, to.imps) = (mark.set, mark.imps);
    side.restore(solver, &mark.driver)
}

/// The points and the state if the grant asks for them, and then its steps.
async fn window(to: &mut Connection, side: &mut impl Side, items: u64) -> Result<(), SessionError> {
    let (asked, step) = (to.grant.flags, to.step());
    if asked & flags::FRAME != 0
        && let Some(points) = side.points()
    {
        to.send(to.step(), Records::Points(&points)).await?;
    }
    if asked & flags::CHECKPOINT != 0 {
        to.io().mark("checkpoint");
        let (state, driver) = side.save().map_err(|f| to.fault(f))?;
        let (set, imps) = (to.set, to.imps);
        let mut saved = encode(&Mark {
            step,
            set,
            imps,
            items,
            driver,
        });
        saved.extend(state);
        let channel = Channel::of(to.party, Kind::Saved);
        pieces::send(to.io(), channel, step, &saved).await?;
    }
    side.steps(to).await
}

/// The window is over, or the side has halted: sends what the grant asks for, and then the report.
async fn report(to: &Connection, side: &impl Side, items: u64) -> Result<(), SessionError> {
    let (asked, step) = (to.grant.flags, to.step());
    let measured = asked & flags::MEASURE != 0;
    let mut report = Report {
        epoch: to.grant.epoch,
        next: step,
        halted: (!to.is_window_done()).into(),
        measured: measured.into(),
        items,
        imps: to.imps,
        rebuilds: to.set,
        limits: to.limits,
        ..Report::default()
    };
    if measured {
        let (ledger, records) = side.measurement();
        report.ledger = *ledger;
        to.send(to.grant.first, records).await?;
    }
    if asked & flags::FRAME != 0
        && let Some(contacts) = side.contacts()
    {
        to.send(to.grant.first, Records::Contacts(contacts)).await?;
    }
    to.io().lap(Activity::Compute);
    to.io().watch().write(&mut report);
    let header = StepHeader {
        set: 0,
        ..to.header(0, 1)
    };
    to.send_under(header, Records::Report(&[report])).await
}

/// The end: the points, Bye, and the leave to close.
async fn drain(to: &Connection, side: &impl Side) -> Result<(), SessionError> {
    if let Some(points) = side.points() {
        to.send(to.step(), Records::Points(&points)).await?;
    }
    to.say(&Notice::Bye).await?;
    // The coupler still waits for the Bye of the other solver.
    let at_most = SETUP + 2 * INDIRECT_WAIT_MARGIN;
    match to.order("leave to close", at_most).await? {
        Order::Close => Ok(()),
        order => Err(to.out_of_turn(&order)),
    }
}
