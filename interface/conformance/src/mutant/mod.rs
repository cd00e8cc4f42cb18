//! Mutants: solvers that are right but for one rule, to prove that each clause can fail.
//!
//! A mutant is a relay. It joins the run as the solver, with a raw [`Seat`], and hosts the real solver in a thread, in a
//! run of its own with a raw [`Stage`]. Every message is passed on as it is, but for what its [`Flaw`] does.

pub mod spoil;

use std::cell::RefCell;
use std::rc::Rc;
use std::time::{Duration, Instant};

use interface::config::DemConfig;
use interface::control::{Configure, Notice, Order, Party};
use interface::domain::Domain;
use interface::session::SessionError;
use interface::stage::{ChannelError, Kind, Medium, Message, Payload, Seat, Stage};
use interface::wire::{
    BodyState, EnvelopeVertex, Grant, GroupState, ImpForce, ImpInfo, ImpState, PointState, Report,
    StepHeader,
};
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::clause::Clause;

/// The solver that a mutant hosts: joins a run over [`Medium::Threads`].
#[derive(Debug, Clone, Copy)]
pub struct Host {
    /// Its side.
    pub party: Party,
    /// Serves until the session ends.
    pub solve: fn(&Domain) -> Result<(), SessionError>,
}

/// A solver that breaks one clause.
#[derive(Clone, Copy)]
pub struct Mutant {
    /// What it does wrong.
    pub what: &'static str,
    /// Makes its flaw, afresh for every run.
    pub flaw: fn() -> Flaw,
}

/// A mutant with the name by which it is called, and the clause that it breaks.
#[derive(Clone)]
pub struct Named {
    /// The clause's id, for its second mutant with `/2` behind it.
    pub name: String,
    /// What it breaks.
    pub clause: &'static Clause,
    /// The mutant.
    pub mutant: Mutant,
}

/// The mutants of one side.
pub fn of(party: Party) -> Vec<Named> {
    let mut named = Vec::new();
    for clause in crate::clause::of(party) {
        for (k, mutant) in (1..).zip(clause.mutants()) {
            let name = match k {
                1 => clause.id.to_string(),
                k => format!("{}/{k}", clause.id),
            };
            named.push(Named {
                name,
                clause,
                mutant,
            });
        }
    }
    named
}

/// What to pass on instead of a message: nothing, the message, or several.
pub type Pass = Box<dyn FnMut(Message) -> Vec<Message>>;

/// What a mutant does wrong.
pub struct Flaw {
    /// To what comes from coupler and peer.
    pub inbound: Pass,
    /// To what goes to them.
    pub outbound: Pass,
    /// Outside the messages.
    pub manners: Manners,
}

/// What a solver does besides sending and receiving.
#[expect(
    clippy::struct_excessive_bools,
    reason = "each is a bad manner of its own, which one mutant has"
)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Manners {
    /// Exit status after Close, instead of 0.
    pub status_closed: Option<u8>,
    /// Exit status after anything else, instead of 3.
    pub status_failed: Option<u8>,
    /// Exit status when there is nothing to join, instead of 2.
    pub status_unjoined: Option<u8>,
    /// Opens where it measures to only after it has said Ready.
    pub opens_late: bool,
    /// Rings no bell.
    pub rings_no_bell: bool,
    /// Looks for messages only when a bell has rung.
    pub waits_for_the_bell: bool,
    /// Ends when it has said Bye.
    pub goes_at_bye: bool,
    /// Does not look whether the coupler lives.
    pub never_looks_up: bool,
    /// Does not look whether the coupler lives between a grant and the report.
    pub never_looks_up_in_a_step: bool,
    /// Removes the run's lock when it ends.
    pub removes_the_lock: bool,
    /// Waits for the next grant for ever.
    pub waits_for_ever: bool,
    /// Ends on Ctrl-C.
    pub ends_on_interrupt: bool,
}

impl Flaw {
    /// None: a relay that changes nothing.
    pub fn none() -> Self {
        Self {
            inbound: Box::new(|message| vec![message]),
            outbound: Box::new(|message| vec![message]),
            manners: Manners::default(),
        }
    }

    /// Spoils what comes in.
    pub fn inbound(pass: impl FnMut(Message) -> Vec<Message> + 'static) -> Self {
        Self {
            inbound: Box::new(pass),
            ..Self::none()
        }
    }

    /// Spoils what goes out.
    pub fn outbound(pass: impl FnMut(Message) -> Vec<Message> + 'static) -> Self {
        Self {
            outbound: Box::new(pass),
            ..Self::none()
        }
    }

    /// Spoils what passes, whichever way: a kind of message goes one way only.
    pub fn passing(pass: impl FnMut(Message) -> Vec<Message> + 'static) -> Self {
        let pass = Rc::new(RefCell::new(pass));
        let other = Rc::clone(&pass);
        Self {
            inbound: Box::new(move |message| pass.borrow_mut()(message)),
            outbound: Box::new(move |message| other.borrow_mut()(message)),
            manners: Manners::default(),
        }
    }

