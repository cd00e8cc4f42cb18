//! The steps of a run: epochs, the windows in which they are granted, and their end.

use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use interface::message::control::Party;
use interface::message::wire::{Grant, flags};
use interface::recording::RecordingSink;
use interface::session::{Next, SessionError};

use super::{ALONE, Run, TWICE};
use crate::run::checkpoint::writer::CheckpointWriter;
use crate::run::checkpoint::{Phase, UnderWay};
use crate::run::failure::RunError;
use crate::run::pace::Epoch;
use crate::run::stability::{Bound, Sides, Stability, StepLimit};

/// A window takes about this long, so that the bar moves and Ctrl-C has an effect.
const WINDOW_TIME: Duration = Duration::from_millis(200);
/// The opening and the closing step have no length. They give the forces, limits and energies at the start and at the
/// end.
const STANDSTILL: Epoch = Epoch {
    dt: 0.0,
    steps: 1,
    lands: false,
    bound: Bound::Output,
};

/// The steps that come next.
pub(super) struct Schedule {
    pub phase: Phase,
    /// The epoch in progress.
    pub under_way: Option<UnderWay>,
    /// Flags of the next grant.
    pub flags: u64,
    /// More flags of the first grant. It asks for a frame, so that the memory for all points exists, and both sides
    /// know it, before anything is computed. At the end of the run all points are sent in that memory.
    pub touches: u64,
    /// When the last grant was decided.
    pub granted: Instant,
    /// Wall time of a step in the last window.
    pub step_time: Option<Duration>,
}

impl Run<'_> {
    fn stability(&self) -> &Stability {
        self.stability.as_ref().expect("all solvers are ready")
    }

    /// Whether so much waits for the disk that nothing should be added.
    fn is_behind(&self) -> bool {
        let checkpoints = self.checkpoints.writer.as_ref();
        self.outputs.is_behind() || checkpoints.is_some_and(CheckpointWriter::is_behind)
    }

    /// The next grant, or the end of them.
    pub(super) fn next_grant(&mut self) -> Result<Option<Next>, RunError> {
        let at_once = &self.options.at_once;
        if !(self.resources.disk).wait(|| self.is_behind(), at_once) {
            return Err(RunError::Interrupted(format!("{ALONE}: {TWICE}")));
        }
        if let Some(error) = self.outputs.sink.as_ref().and_then(RecordingSink::failure) {
            return Err(SessionError::from(error).into());
        }
        let under_way = match self.schedule.under_way {
            Some(under_way) => under_way,
            None => match self.next_epoch()? {
                Some(epoch) => self.begin(epoch),
                None => return Ok(None),
            },
        };
        let checkpoint = self.checkpoint(&under_way)?;
        let window = self.window().min(under_way.epoch.steps - under_way.done);
        let (epoch_start, steps_in_epoch, dt_before_epoch) = self.account.tally.clock.epoch();
        let grant = Grant {
            epoch: self.account.tally.epochs,
            first: self.account.tally.clock.index(),
            steps: window,
            flags: self.schedule.flags | checkpoint | std::mem::take(&mut self.schedule.touches),
            epoch_start,
            steps_in_epoch,
            dt_before_epoch,
            dt: under_way.epoch.dt,
            ..Grant::default()
        };
        let Sides { mpm, dem } = under_way.budgets;
        let budget = |party: &Party| match party {
            Party::Mpm => mpm,
            Party::Dem => dem,
            Party::Coupler => unreachable!("the coupler is granted nothing"),
        };
        let budgets = self.parties.iter().map(budget).collect();
        self.account.tally.grants += 1;
        self.schedule.granted = Instant::now();
        Ok(Some((grant, budgets)))
    }

    fn begin(&mut self, epoch: Epoch) -> UnderWay {
        self.account.tally.clock.begin_epoch(epoch.dt);
        self.account.tally.epochs += 1;
        let under_way = UnderWay {
            budgets: self.stability().budgets(&self.latest.sides, epoch.dt),
            epoch,
            done: 0,
        };
        self.schedule.under_way = Some(under_way);
        under_way
    }

    /// The next epoch, if there is one.
    fn next_epoch(&mut self) -> Result<Option<Epoch>, RunError> {
        if self.schedule.phase == Phase::Stepping {
            let time = self.account.tally.clock.time();
            if time < self.scene.time.end && !self.ends_early() {
                let stability = *self.stability();
                stability.compare(&self.latest.sides, &mut self.account.tally.criteria);
                let epoch = self
                    .account
                    .pace
                    .epoch(time, &stability, &self.latest.sides);
                return epoch.map(Some).map_err(|e| self.collapsed(e));
            }
            self.schedule.phase = Phase::Closing;
            self.schedule.flags = self.flags_at_output(true);
        }
        match self.schedule.phase {
            Phase::Arriving => {
                self.schedule.phase = Phase::Opening;
                Ok(Some(STANDSTILL))
            }
            Phase::Opening => {
                self.schedule.phase = Phase::Stepping;
                self.schedule.flags = self.flags_at_output(true);
                Ok(Some(STANDSTILL))
            }
            Phase::Closing => {
                self.schedule.phase = Phase::Done;
                Ok(Some(STANDSTILL))
            }
            Phase::Stepping | Phase::Done => Ok(None),
        }
    }

    /// Whether the run is interrupted, and its last checkpoint, if it writes any, has been asked for.
    pub(super) fn ends_early(&mut self) -> bool {
        self.interrupted() && (self.checkpoints.last_asked || self.checkpoints.writer.is_none())
    }

    fn interrupted(&mut self) -> bool {
        let interrupted = self.options.interrupt.load(Ordering::Relaxed);
        let most = self.options.stepping;
        self.account.interrupted |=
            interrupted || most.is_some_and(|most| self.account.is_stepping_for(most));
        self.account.interrupted
    }

    /// The flags of a grant at an output: the measurement, and a frame if one is `due`.
    pub(super) fn flags_at_output(&self, due: bool) -> u64 {
        if due && self.outputs.frames.is_some() {
            flags::MEASURE | flags::FRAME
        } else {
            flags::MEASURE
        }
    }

    /// Number of steps that fit into the time of a window; one, as long as the time of a step is not known.
    fn window(&self) -> u64 {
        let most = self.options.window.unwrap_or(self.scene.coupling.window);
        let time = WINDOW_TIME.min(self.scene.coupling.deadline() / 4);
        match self.schedule.step_time {
            Some(t) => (time.as_nanos() / t.as_nanos().max(1)).clamp(1, most.into()) as u64,
            None => 1,
        }
    }

    /// The epoch has ended on an output.
    pub(super) fn land(&mut self) {
        self.account
            .tally
            .clock
            .land_on(self.account.pace.next_output());
        self.account.pace.so_far.outputs += 1;
        // At the end the closing step is measured instead.
        let every = self.scene.output.frames;
        let due = every.is_some_and(|rows| self.account.pace.so_far.outputs.is_multiple_of(rows));
        if self.account.tally.clock.time() < self.scene.time.end {
            self.schedule.flags = self.flags_at_output(due);
        }
    }

    fn collapsed(&self, limit: StepLimit) -> RunError {
        RunError::Collapsed {
            time: self.account.tally.clock.time(),
            step: self.account.tally.clock.index(),
            bound: limit.bound,
            dt: limit.dt,
            min_step: self.scene.time.shortest(),
        }
    }
}
