//! The coupler's end of a session.

use std::time::Duration;

use iceoryx2::prelude::Service;

use super::desk::{broken, check};
use super::{PATIENCE_WITH_WAITERS, SessionError};
use crate::channel::{BODIES, Bell, GROUPS, Inlet, Made, Outlet, POINTS, Post, Rope, Seat, seat};
use crate::codec::{decode, encode};
use crate::control::{Configure, Hello, Notice, Order, PROTOCOL, Party};
use crate::domain::OwnedDomain;
use crate::recording::{Tap, Tape};
use crate::solver::Readiness;
use crate::wait::{Patience, wait};
use crate::wire::{BodyState, Grant, GroupState, PointState, Record, Report, StepHeader};

/// Asked during every long wait: whether a process has ended.
pub type Alarm<'a> = &'a mut dyn FnMut() -> Result<(), SessionError>;

/// Longest wait for a solver to come and say hello.
const ARRIVAL: Duration = Duration::from_secs(30);
/// Longest wait for a solver to take its configuration: it may fill millions of points.
const CONFIGURATION: Duration = Duration::from_mins(2);

/// A session with one or two solvers. Dropping it removes the run's corner of the machine.
pub struct Session<S: Service> {
    /// Before the ports: what is in the channels between the solvers is still recorded when the session is dropped.
    tap: Option<Tap>,
    tape: Option<Tape>,
    lines: Vec<Line<S>>,
    groups: Option<Inlet<S, GroupState>>,
    points: Option<Inlet<S, PointState>>,
    bodies: Option<Inlet<S, BodyState>>,
    /// A channel exists for as long as somebody holds it.
    _made: Vec<Made>,
    _post: Post<S>,
    // Last, so that the ports are gone before the directory is.
    domain: OwnedDomain,
}

/// The coupler's end of the line to one solver.
struct Line<S: Service> {
    party: Party,
    orders: Outlet<S, u8>,
    notices: Inlet<S, u8>,
    grants: Outlet<S, Grant>,
    reports: Inlet<S, Report>,
    rope: Rope<S>,
    bell: Bell<S>,
    deadline: Duration,
    /// First step not yet reported.
    step: u64,
}

