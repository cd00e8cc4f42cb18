//! The bodies' side of a window: the order of PROTOCOL.md section 5 as its receiver of states and sender of forces.

use super::check;
use super::connection::Connection;
use super::error::{SessionError, broken};
use super::follow::{Follower, State};
use super::solver::Side;
use crate::config::capability::CONTACTS;
use crate::config::{DemConfig, Interface, from_json};
use crate::forces::{Forces, Points};
use crate::message::control::{Configure, Party};
use crate::message::wire::{ContactState, Ledger, StepHeader, flags, records_of};
use crate::message::{Channel, Kind, Message, Payload, Records};
use crate::saved::{pack, unpack};
use crate::solver::{DemSolver, Fault, Readiness, Refusal};
use crate::step::Step;

/// Marks the driver's own part of a saved state.
const DRIVER: &str = "driver of bodies 2";

/// Bodies in a session.
pub(super) struct Bodies {
    solver: Box<dyn DemSolver>,
    /// Whether the links of the set are used (W-2).
    links: bool,
    /// Where messages arrive, so that memory is reused.
    states: Message,
    set: Message,
    forces: Forces,
    /// For a solver that does not measure itself, or that wants the loads of its bodies.
    follower: Option<Follower>,
    /// The contacts in the first step of the window, if a frame is asked for.
    contacts: Vec<ContactState>,
    lists_contacts: bool,
}

impl Bodies {
    pub fn new(solver: Box<dyn DemSolver>) -> Self {
        Self {
            lists_contacts: solver.capabilities().has(CONTACTS),
            solver,
            links: false,
            states: Message::empty(Kind::States),
            set: Message::empty(Kind::Set),
            forces: Forces::default(),
            follower: None,
            contacts: Vec::new(),
        }
    }

    /// Follows the bodies of a solver that does not measure itself.
    fn follow(&mut self, config: &DemConfig) -> Result<(), Refusal> {
        let bodies = self.solver.bodies();
        if bodies.is_empty() && self.solver.measurement().is_some() {
            return Ok(());
        }
        let mut follower = Follower::new(config, bodies)?;
        follower.publish(self.solver.envelopes());
        self.follower = Some(follower);
        Ok(())
    }

    /// I-1 to I-5: waits for the states of the points, and answers what the continuum asks for before it. Returns whether
    /// there are any: there are none if the continuum halts.
    async fn receive_states(&mut self, to: &mut Connection) -> Result<bool, SessionError> {
        self.next_states(to).await?;
        if self.states_have(flags::WANT_ENVELOPES) {
            self.send_envelopes(to).await?;
            self.next_states(to).await?;
            if self.states_have(flags::WANT_ENVELOPES) {
                let message = "the envelopes are asked for twice".into();
                return Err(broken(Party::Mpm, "G-9", to.step(), message));
            }
        }
        if self.states_have(flags::HALT_BEFORE) {
            return Ok(false);
        }
        let records = self.states.payload.records();
        check::numbers(Party::Mpm, "I-3", to.step(), records)?;
        if self.states_have(flags::NEW_SET) {
            self.receive_set(to)?;
        }
        let Message { header, payload } = &self.states;
        let expected = (to.set, to.imps);
        match check::not_of_set("states", header, payload.len(), expected) {
            Some(message) => Err(broken(Party::Mpm, "I-3", to.step(), message)),
            None => Ok(true),
        }
    }

    /// Whether the header of the states has this flag.
    fn states_have(&self, flag: u64) -> bool {
        self.states.header.flags & flag != 0
    }

    /// I-1, I-4, I-5.
    async fn next_states(&mut self, to: &Connection) -> Result<(), SessionError> {
        let channel = Channel::of(Party::Mpm, Kind::States);
        let awaited = "the states of the points (I-1)";
        to.receive(channel, &mut self.states, awaited, to.deadline)
            .await?;
        let (step, Message { header, payload }) = (to.step(), &self.states);
        if header.step != step || header.epoch != to.grant.epoch {
            let message = format!("states of step {} epoch {}", header.step, header.epoch);
            return Err(broken(Party::Mpm, "I-1", step, message));
        }
        for (flag, clause) in [(flags::HALT_BEFORE, "I-4"), (flags::WANT_ENVELOPES, "I-5")] {
            if self.states_have(flag) && !payload.is_empty() {
                let message = format!("{} states where none follow", payload.len());
                return Err(broken(Party::Mpm, clause, step, message));
            }
        }
        Ok(())
    }

    /// E-1, E-3.
    async fn send_envelopes(&mut self, to: &Connection) -> Result<(), SessionError> {
        let envelopes = self.solver.envelopes();
        if let Some(follower) = &mut self.follower {
            follower.publish(envelopes);
        }
        let envelopes = Records::Envelopes(envelopes);
        let header = StepHeader {
            set: 0,
            ..to.header(0, envelopes.len())
        };
        to.send_under(header, envelopes).await
    }

