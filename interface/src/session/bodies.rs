//! The bodies' side of a window: the order of PROTOCOL.md section 5 as its receiver of states and sender of forces.

use super::check;
use super::connection::Connection;
use super::error::{SessionError, broken};
use super::solver::Side;
use crate::config::capability::{CONTACTS, Capabilities};
use crate::config::{DemConfig, Interface};
use crate::message::control::{Configure, Party};
use crate::message::wire::{ContactState, ImpForce, ImpState, Ledger, StepHeader, flags};
use crate::message::{Channel, Kind, Payload, Records};
use crate::solver::{DemSolver, Fault, Readiness, Refusal};

/// Bodies in a session.
pub(super) struct Bodies<'a> {
    solver: &'a mut dyn DemSolver,
    /// Whether the links of the set are used (W-2).
    links: bool,
    /// Where messages arrive, so that memory is reused.
    states: Payload,
    set: Payload,
    forces: Vec<ImpForce>,
    /// The contacts in the first step of the window, if a frame is asked for.
    contacts: Vec<ContactState>,
    lists_contacts: bool,
}

impl<'a> Bodies<'a> {
    pub fn new(solver: &'a mut dyn DemSolver) -> Self {
        Self {
            lists_contacts: solver.capabilities().has(CONTACTS),
            solver,
            links: false,
            states: Payload::empty(Kind::States),
            set: Payload::empty(Kind::Set),
            forces: Vec::new(),
            contacts: Vec::new(),
        }
    }

    /// I-1 to I-5: waits for the states of the points, and answers what the continuum asks for before it. `None` if it
    /// halts.
    async fn receive_states(
        &mut self,
        to: &mut Connection<'_>,
    ) -> Result<Option<StepHeader>, SessionError> {
        let mut header = self.next_states(to).await?;
        if header.flags & flags::WANT_ENVELOPES != 0 {
            self.send_envelopes(to).await?;
            header = self.next_states(to).await?;
            if header.flags & flags::WANT_ENVELOPES != 0 {
                let message = "the envelopes are asked for twice".into();
                return Err(broken(Party::Mpm, "G-9", to.step(), message));
            }
        }
        if header.flags & flags::HALT_BEFORE != 0 {
            return Ok(None);
        }
        check::numbers(Party::Mpm, "I-3", to.step(), self.states.records())?;
        if header.flags & flags::NEW_SET != 0 {
            self.receive_set(to, &header)?;
        }
        let (sent, set, imps) = (self.states.len() as u64, to.set, to.imps);
        if header.set != set || sent != imps || header.count != imps {
            let message = format!(
                "{sent} states for set {}, expected {imps} for set {set}",
                header.set
            );
            return Err(broken(Party::Mpm, "I-3", to.step(), message));
        }
        Ok(Some(header))
    }

    /// I-1, I-4, I-5.
    async fn next_states(&mut self, to: &Connection<'_>) -> Result<StepHeader, SessionError> {
        let channel = Channel::of(Party::Mpm, Kind::States);
        let header = to
            .receive_in_step(channel, &mut self.states, "the states of the points")
            .await?;
        let step = to.step();
        if header.step != step || header.epoch != to.grant.epoch {
            let message = format!("states of step {} epoch {}", header.step, header.epoch);
            return Err(broken(Party::Mpm, "I-1", step, message));
        }
        for (flag, clause) in [(flags::HALT_BEFORE, "I-4"), (flags::WANT_ENVELOPES, "I-5")] {
            if header.flags & flag != 0 && !self.states.is_empty() {
                let message = format!("{} states where none follow", self.states.len());
                return Err(broken(Party::Mpm, clause, step, message));
            }
        }
        Ok(header)
    }

    /// E-1, E-3.
    async fn send_envelopes(&mut self, to: &Connection<'_>) -> Result<(), SessionError> {
        let envelopes = Records::Envelopes(self.solver.envelopes());
        let header = StepHeader {
            set: 0,
            ..to.header(0, envelopes.len())
        };
        to.send_under(&header, envelopes).await
    }

    /// I-2, I-8: takes the set that `states` announce, which was sent before them.
    fn receive_set(
        &mut self,
        to: &mut Connection<'_>,
        states: &StepHeader,
    ) -> Result<(), SessionError> {
        let (step, channel) = (to.step(), Channel::of(Party::Mpm, Kind::Set));
        let complain = |message| Err(broken(Party::Mpm, "I-2", step, message));
        let Some(header) = to.io().receive(channel, &mut self.set)? else {
            return complain(format!(
                "nothing on {} although the states announce a set",
                channel.name()
            ));
        };
        let next = to.set + 1;
        if header.set != states.set
            || header.set != next
            || !check::counted(&header, self.set.records())
        {
            return complain(format!(
                "set {} of {} announced for states of set {}, {next} is next",
                header.set, header.count, states.set
            ));
        }
        let Payload::Set(set) = &self.set else {
            unreachable!("a channel of sets has sets")
        };
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

fn states(payload: &Payload) -> &[ImpState] {
    match payload {
        Payload::States(states) => states,
        _ => &[],
    }
}

impl Side for Bodies<'_> {
    async fn steps(&mut self, to: &mut Connection<'_>) -> Result<(), SessionError> {
        // L-4, H-2, H-4: the forces of the last step had HALT_AFTER.
        while !to.is_window_done() && to.may_go_on() {
            if to.coupled && self.receive_states(to).await?.is_none() {
                return Ok(());
            }
            // Forces must not accumulate from one step to the next (F-8).
            self.forces.clear();
            let states = if to.coupled {
                states(&self.states)
            } else {
                &[]
            };
            self.forces.resize(states.len(), ImpForce::default());
            let step = to.present();
            let answered = self.solver.contact(&step, states, &mut self.forces);
            let answer = answered.map_err(|f| to.fault(f))?;
            check::number(Party::Dem, "L-1", step.index, &answer.limits)?;
            if self.lists_contacts && to.is_first() && to.grant.flags & flags::FRAME != 0 {
                self.contacts = self.solver.contacts(&step, states);
            }
            if to.coupled {
                let halt = if to.grant.allows(&answer.limits) {
                    0
                } else {
                    flags::HALT_AFTER
                };
                let header = StepHeader {
                    travel: answer.travel,
                    ..to.header(halt, self.forces.len())
                };
                to.send_under(&header, Records::Forces(&self.forces))
                    .await?;
            }
            self.solver.advance(&step).map_err(|f| to.fault(f))?;
            to.advanced(answer.limits)?;
        }
        Ok(())
    }

    fn identity(&self) -> String {
        self.solver.identity()
    }

    fn capabilities(&self) -> Capabilities {
        self.solver.capabilities()
    }

    fn configure(
        &mut self,
        configure: &Configure,
    ) -> Result<Result<Readiness, Refusal>, serde_json::Error> {
        let config: DemConfig = serde_json::from_str(&configure.config)?;
        self.links = config.interface == Interface::Segments;
        Ok(self.solver.configure(&config))
    }

    fn restore(&mut self, saved: &[u8], _: [f64; 2]) -> Result<(), Refusal> {
        self.solver.restore(saved)
    }

    fn save(&self) -> Result<(Vec<u8>, [f64; 2]), Fault> {
        Ok((self.solver.save()?, [0.0; 2]))
    }

    fn measurement(&self) -> (&Ledger, Records<'_>) {
        let measurement = self.solver.measurement();
        (&measurement.ledger, Records::Bodies(&measurement.bodies))
    }

    fn contacts(&self) -> Option<&[ContactState]> {
        self.lists_contacts.then_some(&self.contacts)
    }
}
