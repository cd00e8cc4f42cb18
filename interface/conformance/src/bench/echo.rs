//! A peer that does nothing but answer: what an exchange takes of the machine, whatever the solver.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use interface::control::Party;
use interface::domain::Domain;
use interface::stage::{ChannelError, Kind, Medium, Message, Payload, Seat, Stage};
use interface::wait::{Patience, wait};
use interface::wire::{ImpForce, ImpState, StepHeader};

use super::PATIENCE;
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
    let stage = Stage::open(medium, Party::Dem)?;
    let domain = stage.domain().clone();
    let over = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| answer(medium, &domain, &over));
        let least = ask(&stage, points);
        over.store(true, Ordering::Relaxed);
        least
    })
}

/// Answers until it is over; what fails here is seen at the other end as silence.
fn answer(medium: Medium, domain: &Domain, over: &AtomicBool) -> Result<(), ChannelError> {
    let seat = Seat::join(medium, domain, Party::Dem)?;
    seat.open_exchange()?;
    while !over.load(Ordering::Relaxed) {
        let patience = Patience {
            nap: NAP,
            ..Patience::until(NAP)
        };
        let states = wait(
            patience,
            || seat.receive(Kind::States).map_err(Some),
            |nap| {
                seat.sleep(Kind::States, nap);
            },
            || Ok(()),
            |_| None,
        );
        match states {
            Ok(states) => {
                let forces = vec![ImpForce::default(); states.payload.len()];
                seat.send(&Message::new(states.header, Payload::Forces(forces)))?;
            }
            Err(Some(error)) => return Err(error),
            Err(None) => {}
        }
    }
    Ok(())
}

fn ask(stage: &Stage, points: usize) -> Result<Duration, Unmet> {
    let start = Instant::now();
    let closed = |name: &&str| name.starts_with("imp/") || name.contains("mpm-dem");
    while stage.unopened().iter().any(closed) {
        if start.elapsed() > PATIENCE {
            return Err(broken(
                "channels of the kit's own",
                stage.unopened().join(", "),
            ));
        }
        std::thread::sleep(NAP);
    }
    let states = Payload::States(vec![ImpState::default(); points]);
    let message = Message::new(StepHeader::default(), states);
    let mut least = Duration::MAX;
    for _ in 0..EXCHANGES {
        let sent = Instant::now();
        stage.send(&message)?;
        wait(
            Patience {
                nap: NAP,
                ..Patience::until(PATIENCE)
            },
            || stage.receive(Kind::Forces).map_err(Unmet::from),
            |nap| {
                stage.sleep(Kind::Forces, nap);
            },
            || Ok(()),
            |waited| broken("the kit's own echo", format_args!("nothing for {waited:?}")),
        )?;
        least = least.min(sent.elapsed());
    }
    Ok(least)
}