    /// I-2, I-8: takes the set that `states` announce, which was sent before them.
    fn receive_set(&mut self, to: &mut Connection) -> Result<(), SessionError> {
        let (step, channel) = (to.step(), Channel::of(Party::Mpm, Kind::Set));
        let complain = |message| Err(broken(Party::Mpm, "I-2", step, message));
        if !to.io().receive(channel, &mut self.set)? {
            return complain(format!(
                "nothing on {} although the states announce a set",
                channel.name()
            ));
        }
        let Message { header, payload } = &self.set;
        let (of_states, next) = (self.states.header.set, to.set + 1);
        if header.set != of_states
            || header.set != next
            || !check::counted(header, payload.records())
        {
            return complain(format!(
                "set {} with {} points, {} announced, for states of set {of_states}; {next} is next",
                header.set,
                payload.len(),
                header.count,
            ));
        }
        let set = payload.of();
        check::set(set, step)?;
        if self.links {
            check::links(set, step)?;
        }
        to.set = header.set;
        to.imps = set.len() as u64;
        self.solver.imp_set(set);
        Ok(())
    }
}

/// Moves the bodies and follows what they have done; in an opening step nothing moves.
fn advance(
    solver: &mut dyn DemSolver,
    follower: Option<&mut Follower>,
    step: &Step,
    forces: &Forces,
) -> Result<(), Fault> {
    if !step.is_opening() {
        solver.advance(step)?;
    }
    match follower {
        Some(follower) => follower.moved(step, solver.bodies(), forces),
        None => Ok(()),
    }
}

impl Side for Bodies {
    async fn steps(&mut self, to: &mut Connection) -> Result<(), SessionError> {
        // L-4, H-2, H-4: the forces of the last step had HALT_AFTER.
        while !to.is_window_done() && to.may_go_on() {
            if to.coupled && !self.receive_states(to).await? {
                return Ok(());
            }
            let points = if to.coupled {
                Points {
                    set: self.set.payload.of(),
                    states: self.states.payload.of(),
                }
            } else {
                Points::default()
            };
            let step = to.present();
            let loads = self.follower.iter().flat_map(Follower::loads);
            self.forces.clear(points.states, loads);
            let answered = self.solver.contact(&step, &points, &mut self.forces);
            let mut answer = answered.map_err(|f| to.fault(f))?;
            if self.lists_contacts && to.is_first() && to.grant.flags & flags::FRAME != 0 {
                self.contacts = self.solver.contacts(&step, points.states);
            }
            let measured = answer.travel.is_none();
            let moved = match &mut self.follower {
                Some(follower) if measured => {
                    let moved =
                        advance(&mut *self.solver, Some(&mut *follower), &step, &self.forces);
                    answer.limits = follower.limits(answer.limits, &self.forces);
                    answer.travel = Some(follower.travel());
                    moved.map_err(|f| to.fault(f))
                }
                _ => Ok(()),
            };
            let sound =
                moved.and_then(|()| check::number(Party::Dem, "L-1", step.index, &answer.limits));
            if let Err(error) = sound {
                // Forces that are not finite are the cause of the rest. Where nothing else is wrong, their receiver finds
                // them.
                let forces = Records::Forces(self.forces.on_points());
                check::numbers(Party::Dem, "F-4", step.index, forces)?;
                return Err(error);
            }
            if to.coupled {
                let halt = if to.grant.allows(&answer.limits) {
                    0
                } else {
                    flags::HALT_AFTER
                };
                let header = StepHeader {
                    travel: answer.travel.unwrap_or(f64::INFINITY),
                    ..to.header(halt, points.states.len())
                };
                to.send_under(header, Records::Forces(self.forces.on_points()))
                    .await?;
            }
            if !measured {
                let follower = self.follower.as_mut();
                advance(&mut *self.solver, follower, &step, &self.forces)
                    .map_err(|f| to.fault(f))?;
            }
            to.advanced(answer.limits)?;
        }
        Ok(())
    }

    fn configure(
        &mut self,
        configure: &Configure,
    ) -> Result<Result<Readiness, Refusal>, serde_json::Error> {
        let config: DemConfig = from_json(&configure.config)?;
        self.links = config.interface == Interface::Segments;
        if config.threads == 0 {
            return Ok(Err(Refusal::new("dem.threads", "expected 1 or more")));
        }
        let configured = self.solver.configure(&config);
        Ok(configured.and_then(|readiness| {
            self.follow(&config)?;
            Ok(readiness)
        }))
    }

    fn restore(&mut self, saved: &[u8], driver: &[u8]) -> Result<(), Refusal> {
        self.solver.restore(saved)?;
        let (set, followed): (Vec<u8>, Option<State>) = unpack(DRIVER, driver)?;
        let set = records_of(&set);
        self.set.payload = Payload::Set(set.ok_or_else(|| Refusal::new("restore", "a torn set"))?);
        match (&mut self.follower, followed) {
            (Some(kept), Some(state)) => kept.restore(state, self.solver.bodies()),
            (None, None) => Ok(()),
            _ => Err(Refusal::new("restore", "a state with another ledger")),
        }
    }

    fn save(&self) -> Result<(Vec<u8>, Vec<u8>), Fault> {
        let (set, followed) = (self.set.payload.records(), self.follower.as_ref());
        let driver = (set.bytes(), followed.map(Follower::state));
        Ok((self.solver.save()?, pack(DRIVER, &driver)))
    }

    fn measurement(&self) -> (&Ledger, Records<'_>) {
        let followed = || self.follower.as_ref().map(|follower| &follower.measured);
        match self.solver.measurement().or_else(followed) {
            Some(measured) => (&measured.ledger, Records::Bodies(&measured.bodies)),
            None => unreachable!("a solver that does not measure itself is followed"),
        }
    }

    fn contacts(&self) -> Option<&[ContactState]> {
        self.lists_contacts.then_some(&self.contacts)
    }
}
