//! The states that a run saves, to continue from them.

use std::sync::atomic::Ordering;

use interface::config::capability::SAVE;
use interface::message::wire::flags;
use interface::session::Solvers;

use super::Run;
use crate::record::frames::Listed;
use crate::run::checkpoint::file::{About, CANNOT_RESUME};
use crate::run::checkpoint::writer::CheckpointWriter;
use crate::run::checkpoint::{Checkpoint, CouplerState, Phase, UnderWay};
use crate::run::failure::RunError;

impl Run<'_> {
    /// Keeps checkpoints when the scene or a signal asks for them, if all solvers can save their states. If one cannot,
    /// says so: such a run cannot be resumed.
    pub(super) fn keep_checkpoints(&mut self, solvers: &Solvers) {
        let mut parties = self.parties.iter();
        if let Some(&party) = parties.find(|party| !solvers.can(**party, SAVE)) {
            let identity = solvers.hello(party).map_or("", |hello| &hello.identity);
            tracing::warn!("{CANNOT_RESUME}: the {party} `{identity}` cannot save its state");
            return;
        }
        self.checkpoints.writer = Some(CheckpointWriter::begin(
            self.scene.output.checkpoint.clone().unwrap_or_default(),
            self.dir,
            self.account.tally.clock.time(),
        ));
    }

    /// Whether the scene keeps the state of this moment for others.
    fn is_to_be_kept(&self) -> bool {
        let plan = self.scene.output.checkpoint.as_ref();
        plan.is_some_and(|plan| match self.schedule.phase {
            Phase::Stepping => {
                let on_output = self.schedule.flags & flags::MEASURE != 0;
                let now = self.account.pace.so_far.outputs;
                let is_now = |at: &f64| (at / self.scene.output.every).round() as u64 == now;
                on_output && plan.at.iter().any(is_now)
            }
            Phase::Done => plan.end && self.account.tally.clock.time() >= self.scene.time.end,
            Phase::Arriving | Phase::Opening | Phase::Closing => false,
        })
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
            let due = writer.is_due(self.account.tally.clock.time());
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
            flags: self.schedule.flags,
            sides: self.latest.sides,
            bodies: self.latest.bodies.clone(),
            origin: self.latest.origin.clone(),
            history: self.outputs.history.sealed(),
            course: self.outputs.course.rows.sealed(),
            frames: (self.outputs.frames.as_ref())
                .map_or_else(Listed::default, |frames| frames.listed.clone()),
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
        let mut about = About::of(self.scene);
        about.step = self.account.tally.clock.index();
        about.time = self.account.tally.clock.time();
        about.kept = self.checkpoints.kept;
        let checkpoint = Checkpoint {
            about,
            state,
            solvers: states,
        };
        writer.take(checkpoint, relies_on);
    }
}
