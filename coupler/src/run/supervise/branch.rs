//! A run that begins with the state of another one, and the states that a run keeps for others.

use interface::message::control::Party;
use interface::message::wire::flags;

use super::outputs::Outputs;
use super::{Run, is_in_epoch};
use crate::record::frames::Listed;
use crate::record::rundir::RunDir;
use crate::run::account::Account;
use crate::run::checkpoint::{CouplerState, Phase};
use crate::run::failure::RunError;
use crate::run::options::RunOptions;
use crate::scene::Scene;

impl<'a> Run<'a> {
    /// A run that begins with the state of a run of another scene.
    pub(super) fn branch(
        scene: &'a Scene,
        options: &'a RunOptions,
        dir: &'a RunDir,
        account: &'a mut Account,
        (state, solvers): (CouplerState, Vec<(Party, Vec<u8>)>),
        as_before: bool,
    ) -> Result<Self, RunError> {
        let listed = Listed {
            start: state.origin.clone(),
            ..Listed::default()
        };
        let outputs = Outputs::begin(scene, options, dir, account, listed)?;
        let from_zero = scene.start.as_ref().is_some_and(|start| start.from_zero);
        account.branch(&state.account, from_zero);
        let under_way = (state.phase == Phase::Stepping).then_some(state.under_way);
        if let Some(under_way) = under_way.as_ref().filter(|_| as_before) {
            is_in_epoch(account, under_way)?;
        }
        let mut run = Self::at_start(scene, options, dir, account, outputs);
        run.latest.sides = state.sides;
        run.latest.bodies = state.bodies;
        run.latest.origin = state.origin;
        run.restored = solvers;
        if as_before {
            run.schedule.phase = Phase::Stepping;
            run.schedule.under_way = under_way;
            if run
                .schedule
                .under_way
                .is_some_and(|under_way| under_way.done > 0)
            {
                // Only the first grant of an epoch may measure (G-8).
                run.schedule.asked = state.asked;
            }
        } else {
            (run.schedule.phase, run.schedule.asked) = (Phase::Arriving, 0);
        }
        Ok(run)
    }

    /// Whether the scene keeps the state of this moment for others.
    pub(super) fn is_to_be_kept(&self) -> bool {
        let plan = self.scene.output.checkpoint.as_ref();
        plan.is_some_and(|plan| match self.schedule.phase {
            Phase::Stepping => {
                let on_output = self.schedule.asked & flags::MEASURE != 0;
                on_output && plan.at.contains(&self.account.pace.outputs())
            }
            Phase::Done => plan.end && self.account.clock.time() >= self.scene.time.end,
            Phase::Arriving | Phase::Opening | Phase::Closing => false,
        })
    }
}