impl<S: Service + 'static> Session<S> {
    /// Creates every channel for the given solvers.
    ///
    /// # Errors
    /// [`SessionError::Channel`].
    pub fn open(parties: &[Party]) -> Result<Self, SessionError> {
        Self::open_recorded(parties, None)
    }

    /// The same; everything that crosses is noted on the tape.
    ///
    /// # Errors
    /// [`SessionError::Channel`], [`SessionError::Recording`].
    pub fn open_recorded(parties: &[Party], tape: Option<Tape>) -> Result<Self, SessionError> {
        let domain = OwnedDomain::create().map_err(crate::channel::ChannelError::from)?;
        let mut post = Post::<S>::open(domain.domain(), Party::Coupler)?;
        if let Some(tape) = &tape {
            post = post.recording(tape.clone());
        }
        let made = post.create_all(parties)?;
        let lines: Result<_, _> = parties
            .iter()
            .map(|&p| Line::open(&post, seat(p)))
            .collect();
        let (mpm, dem) = (parties.contains(&Party::Mpm), parties.contains(&Party::Dem));
        let tap = match &tape {
            Some(tape) if mpm && dem => Some(Tap::open::<S>(domain.domain(), tape.clone())?),
            _ => None,
        };
        Ok(Self {
            tap,
            tape,
            lines: lines?,
            groups: mpm.then(|| post.inlet(&GROUPS)).transpose()?,
            points: mpm.then(|| post.inlet(&POINTS)).transpose()?,
            bodies: dem.then(|| post.inlet(&BODIES)).transpose()?,
            _made: made,
            _post: post,
            domain,
        })
    }

    /// The run's id, by which solvers join.
    pub fn run_id(&self) -> &str {
        self.domain.domain().id()
    }

    /// The run's names.
    pub fn domain(&self) -> &crate::domain::Domain {
        self.domain.domain()
    }

    /// Waits for a solver's first words and checks its version.
    ///
    /// # Errors
    /// Any [`SessionError`]; [`SessionError::Contract`] for another major version.
    pub fn hello(&mut self, party: Party, alarm: Alarm) -> Result<Hello, SessionError> {
        let notice = self.await_notice(party, ARRIVAL, "its hello", alarm)?;
        let Notice::Hello(hello) = notice else {
            return Err(broken(party, "S-2", 0, format!("{notice:?} before hello")));
        };
        if hello.party != party {
            return Err(broken(
                party,
                "S-2",
                0,
                format!(
                    "what was started as the {party} is `{}`, which says that it is the {}: it may be given by `--{}` \
                     only",
                    hello.identity, hello.party, hello.party
                ),
            ));
        }
        let ((theirs, _), (ours, _)) = (hello.protocol, PROTOCOL);
        if theirs != ours {
            let message = format!(
                "`{}` speaks protocol {theirs}, this coupler speaks {ours}",
                hello.identity
            );
            return Err(broken(party, "V-1", 0, message));
        }
        Ok(hello)
    }

    /// Hands a solver its part of the scene.
    ///
    /// # Errors
    /// [`SessionError::Channel`].
    pub fn configure(&mut self, party: Party, configure: &Configure) -> Result<(), SessionError> {
        let line = self.line(party);
        // A solver waits for the other one.
        line.deadline = Duration::from_secs_f64(configure.deadline) + PATIENCE_WITH_WAITERS;
        line.order(&Order::Configure(configure.clone()))
    }

    /// Waits for a solver to be ready.
    ///
    /// # Errors
    /// Any [`SessionError`]; [`SessionError::Refused`] when it does not take its part.
    pub fn ready(
        &mut self,
        party: Party,
        scene_hash: &str,
        alarm: Alarm,
    ) -> Result<Readiness, SessionError> {
        match self.await_notice(party, CONFIGURATION, "that it is ready", alarm)? {
            Notice::Ready(ready) if ready.scene_hash == scene_hash => Ok(ready.readiness),
            Notice::Ready(ready) => {
                let message = format!(
                    "ready for scene {}, the coupler's is {scene_hash}",
                    ready.scene_hash
                );
                Err(broken(party, "S-6", 0, message))
            }
            Notice::Refused(refusal) => Err(SessionError::Refused {
                who: party,
                refusal,
            }),
            other => Err(broken(
                party,
                "S-2",
                0,
                format!("{other:?} instead of ready"),
            )),
        }
    }

    /// Permits steps.
    ///
    /// # Errors
    /// [`SessionError::Channel`]; [`SessionError::Recording`] when the last ones could not be recorded.
    pub fn grant(&mut self, party: Party, grant: &Grant) -> Result<(), SessionError> {
        if let Some(error) = self.tape.as_ref().and_then(Tape::failure) {
            return Err(error.into());
        }
        let line = self.line(party);
        check(Party::Coupler, "G-2", grant.first, &[*grant])?;
        let header = StepHeader {
            epoch: grant.epoch,
            step: grant.first,
            ..StepHeader::default()
        };
        line.grants.send(header, &[*grant])?;
        line.rope.ring();
        Ok(())
    }

    /// Waits for a solver's report on `grant`.
    ///
    /// # Errors
    /// Any [`SessionError`].
    pub fn report(
        &mut self,
        party: Party,
        grant: &Grant,
        alarm: Alarm,
    ) -> Result<Report, SessionError> {
        let mut reports = Vec::new();
        let line = self
            .lines
            .iter()
            .find(|line| line.party == party)
            .expect("a party of this session");
        let step = line.step;
        wait(
            Patience::until(line.deadline),
            || Ok(line.reports.receive(&mut reports)?),
            |nap| line.bell.sleep(nap),
            || self.notice_failures().and_then(|()| alarm()),
            |waited| SessionError::Late {
                who: party,
                awaited: "its report",
                step,
                waited,
            },
        )?;
        let [report] = reports[..] else {
            return Err(broken(
                party,
                "R-1",
                step,
                format!("{} reports in one message", reports.len()),
            ));
        };
        check(party, "R-2", step, &[report])?;
        let last = grant.first + grant.steps;
        let whole = report.next == last
            || (report.halted == 1 && report.next > grant.first && report.next < last);
        if report.epoch != grant.epoch || !whole {
            let message = format!(
                "report of epoch {} up to step {}, granted {grant:?}",
                report.epoch, report.next
            );
            return Err(broken(party, "R-1", step, message));
        }
        self.line(party).step = report.next;
        Ok(report)
    }

    /// The point groups of the measured step of the last grant.
    ///
    /// # Errors
    /// [`SessionError::Contract`] when they were not sent before the report.
    pub fn groups(&mut self, step: u64, groups: &mut Vec<GroupState>) -> Result<(), SessionError> {
        sent_before_report(self.groups.as_ref(), (Party::Mpm, "R-3"), step, groups)
    }

    /// The bodies of the measured step of the last grant.
    ///
    /// # Errors
    /// [`SessionError::Contract`] when they were not sent before the report.
    pub fn bodies(&mut self, step: u64, bodies: &mut Vec<BodyState>) -> Result<(), SessionError> {
        sent_before_report(self.bodies.as_ref(), (Party::Dem, "R-3"), step, bodies)
    }

    /// All points as they were before the first step of the last grant, if it asked for them ([`flags::FRAME`]).
    ///
    /// # Errors
    /// [`SessionError::Contract`] when they were not sent before the report.
    ///
    /// [`flags::FRAME`]: crate::wire::flags::FRAME
    pub fn points(&mut self, step: u64, points: &mut Vec<PointState>) -> Result<(), SessionError> {
        sent_before_report(self.points.as_ref(), (Party::Mpm, "R-5"), step, points)
    }

    /// Ends the session in order: returns all points, in order of their ids.
    ///
    /// # Errors
    /// Any [`SessionError`].
    pub fn drain(&mut self, alarm: Alarm) -> Result<Vec<PointState>, SessionError> {
        let parties: Vec<Party> = self.lines.iter().map(|line| line.party).collect();
        for &party in &parties {
            self.line(party).order(&Order::Drain)?;
        }
        for &party in &parties {
            match self.await_notice(party, CONFIGURATION, "its goodbye", alarm)? {
                Notice::Bye => {}
                other => {
                    return Err(broken(
                        party,
                        "S-2",
                        self.line(party).step,
                        format!("{other:?} while draining"),
                    ));
                }
            }
        }
        // As for the coupler (D-2): what has been sent may be lost when its sender ends.
        self.tap = None;
        let mut points = Vec::new();
        if let Some(inlet) = &self.points {
            let step = self
                .lines
                .iter()
                .find(|line| line.party == Party::Mpm)
                .map_or(0, |line| line.step);
            if inlet.receive(&mut points)?.is_none() {
                return Err(broken(
                    Party::Mpm,
                    "D-1",
                    step,
                    "no final state before the goodbye".into(),
                ));
            }
            check(Party::Mpm, "D-1", step, &points)?;
        }
        for &party in &parties {
            self.line(party).order(&Order::Close)?;
        }
        Ok(points)
    }

    /// Tells every solver that the session is over. What cannot be delivered is not worth an error any more.
    pub fn abort(&mut self, reason: &str) {
        self.tap = None;
        for line in &self.lines {
            if let Err(e) = line.order(&Order::Abort(reason.to_string())) {
                tracing::debug!("the {} could not be told: {e}", line.party);
            }
        }
        // One that had not yet opened its channels has missed the order (S-7); it looks whether the coupler lives.
        self.domain.release();
    }

    /// First step that `party` has not reported.
    pub fn step_of(&self, party: Party) -> u64 {
        self.lines
            .iter()
            .find(|line| line.party == party)
            .map_or(0, |line| line.step)
    }

    /// Whether a solver has said why it stopped: read before its process's end is judged.
    ///
    /// # Errors
    /// [`SessionError::Failed`] when one has.
    pub fn notice_failures(&self) -> Result<(), SessionError> {
        let mut bytes = Vec::new();
        for line in &self.lines {
            if let Some(notice) = line.take_notice(&mut bytes)? {
                return Err(match notice {
                    Notice::Failed(failure) => SessionError::Failed {
                        who: line.party,
                        failure,
                    },
                    other => broken(
                        line.party,
                        "S-2",
                        line.step,
                        format!("{other:?} out of turn"),
                    ),
                });
            }
        }
        Ok(())
    }

    fn line(&mut self, party: Party) -> &mut Line<S> {
        self.lines
            .iter_mut()
            .find(|line| line.party == party)
            .expect("a party of this session")
    }

    fn await_notice(
        &mut self,
        party: Party,
        deadline: Duration,
        awaited: &'static str,
        alarm: Alarm,
    ) -> Result<Notice, SessionError> {
        let line = self.line(party);
        let mut bytes = Vec::new();
        let step = line.step;
        let notice = wait(
            Patience::until(deadline),
            || line.take_notice(&mut bytes),
            |nap| line.bell.sleep(nap),
            alarm,
            |waited| SessionError::Late {
                who: party,
                awaited,
                step,
                waited,
            },
        );
        match notice {
            Ok(Notice::Failed(failure)) => Err(SessionError::Failed {
                who: party,
                failure,
            }),
            // Whoever has gone may have said why, on a line that nobody was listening to.
            Err(vanished @ SessionError::Vanished { who, .. }) => {
                Err(self.last_words(who)?.unwrap_or(vanished))
            }
            notice => notice,
        }
    }

    /// Why a party went, if it has said so.
    fn last_words(&mut self, who: Party) -> Result<Option<SessionError>, SessionError> {
        let line = self.line(who);
        let mut bytes = Vec::new();
        while let Some(notice) = line.take_notice(&mut bytes)? {
            match notice {
                Notice::Failed(failure) => return Ok(Some(SessionError::Failed { who, failure })),
                Notice::Refused(refusal) => {
                    return Ok(Some(SessionError::Refused { who, refusal }));
                }
                _ => {}
            }
        }
        Ok(None)
    }
}