    /// Spoils each message that passes.
    pub fn each(mut spoil: impl FnMut(&mut Message) + 'static) -> Self {
        Self::passing(move |mut message| {
            spoil(&mut message);
            vec![message]
        })
    }

    /// Behaves badly.
    pub fn manners(spoil: impl FnOnce(&mut Manners)) -> Self {
        let mut flaw = Self::none();
        spoil(&mut flaw.manners);
        flaw
    }

    /// This one, and then another one.
    #[must_use]
    pub fn with(self, other: Self) -> Self {
        let then = |mut first: Pass, mut second: Pass| -> Pass {
            Box::new(move |message| first(message).into_iter().flat_map(&mut second).collect())
        };
        Self {
            inbound: then(self.inbound, other.inbound),
            outbound: then(self.outbound, other.outbound),
            manners: if other.manners == Manners::default() {
                self.manners
            } else {
                other.manners
            },
        }
    }

    /// Spoils notices.
    pub fn notices(mut spoil: impl FnMut(&mut Notice) + 'static) -> Self {
        Self::outbound(move |message| match message.as_notice() {
            Ok(mut notice) => {
                spoil(&mut notice);
                vec![Message::notice(message.header.step, &notice)]
            }
            Err(_) => vec![message],
        })
    }

    /// Spoils the Configure that the solver gets to see.
    pub fn configure(mut spoil: impl FnMut(&mut Configure) + 'static) -> Self {
        Self::inbound(move |message| match message.as_order() {
            Ok(Order::Configure(mut configure)) => {
                spoil(&mut configure);
                vec![Message::order(&Order::Configure(configure))]
            }
            _ => vec![message],
        })
    }

    /// Spoils a configuration, where it parses; one that is left as it was keeps its bytes.
    pub fn config<C: Clone + PartialEq + Serialize + DeserializeOwned>(
        mut spoil: impl FnMut(&mut C) + 'static,
    ) -> Self {
        Self::configure(move |configure| {
            if let Ok(config) = serde_json::from_str::<C>(&configure.config) {
                let mut spoilt = config.clone();
                spoil(&mut spoilt);
                if spoilt != config {
                    configure.config = serde_json::to_string(&spoilt).expect("it was JSON before");
                }
            }
        })
    }

    /// Spoils the bodies' configuration, where it parses.
    pub fn bodies_config(spoil: impl FnMut(&mut DemConfig) + 'static) -> Self {
        Self::config(spoil)
    }
}

