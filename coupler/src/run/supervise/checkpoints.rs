//! The states that a run saves, to continue from there.

use std::sync::atomic::Ordering;

use interface::config::capability::SAVE;
use interface::core::coupler::Coupler;
use interface::message::control::Party;
use interface::message::wire::flags;

use super::Run;
use crate::record::frames::Frames;
use crate::run::checkpoint::file::About;
use crate::run::checkpoint::writer::CheckpointWriter;
use crate::run::checkpoint::{Checkpoint, CouplerState, Phase, UnderWay};
use crate::run::failure::RunError;

impl Run<'_> {
    /// Keeps checkpoints when the scene or a signal asks for them, if all solvers can save their states.
    pub(super) fn keep_checkpoints(&mut self, coupler: &Coupler) {
        let plan = self.scene.output.checkpoint.clone();
        let saves = |party: &&Party| {
            let hello = coupler.hello(**party).expect("all have said hello");
            hello.capabilities.has(SAVE)
        };
        if let Some(party) = self.parties.iter().find(|party| !saves(party)) {
            if plan.is_some() {
                tracing::warn!("no checkpoints: the {party} cannot save its state");
            }
            return;
        }
        let time = self.account.clock.time();
        let plan = plan.unwrap_or_default();
        self.checkpoints = Some(CheckpointWriter::begin(
            plan,
            self.dir,
            time,
            self.tape.clone(),
        ));
    }

    /// The flag that asks for a checkpoint before the next grant, if one is due; keeps what the coupler adds to it.
    pub(super) fn checkpoint(&mut self, under_way: &UnderWay) -> Result<u64, RunError> {
        let Some(checkpoints) = &self.checkpoints else {
            return Ok(0);
        };
        self.kept = self.is_to_be_kept();
        if self.phase == Phase::Stepping {
            let last = self.account.interrupted && !self.last_asked;
            let wanted = self.options.save.swap(false, Ordering::Relaxed);
            let due = checkpoints.is_due(self.account.clock.time());
            if !(last || wanted || due || self.kept) {
                return Ok(0);
            }
            self.last_asked |= last;
        } else if !self.kept {
            return Ok(0);
        }
        // The rows that it relies on reach the file before it does.
        let mut relies_on = vec![self.history.flush()?, self.course.flush()?];
        relies_on.extend(self.frames.as_ref().map(Frames::mark));
        let state = CouplerState {
            account: self.account.keep(),
            phase: self.phase,
            under_way: *under_way,
            asked: self.asked,
            sides: self.sides,
            bodies: self.bodies.clone(),
            origin: self.origin.clone(),
            history: self.history.bytes(),
            frames: self
                .frames
                .as_ref()
                .map(|f| f.listed().clone())
                .unwrap_or_default(),
        };
        self.pending = Some((state, relies_on));
        Ok(flags::CHECKPOINT)
    }

    /// The solvers' states have come with the reports.
    pub(super) fn keep(&mut self, coupler: &mut Coupler) {
        let (Some((state, relies_on)), Some(checkpoints)) =
            (self.pending.take(), &mut self.checkpoints)
        else {
            return;
        };
        let mut about = About::of(self.scene, &self.parties, self.tape.is_some());
        about.step = self.account.clock.index();
        about.time = self.account.clock.time();
        about.kept = self.kept;
        let states = self.parties.iter().filter_map(|&party| {
            let state = coupler.take_saved(party)?;
            Some((party, state))
        });
        let checkpoint = Checkpoint {
            about,
            state,
            solvers: states.collect(),
        };
        checkpoints.take(checkpoint, relies_on);
    }
}
