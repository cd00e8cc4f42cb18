//! The continuum's side of a window: the order of PROTOCOL.md section 5 as its sender of states and receiver of forces.

use super::approach::{Approach, fastest};
use super::check;
use super::connection::Connection;
use super::error::{SessionError, broken};
use super::solver::Side;
use crate::config::{MpmConfig, from_json};
use crate::message::control::{Configure, Party};
use crate::message::wire::{Ledger, PointState, flags};
use crate::message::{Channel, Kind, Message, Records};
use crate::saved::{pack, unpack};
use crate::solver::{Fault, MpmSolver, Readiness, Refusal};

/// Marks the driver's own part of a saved state.
const DRIVER: &str = "driver of a continuum 1";

/// A continuum in a session.
pub(super) struct Continuum {
    solver: Box<dyn MpmSolver>,
    approach: Approach,
    /// Where messages arrive, so that memory is reused.
    forces: Message,
    envelopes: Message,
}

impl Continuum {
    pub fn new(solver: Box<dyn MpmSolver>) -> Self {
        Self {
            solver,
            approach: Approach::default(),
            forces: Message::empty(Kind::Forces),
            envelopes: Message::empty(Kind::Envelopes),
        }
    }

    /// E-1 to E-3, I-2: chooses a new set of IMPs by the envelopes of the bodies.
    async fn choose_set(&mut self, to: &mut Connection) -> Result<(), SessionError> {
        to.io().mark("new set");
        to.exchange(flags::WANT_ENVELOPES, Records::States(&[]))
            .await?;
        let channel = Channel::of(Party::Mpm, Kind::Envelopes);
        let awaited = "the envelopes of the bodies (E-1)";
        to.receive(channel, &mut self.envelopes, awaited, to.deadline)
            .await?;
        let Message { header, payload } = &self.envelopes;
        let (step, records) = (to.step(), payload.records());
        if header.step != step || header.epoch != to.grant.epoch || !check::counted(header, records)
        {
            let message = format!(
                "envelopes of step {} with {} vertices, {} announced",
                header.step,
                records.len(),
                header.count
            );
            return Err(broken(Party::Dem, "E-2", step, message));
        }
        check::numbers(Party::Dem, "E-3", step, records)?;
        let set = self.solver.select_imps(payload.of());
        self.approach.selected();
        to.imps = set.len() as u64;
        to.set += 1;
        to.exchange(flags::NEW_SET, Records::Set(set)).await
    }

    /// F-2 to F-5: waits for the contact forces.
    async fn receive_forces(&mut self, to: &Connection) -> Result<(), SessionError> {
        let channel = Channel::of(Party::Mpm, Kind::Forces);
        let awaited = "the contact forces (F-1)";
        to.receive(channel, &mut self.forces, awaited, to.deadline)
            .await?;
        let Message { header, payload } = &self.forces;
        let (step, set, imps, forces) = (to.step(), to.set, to.imps, payload.of());
        let complain = |clause, message| Err(broken(Party::Dem, clause, step, message));
        if header.step != step || header.epoch != to.grant.epoch {
            let message = format!("forces of step {} epoch {}", header.step, header.epoch);
            return complain("F-2", message);
        }
        if let Some(message) = check::not_of_set("forces", header, forces.len(), (set, imps)) {
            return complain("F-3", message);
        }
        check::forces(header, forces, step)
    }
}

impl Side for Continuum {
    async fn steps(&mut self, to: &mut Connection) -> Result<(), SessionError> {
        while !to.is_window_done() {
            // L-4, H-1, H-4.
            if !to.may_go_on() {
                if to.coupled {
                    to.exchange(flags::HALT_BEFORE, Records::States(&[]))
                        .await?;
                }
                return Ok(());
            }
            let step = to.present();
            if !to.coupled {
                self.solver.predict(&step).map_err(|f| to.fault(f))?;
                let corrected = self.solver.correct(&step, &[]);
                to.advanced(corrected.map_err(|f| to.fault(f))?)?;
                continue;
            }
            // I-6.
            let new_set = to.set == 0 || self.approach.set_is_old();
            if new_set {
                self.choose_set(to).await?;
            }
            let states = Records::States(self.solver.imp_states());
            to.exchange(if new_set { flags::NEW_SET } else { 0 }, states)
                .await?;
            self.solver.predict(&step).map_err(|f| to.fault(f))?;
            self.receive_forces(to).await?;
            let Message { header, payload } = &self.forces;
            self.approach.bodies = header.travel;
            let corrected = self.solver.correct(&step, payload.of());
            let limits = corrected.map_err(|f| to.fault(f))?;
            to.advanced(self.approach.moved(limits, self.solver.travel(), step.dt))?;
            if header.flags & flags::HALT_AFTER != 0 {
                return Ok(());
            }
        }
        Ok(())
    }

    fn configure(
        &mut self,
        configure: &Configure,
    ) -> Result<Result<Readiness, Refusal>, serde_json::Error> {
        let config: MpmConfig = from_json(&configure.config)?;
        self.approach = Approach::new(&config);
        let configured = self.solver.configure(&config);
        if configure.coupled && configured.is_ok() {
            self.approach.fastest = fastest(&self.solver.points());
        }
        Ok(configured)
    }

    fn restore(&mut self, saved: &[u8], driver: &[u8]) -> Result<(), Refusal> {
        self.solver.restore(saved)?;
        self.approach.points = self.solver.travel();
        [self.approach.bodies, self.approach.fastest] = unpack(DRIVER, driver)?;
        Ok(())
    }

    fn save(&self) -> Result<(Vec<u8>, Vec<u8>), Fault> {
        let driver = [self.approach.bodies, self.approach.fastest];
        Ok((self.solver.save()?, pack(DRIVER, &driver)))
    }

    fn measurement(&self) -> (&Ledger, Records<'_>) {
        let measurement = self.solver.measurement();
        (&measurement.ledger, Records::Groups(&measurement.groups))
    }

    fn points(&self) -> Option<Vec<PointState>> {
        Some(self.solver.points())
    }
}
