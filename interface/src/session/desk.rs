//! A solver's end of its line to the coupler.

use std::time::{Duration, Instant};

use iceoryx2::prelude::Service;
use serde::de::DeserializeOwned;

use super::stopwatch::{Activity, Stopwatch, cpu_ns};
use super::{PATIENCE_WITH_WAITERS, SessionError};
use crate::capability::Capabilities;
use crate::channel::{Bell, Inlet, Outlet, Post, Rope, Seat, seat};
use crate::codec::{decode, encode};
use crate::control::{Configure, Failure, Hello, Notice, Order, PROTOCOL, Party, Ready};
use crate::domain::Domain;
use crate::process::STARTED_AS;
use crate::solver::{Readiness, Refusal};
use crate::wait::{Patience, wait};
use crate::wire::{Grant, ImpInfo, Record, Report, StepHeader};

/// Longest wait for the coupler while the session is being set up: the other solver may be filling a large scene.
const SETUP: Duration = Duration::from_mins(2);

/// Longest that a solver on the wrong side waits for the coupler to end the session.
const GRACE: Duration = Duration::from_secs(2);

/// What the coupler wants next.
pub(crate) enum Next {
    Steps(Grant),
    Drain,
}

pub(crate) struct Desk<S: Service> {
    pub(crate) post: Post<S>,
    pub(crate) party: Party,
    pub(crate) patience: Patience,
    pub(crate) watch: Stopwatch,
    /// First step that is not done; for messages.
    pub(crate) step: u64,
    domain: Domain,
    own_process: bool,
    orders: Inlet<S, u8>,
    notices: Outlet<S, u8>,
    grants: Inlet<S, Grant>,
    reports: Outlet<S, Report>,
    bell: Bell<S>,
    rope: Rope<S>,
    bytes: Vec<u8>,
    granted: Vec<Grant>,
}