/// One constructor for each kind of record that can be spoilt.
macro_rules! spoil {
    ($($(#[$doc:meta])* $name:ident: $payload:ident of $record:ty;)*) => {
        impl Flaw {
            $($(#[$doc])*
            pub fn $name(mut spoil: impl FnMut(&mut StepHeader, &mut Vec<$record>) + 'static) -> Self {
                Self::each(move |message| {
                    if let Payload::$payload(records) = &mut message.payload {
                        spoil(&mut message.header, records);
                    }
                })
            })*
        }
    };
}

spoil! {
    /// Spoils grants.
    grants: Grant of Grant;
    /// Spoils sets.
    set: Set of ImpInfo;
    /// Spoils states.
    states: States of ImpState;
    /// Spoils forces.
    forces: Forces of ImpForce;
    /// Spoils outlines.
    envelopes: Envelopes of EnvelopeVertex;
    /// Spoils reports.
    reports: Report of Report;
    /// Spoils the states of bodies.
    bodies: Bodies of BodyState;
    /// Spoils those of groups.
    groups: Groups of GroupState;
    /// Spoils those of all points.
    points: Points of PointState;
}

/// Looks of an idle relay before it sleeps between them.
const LOOKS: u32 = 20;
/// Its sleep.
const NAP: Duration = Duration::from_micros(100);
/// How much later than Ready a mutant opens what it should have opened before.
const LATE: Duration = Duration::from_millis(20);
/// Longest time between two looks whether the coupler lives.
const LIFE: Duration = Duration::from_millis(10);
/// Of how many points on a mutant naps: those of the clause on latency, and of few others.
const MANY: usize = 100;

/// Sleeps for several naps of B-3 where there are many points.
pub fn nap_for_many(points: usize) {
    if points >= MANY {
        std::thread::sleep(Duration::from_millis(60));
    }
}

/// Joins the run of `domain` as the hosted solver with a flaw; returns its exit status.
pub fn relay(medium: Medium, domain: &Domain, host: Host, flaw: Flaw) -> u8 {
    let manners = flaw.manners;
    let served = Relay::open(medium, domain, host, flaw).and_then(Relay::serve);
    if manners.removes_the_lock {
        let _ = std::fs::remove_file(domain.directory().join("lock"));
    }
    match served {
        Ok(true) => manners.status_closed.unwrap_or(0),
        _ => manners.status_failed.unwrap_or(3),
    }
}

#[expect(
    clippy::struct_excessive_bools,
    reason = "each is a moment of the session"
)]
struct Relay {
    seat: Seat,
    stage: Stage,
    hosted: std::thread::JoinHandle<Result<(), SessionError>>,
    flaw: Flaw,
    coupled: bool,
    /// Between a grant and the report on it.
    in_step: bool,
    /// Bye has been said.
    said_bye: bool,
    /// It waits for ever.
    stuck: bool,
}

impl Relay {
    fn open(medium: Medium, domain: &Domain, host: Host, flaw: Flaw) -> Result<Self, ChannelError> {
        let seat = Seat::join(medium, domain, host.party)?;
        let stage = Stage::open(Medium::Threads, host.party)?;
        let inner = stage.domain().clone();
        let hosted = std::thread::spawn(move || (host.solve)(&inner));
        Ok(Self {
            seat,
            stage,
            hosted,
            flaw,
            coupled: false,
            in_step: false,
            said_bye: false,
            stuck: false,
        })
    }

    /// Passes messages until either side is gone; returns whether the hosted solver ended in order.
    fn serve(mut self) -> Result<bool, ChannelError> {
        let mut idle = 0;
        let mut looked = Instant::now();
        loop {
            // The end is looked for first: what was sent before it is passed on after.
            let ended = self.hosted.is_finished();
            let mut passed = self.pass_out()?;
            if ended && !self.stuck {
                return Ok(matches!(self.hosted.join(), Ok(Ok(()))));
            }
            let manners = self.flaw.manners;
            if manners.goes_at_bye && self.said_bye {
                self.dismiss();
                return Ok(true);
            }
            if !manners.waits_for_the_bell || self.rung() {
                passed |= self.pass_in()?;
            }
            idle = if passed { 0 } else { idle + 1 };
            if idle > LOOKS {
                std::thread::sleep(NAP);
            } else {
                std::thread::yield_now();
            }
            let looks_away =
                manners.never_looks_up || (manners.never_looks_up_in_a_step && self.in_step);
            if !looks_away && looked.elapsed() > LIFE {
                looked = Instant::now();
                if !self.seat.coupler_lives() {
                    self.dismiss();
                    return Ok(false);
                }
            }
        }
    }

    /// Ends the hosted solver, which sees that its coupler is gone.
    fn dismiss(self) {
        self.stage.release();
        let _ = self.hosted.join();
    }

    fn rung(&self) -> bool {
        let bells = [Kind::Order, Kind::States, Kind::Forces];
        bells
            .iter()
            .any(|&kind| self.seat.sleep(kind, Duration::ZERO) > 0)
    }

    /// From coupler and peer to the hosted solver.
    fn pass_in(&mut self) -> Result<bool, ChannelError> {
        // Late ones first: what was sent before them is then there, and passed on before them.
        let late_first = [
            Kind::States,
            Kind::Set,
            Kind::Forces,
            Kind::Envelopes,
            Kind::Grant,
            Kind::Restore,
            Kind::Order,
        ];
        let mut taken = Vec::new();
        for kind in late_first {
            taken.extend(self.seat.receive(kind)?);
        }
        let passed = !taken.is_empty();
        for message in taken.into_iter().rev() {
            if let Ok(Order::Configure(configure)) = message.as_order() {
                self.coupled = configure.coupled;
            }
            self.in_step |= message.kind() == Kind::Grant;
            for message in (self.flaw.inbound)(message) {
                self.stage.send(&message)?;
            }
        }
        Ok(passed)
    }

    /// From the hosted solver to coupler and peer.
    fn pass_out(&mut self) -> Result<bool, ChannelError> {
        let late_first = [
            Kind::Notice,
            Kind::Report,
            Kind::Saved,
            Kind::Points,
            Kind::Groups,
            Kind::Bodies,
            Kind::Forces,
            Kind::Envelopes,
            Kind::States,
            Kind::Set,
        ];
        let mut taken = Vec::new();
        for kind in late_first {
            let mut of_kind: Vec<_> = self.stage.receive(kind)?.into_iter().collect();
            // A saved state is several messages, all of them before the report.
            while kind == Kind::Saved
                && let Some(piece) = self.stage.receive(kind)?
            {
                of_kind.push(piece);
            }
            taken.extend(of_kind.into_iter().rev());
        }
        let passed = !taken.is_empty();
        for message in taken.into_iter().rev() {
            let notice = message.as_notice();
            let ready = matches!(notice, Ok(Notice::Ready(_)));
            if self.flaw.manners.waits_for_ever
                && let Ok(Notice::Failed(failure)) = &notice
                && failure.message.contains("the next grant")
            {
                self.stuck = true;
                continue;
            }
            self.said_bye |= matches!(notice, Ok(Notice::Bye));
            self.in_step &= message.kind() != Kind::Report;
            if ready && self.coupled {
                self.seat.open_exchange()?;
            }
            if ready && !self.flaw.manners.opens_late {
                self.seat.open_measurement()?;
            }
            for message in (self.flaw.outbound)(message) {
                if self.flaw.manners.rings_no_bell {
                    self.seat.send_silently(&message)?;
                } else {
                    self.seat.send(&message)?;
                }
            }
            if ready && self.flaw.manners.opens_late {
                std::thread::sleep(LATE);
                self.seat.open_measurement()?;
            }
        }
        Ok(passed)
    }
}
