//! The states that a run saves, to continue from them.

use std::sync::atomic::Ordering;

use interface::config::capability::SAVE;
use interface::message::wire::flags;
use interface::session::Solvers;

use super::Run;
use crate::run::checkpoint::file::About;
use crate::run::checkpoint::writer::CheckpointWriter;
use crate::run::checkpoint::{Checkpoint, CouplerState, Phase, UnderWay};
use crate::run::failure::RunError;

impl Run<'_> {
    /// Keeps checkpoints when the scene or a signal asks for them, if all solvers can save their states.
    pub(super) fn keep_checkpoints(&mut self, solvers: &Solvers) {
        if let Some(&party) = self.parties.iter().find(|p| !solvers.can(**p, SAVE)) {
            let identity = solvers.hello(party).map_or("", |hello| &hello.identity);
            tracing::warn!(
                "this run cannot be resumed: the {party} `{identity}` cannot save its state"
            );
            return;
        }
        let plan = self.scene.output.checkpoint.clone();
        let time = self.account.clock.time();
        let plan = plan.unwrap_or_default();
        self.checkpoints.writer = Some(CheckpointWriter::begin(
            plan,
            self.dir,
            time,
            self.outputs.sink.clone(),
        ));
    }

    /// The flag that asks for a checkpoint before the next grant, if one is due; keeps what the coupler adds to it.
    pub(super) fn checkpoint(&mut self, under_way: &UnderWay) -> Result<u64, RunError> {
        let Some(writer) = &self.checkpoints.writer else {
            return Ok(0);
        };
        self.checkpoints.kept = self.is_to_be_kept();
        if self.schedule.phase == Phase::Stepping {
            let last = self.account.interrupted && !self.checkpoints.last_asked;
            let wanted = self.options.save.swap(false, Ordering::Relaxed);
            let due = writer.is_due(self.account.clock.time());
            if !(last || wanted || due || self.checkpoints.kept) {
                return Ok(0);
            }
            self.checkpoints.last_asked |= last;
        } else if !self.checkpoints.kept {
            return Ok(0);
        }
        // The rows to which the checkpoint refers must be in the file before it is.
        let relies_on = self.outputs.flush()?;
        let state = CouplerState {
            account: self.account.keep(),
            phase: self.schedule.phase,
            under_way: *under_way,
            asked: self.schedule.asked,
            sides: self.latest.sides,
            bodies: self.latest.bodies.clone(),
            origin: self.latest.origin.clone(),
            history: self.outputs.history.bytes(),
            frames: self
                .outputs
                .frames
                .as_ref()
                .map(|f| f.listed().clone())
                .unwrap_or_default(),
        };
        self.checkpoints.pending = Some((state, relies_on));
        Ok(flags::CHECKPOINT)
    }

    /// The states of the solvers have arrived with the reports.
    pub(super) fn keep(&mut self, solvers: &mut Solvers) {
        let (Some((state, relies_on)), Some(writer)) = (
            self.checkpoints.pending.take(),
            &mut self.checkpoints.writer,
        ) else {
            return;
        };
        let states = self.parties.iter().filter_map(|&party| {
            let state = solvers.take_saved(party)?;
            Some((party, state))
        });
        let states: Vec<_> = states.collect();
        let mut about = About::of(self.scene, self.outputs.sink.is_some());
        about.step = self.account.clock.index();
        about.time = self.account.clock.time();
        about.kept = self.checkpoints.kept;
        let checkpoint = Checkpoint {
            about,
            state,
            solvers: states,
        };
        writer.take(checkpoint, relies_on);
    }
}