impl<S: Service + 'static> Desk<S> {
    /// Takes the seat and says hello.
    pub(crate) fn open(
        domain: &Domain,
        seat: &Seat,
        (identity, capabilities): (String, Capabilities),
        own_process: bool,
    ) -> Result<Self, SessionError> {
        let hello = Hello {
            protocol: PROTOCOL,
            party: seat.party,
            identity,
            pid: std::process::id(),
            capabilities,
        };
        if own_process && let Some(expected) = started_as().filter(|&party| party != seat.party) {
            return Err(wrong_side::<S>(domain, expected, hello));
        }
        let post = Post::open(domain, seat.party)?;
        let desk = Self {
            party: seat.party,
            patience: Patience::until(SETUP),
            watch: Stopwatch::start(),
            step: 0,
            domain: domain.clone(),
            own_process,
            orders: post.inlet(&seat.orders)?,
            notices: post.outlet(&seat.notices)?,
            grants: post.inlet(&seat.grants)?,
            reports: post.outlet(&seat.reports)?,
            bell: post.bell(Party::Coupler, seat.party)?,
            rope: post.rope(seat.party, Party::Coupler)?,
            bytes: Vec::new(),
            granted: Vec::new(),
            post,
        };
        desk.notify(&Notice::Hello(hello))?;
        Ok(desk)
    }

    /// Waits for the solver's part of the scene.
    pub(crate) fn configure<C: DeserializeOwned>(
        &mut self,
    ) -> Result<(Configure, C), SessionError> {
        let order = self.await_order("its part of the scene")?;
        let Order::Configure(configure) = order else {
            return Err(self.contract("S-4", format!("an order that is not Configure: {order:?}")));
        };
        let config = serde_json::from_str(&configure.config).map_err(|e| {
            self.contract("S-5", format!("a configuration that does not parse: {e}"))
        })?;
        self.patience = Patience::until(Duration::from_secs_f64(configure.deadline));
        Ok((configure, config))
    }

    pub(crate) fn ready(
        &self,
        configure: &Configure,
        readiness: Readiness,
    ) -> Result<(), SessionError> {
        self.notify(&Notice::Ready(Ready {
            scene_hash: configure.scene_hash.clone(),
            readiness,
        }))
    }

    pub(crate) fn refuse(&self, refusal: Refusal) -> SessionError {
        match self.notify(&Notice::Refused(refusal.clone())) {
            Ok(()) => SessionError::Refused {
                who: self.party,
                refusal,
            },
            Err(e) => e,
        }
    }

    /// Waits for the next grant, or the end.
    pub(crate) fn next(&mut self) -> Result<Next, SessionError> {
        let (grants, orders, domain) = (&self.grants, &self.orders, &self.domain);
        let (granted, bytes) = (&mut self.granted, &mut self.bytes);
        let step = self.step;
        // The first grant comes when the other solver is ready too.
        let patience = if step == 0 {
            Patience::until(SETUP)
        } else {
            // The coupler waits for a solver that waits for the other one.
            Patience::until(self.patience.deadline + 2 * PATIENCE_WITH_WAITERS)
        };
        let next = wait(
            patience,
            || {
                if grants.receive(granted)?.is_some() {
                    let [grant] = granted[..] else {
                        return Err(broken(
                            Party::Coupler,
                            "G-1",
                            step,
                            format!("{} grants in one message", granted.len()),
                        ));
                    };
                    check(Party::Coupler, "G-2", step, &[grant])?;
                    return Ok(Some(Next::Steps(grant)));
                }
                match receive_order(orders, bytes, step)? {
                    None => Ok(None),
                    Some(Order::Drain) => Ok(Some(Next::Drain)),
                    Some(order) => Err(unexpected(&order, step)),
                }
            },
            |nap| self.bell.sleep(nap),
            || coupler_lives(domain, step),
            |waited| SessionError::Late {
                who: Party::Coupler,
                awaited: "the next grant",
                step,
                waited,
            },
        );
        self.watch.lap(Activity::Wait);
        let next = next?;
        if let Next::Steps(grant) = &next
            && (grant.first != self.step || grant.steps == 0)
        {
            let message = format!(
                "steps {} + {} granted, {} is next",
                grant.first, grant.steps, self.step
            );
            return Err(broken(Party::Coupler, "G-3", self.step, message));
        }
        Ok(next)
    }

    /// To be asked during every long wait for another solver.
    pub(crate) fn alarm(&self) -> Result<(), SessionError> {
        if let Some(order) = receive_order(&self.orders, &mut Vec::new(), self.step)? {
            return Err(unexpected(&order, self.step));
        }
        coupler_lives(&self.domain, self.step)
    }

    pub(crate) fn report(&mut self, mut report: Report) -> Result<(), SessionError> {
        self.watch.lap(Activity::Compute);
        report.next = self.step;
        report.compute_ns = self.watch.compute_ns;
        report.exchange_ns = self.watch.exchange_ns;
        report.wait_ns = self.watch.wait_ns;
        report.cpu_ns = cpu_ns(self.own_process);
        check(self.party, "R-2", self.step, &[report])?;
        let header = StepHeader {
            epoch: report.epoch,
            step: self.step,
            ..StepHeader::default()
        };
        self.reports.send(header, &[report])?;
        self.rope.ring();
        self.watch.lap(Activity::Exchange);
        Ok(())
    }

    /// Says goodbye and waits until the coupler has everything.
    pub(crate) fn close(&mut self) -> Result<(), SessionError> {
        self.notify(&Notice::Bye)?;
        match self.await_order("leave to close")? {
            Order::Close => Ok(()),
            order => Err(unexpected(&order, self.step)),
        }
    }

    /// Tells the coupler why this solver stops, as well as it can.
    pub(crate) fn lament(&self, error: &SessionError) {
        let fault = match error {
            SessionError::Fault { fault, .. } => Some(fault.clone()),
            // The coupler knows.
            SessionError::Aborted(_)
            | SessionError::CouplerGone { .. }
            | SessionError::Refused { .. } => return,
            _ => None,
        };
        let message = match error {
            SessionError::Fault { fault, .. } => fault.to_string(),
            other => other.to_string(),
        };
        // If even this fails, the coupler learns it from the end of the process.
        let _ = self.notify(&Notice::Failed(Failure {
            step: self.step,
            fault,
            message,
        }));
    }

    pub(crate) fn contract(&self, clause: &'static str, message: String) -> SessionError {
        broken(Party::Coupler, clause, self.step, message)
    }

    fn await_order(&mut self, awaited: &'static str) -> Result<Order, SessionError> {
        let (orders, domain, step, bytes) =
            (&self.orders, &self.domain, self.step, &mut self.bytes);
        wait(
            Patience::until(SETUP),
            || receive_order(orders, bytes, step),
            |nap| self.bell.sleep(nap),
            || coupler_lives(domain, step),
            |waited| SessionError::Late {
                who: Party::Coupler,
                awaited,
                step,
                waited,
            },
        )
    }

    fn notify(&self, notice: &Notice) -> Result<(), SessionError> {
        self.notices.send(
            StepHeader {
                step: self.step,
                ..StepHeader::default()
            },
            &encode(notice),
        )?;
        self.rope.ring();
        Ok(())
    }
}

