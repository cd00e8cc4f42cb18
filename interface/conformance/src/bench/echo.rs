//! A peer that does nothing but answer: what an exchange takes of the machine, whatever the solver.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use interface::message::control::Party;
use interface::message::wire::{ImpForce, ImpState, StepHeader};
use interface::transport::domain::Domain;
use interface::transport::iceoryx::join;
use interface::transport::raw::{Channel, ChannelError, Kind, Medium, Message, Payload, RawRun};
use interface::transport::wait::{Awaited, Spin, wait};

use super::session::PATIENCE;
use crate::verdict::{Unmet, broken};

/// Exchanges, of which the fastest counts.
const EXCHANGES: usize = 50;
/// Longest sleep of either party.
const NAP: Duration = Duration::from_millis(1);

/// Least time between states of so many points and the forces on them that a thread sends back at once.
///
/// # Errors
/// [`Unmet::Broken`] when the channels do not work.
pub fn echo(medium: Medium, points: usize) -> Result<Duration, Unmet> {
    let raw_run = RawRun::open(medium, Party::Dem)?;
    let domain = raw_run.domain().clone();
    let over = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| answer(medium, &domain, &over));
        let least = ask(&raw_run, points);
        over.store(true, Ordering::Relaxed);
        least
    })
}

/// Answers until it is over; what fails here is seen at the other end as silence.
fn answer(medium: Medium, domain: &Domain, over: &AtomicBool) -> Result<(), ChannelError> {
    let mut ends = join(medium, domain, Party::Dem, &[], PATIENCE)?;
    ends.open(&Channel::before_ready(Party::Dem, true))?;
    let (states, forces) = [Kind::States, Kind::Forces]
        .map(|kind| Channel::of(Party::Dem, kind))
        .into();
    while !over.load(Ordering::Relaxed) {
        if let Some(message) = ends.take(states)? {
            let answer = Payload::Forces(vec![ImpForce::default(); message.payload.len()]);
            ends.send_and_wake(forces, &Message::new(message.header, answer))?;
        } else {
            ends.sleep(Party::Mpm, NAP);
        }
    }
    Ok(())
}

/// The forces of the echo.
struct Echo<'a>(&'a RawRun);

impl Awaited for Echo<'_> {
    type Found = Result<Message, ChannelError>;

    fn look(&mut self) -> Option<Self::Found> {
        self.0.receive(Kind::Forces).transpose()
    }

    fn block(&mut self, at_most: Duration) {
        self.0.sleep(Kind::Forces, at_most);
    }
}

fn ask(raw_run: &RawRun, points: usize) -> Result<Duration, Unmet> {
    let start = Instant::now();
    let closed = |name: &&str| name.starts_with("imp/") || name.contains("mpm-dem");
    while raw_run.unopened().iter().any(closed) {
        if start.elapsed() > PATIENCE {
            return Err(broken(
                "channels of the kit's own",
                raw_run.unopened().join(", "),
            ));
        }
        interface::transport::wait::nap(NAP);
    }
    let states = Payload::States(vec![ImpState::default(); points]);
    let message = Message::new(StepHeader::default(), states);
    let mut least = Duration::MAX;
    let mut spin = Spin::default();
    for _ in 0..EXCHANGES {
        let sent = Instant::now();
        raw_run.send(&message)?;
        wait(&mut Echo(raw_run), &mut spin, PATIENCE).map_err(|waited| {
            broken("the kit's own echo", format_args!("nothing for {waited:?}"))
        })??;
        least = least.min(sent.elapsed());
    }
    Ok(least)
}