impl<S: Service + 'static> Line<S> {
    fn open(post: &Post<S>, seat: &Seat) -> Result<Self, SessionError> {
        Ok(Self {
            party: seat.party,
            orders: post.outlet(&seat.orders)?,
            notices: post.inlet(&seat.notices)?,
            grants: post.outlet(&seat.grants)?,
            reports: post.inlet(&seat.reports)?,
            rope: post.rope(Party::Coupler, seat.party)?,
            bell: post.bell(seat.party, Party::Coupler)?,
            deadline: CONFIGURATION,
            step: 0,
        })
    }

    fn order(&self, order: &Order) -> Result<(), SessionError> {
        self.orders.send(StepHeader::default(), &encode(order))?;
        self.rope.ring();
        Ok(())
    }

    fn take_notice(&self, bytes: &mut Vec<u8>) -> Result<Option<Notice>, SessionError> {
        if self.notices.receive(bytes)?.is_none() {
            return Ok(None);
        }
        decode(bytes)
            .map(Some)
            .map_err(|e| broken(self.party, "S-1", self.step, e.to_string()))
    }
}

fn sent_before_report<S: Service, T: Record>(
    inlet: Option<&Inlet<S, T>>,
    (party, clause): (Party, &'static str),
    step: u64,
    records: &mut Vec<T>,
) -> Result<(), SessionError> {
    let Some(inlet) = inlet else {
        records.clear();
        return Ok(());
    };
    match inlet.receive(records)? {
        Some(header) if header.step == step => check(party, clause, step, records),
        Some(header) => Err(broken(
            party,
            clause,
            step,
            format!("{} of step {}", inlet.name(), header.step),
        )),
        None => Err(broken(
            party,
            clause,
            step,
            format!("nothing on {} before the report", inlet.name()),
        )),
    }
}