/// The party that the coupler has started this process as, if it says so (O-1).
fn started_as() -> Option<Party> {
    let name = std::env::var(STARTED_AS).ok()?;
    let solvers = [Party::Mpm, Party::Dem];
    solvers.into_iter().find(|party| party.name() == name)
}

/// Says Hello where the coupler listens for another party than this one is, and lives until that has been heard (D-2).
fn wrong_side<S: Service + 'static>(
    domain: &Domain,
    expected: Party,
    hello: Hello,
) -> SessionError {
    let own = hello.party;
    let said = Post::<S>::open(domain, expected).and_then(|post| {
        let notices = post.outlet(&seat(expected).notices)?;
        notices.send(StepHeader::default(), &encode(&Notice::Hello(hello)))?;
        post.rope(expected, Party::Coupler)?.ring();
        let start = Instant::now();
        while domain.coupler_lives() && start.elapsed() < GRACE {
            std::thread::sleep(Duration::from_millis(10));
        }
        Ok(())
    });
    match said {
        Ok(()) => broken(own, "O-1", 0, format!("started as the {expected}")),
        Err(error) => error.into(),
    }
}

fn receive_order<S: Service>(
    orders: &Inlet<S, u8>,
    bytes: &mut Vec<u8>,
    step: u64,
) -> Result<Option<Order>, SessionError> {
    if orders.receive(bytes)?.is_none() {
        return Ok(None);
    }
    match decode(bytes) {
        Ok(Order::Abort(reason)) => Err(SessionError::Aborted(reason)),
        Ok(order) => Ok(Some(order)),
        Err(e) => Err(broken(Party::Coupler, "S-1", step, e.to_string())),
    }
}

fn unexpected(order: &Order, step: u64) -> SessionError {
    broken(
        Party::Coupler,
        "S-3",
        step,
        format!("an order out of turn: {order:?}"),
    )
}

fn coupler_lives(domain: &Domain, step: u64) -> Result<(), SessionError> {
    if domain.coupler_lives() {
        Ok(())
    } else {
        Err(SessionError::CouplerGone { step })
    }
}

pub(crate) fn broken(who: Party, clause: &'static str, step: u64, message: String) -> SessionError {
    SessionError::Contract {
        who,
        clause,
        step,
        message,
    }
}

/// The same check for what is sent and what is received: every number finite and in its range.
pub(crate) fn check<T: Record>(
    who: Party,
    clause: &'static str,
    step: u64,
    records: &[T],
) -> Result<(), SessionError> {
    for (slot, record) in records.iter().enumerate() {
        if let Err(field) = record.check() {
            let message = format!(
                "{field} of record {slot} is not finite, or negative where it may not be: {record:?}"
            );
            return Err(broken(who, clause, step, message));
        }
    }
    Ok(())
}

/// The same check of an IMP set for what is sent and what is received (clause I-2).
pub(crate) fn check_set(set: &[ImpInfo], step: u64) -> Result<(), SessionError> {
    check(Party::Mpm, "I-2", step, set)?;
    let complain = |message| Err(broken(Party::Mpm, "I-2", step, message));
    if let Some(imp) = set.iter().find(|imp| imp.radius <= 0.0 || imp.mass <= 0.0) {
        return complain(format!("radius and mass must be positive: {imp:?}"));
    }
    if let Some(pair) = set.windows(2).find(|pair| pair[0].id >= pair[1].id) {
        return complain(format!("ids must rise: {} then {}", pair[0].id, pair[1].id));
    }
    Ok(())
}
