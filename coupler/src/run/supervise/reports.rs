//! What the solvers report of the steps that they were granted, and what is recorded of it.

use std::time::{Duration, Instant};

use interface::message::control::Party;
use interface::message::wire::{BodyState, Ledger, flags};
use interface::session::{Round, SessionError, Solvers};
use interface::transport::vanished;

use super::Run;
use crate::record::ledger::{Moving, created_words};
use crate::record::quantity::Ledgers;
use crate::record::summary::state_hash;
use crate::run::failure::RunError;
use crate::run::options;
use crate::run::pace::Epoch;
use crate::run::stability::Sides;

/// A positive energy residual above this share of the energy in play is an instability, and not an error of the scheme.
const BLOW_UP: f64 = 0.5;
/// How old a summary for the case that shared memory vanishes may be.
const REMEMBERED: Duration = Duration::from_secs(1);

/// The latest reports.
#[derive(Default)]
pub(super) struct Latest {
    pub sides: Sides,
    pub bodies: Vec<BodyState>,
    /// The bodies at their initial positions.
    pub origin: Vec<BodyState>,
    /// The share of created energy that was reported last.
    pub created_told: f64,
}

impl Run<'_> {
    /// Takes the reports on the last grant.
    pub(super) fn take_reports(&mut self, solvers: &mut Solvers) -> Result<(), RunError> {
        self.account.waited += self.schedule.granted.elapsed();
        self.keep(solvers);
        for &party in &self.parties {
            let report = *solvers.report(party).expect("a solver of this session");
            match party {
                Party::Mpm => self.latest.sides.mpm = report.limits,
                Party::Dem => self.latest.sides.dem = report.limits,
                Party::Coupler => unreachable!("the coupler reports to nobody"),
            }
            self.account.tally.imps_max = self.account.tally.imps_max.max(report.imps);
            self.account.reports.insert(party, report);
        }
        self.account.reported();
        let round = solvers.round();
        let mut under_way = self.schedule.under_way.take().expect("a grant was given");
        let epoch = under_way.epoch;
        let requested = std::mem::take(&mut self.schedule.flags);
        let at = self.account.tally.clock.step(requested != 0);
        // Before the steps of the window count: a run that stops here has done those before the measurement, in any window.
        if requested != 0 {
            self.outputs.course.before(&self.account.pace);
            self.record(at.time, &epoch, requested & flags::FRAME != 0, round)?;
        }
        self.account.tally.clock.advance_by(round.steps);
        under_way.done += round.steps;
        if epoch.dt > 0.0 {
            self.account.pace.book(&epoch, round.steps);
        }
        round.points = Vec::new();
        self.schedule.step_time = Some(self.schedule.granted.elapsed() / round.steps.max(1) as u32);
        self.leave_summary();
        self.show(&epoch);
        let whole = under_way.done == epoch.steps;
        if !whole && round.within && !self.ends_early() {
            self.schedule.under_way = Some(under_way);
        }
        if epoch.lands && whole {
            self.land();
        }
        Ok(())
    }

    /// Takes the measurement of the first step of the last grant.
    fn record(
        &mut self,
        time: f64,
        epoch: &Epoch,
        frame: bool,
        round: &mut Round,
    ) -> Result<(), RunError> {
        self.latest.bodies.clone_from(&round.bodies);
        if self.latest.origin.is_empty() {
            self.latest.origin.clone_from(&round.bodies);
        }
        let groups = self.scene.mpm.as_ref().map_or(0, |mpm| mpm.groups.len());
        let account = &mut *self.account;
        let ledger = |party| {
            account
                .reports
                .get(&party)
                .map_or_else(Ledger::default, |report| report.ledger)
        };
        let [mpm, dem] = [Party::Mpm, Party::Dem].map(ledger);
        let quantities = &self.scene.quantities;
        let [_, chains] = quantities.split_chains(&mut round.groups);
        let [mpm, dem] = account.tally.since.count([mpm, dem], chains);
        let moving = Moving::of(&round.groups[..groups], &round.bodies);
        account.tally.balance.take(&mpm, &dem, &moving);
        let ledgers = Ledgers {
            time,
            mpm,
            dem,
            balance: account.tally.balance,
        };
        let first = account.recorder.initial();
        let sample = quantities.sample(&ledgers, &round.groups, &round.bodies, first);
        let row = account.recorder.record(&sample);
        self.outputs.history.row(&row)?;
        self.outputs.course.row(time, &account.tally.balance.now)?;
        if frame && let Some(frames) = &mut self.outputs.frames {
            frames.take(time, round)?;
        }
        let residual = account.tally.balance.residual_relative();
        // A sum of finite numbers can still be infinite.
        if residual > BLOW_UP || !residual.is_finite() {
            // The opening and the closing step have no length, so the last step with a length is the cause.
            let (dt, bound) = account.pace.so_far.last.unwrap_or((epoch.dt, epoch.bound));
            return Err(RunError::BlowUp {
                time,
                step: account.tally.clock.index(),
                percent: 100.0 * residual,
                dt,
                bound: bound.name(),
                stable: self.scene.time.is_stable(),
            });
        }
        self.tell_created(time, residual);
        Ok(())
    }

    /// Keeps a summary of the run so far, from time to time, for the case that its shared memory vanishes: the system then ends
    /// this process, and a signal handler cannot make one.
    fn leave_summary(&mut self) {
        let shared = matches!(self.options.solvers, options::Solvers::Processes { .. });
        let old = (self.resources.left).is_none_or(|left| left.elapsed() >= REMEMBERED);
        if shared && old {
            let cause = vanished::CAUSE.to_owned();
            let error = SessionError::Aborted("the solvers cannot be reached".into());
            let ended = Err(RunError::SharedMemory { error, cause });
            let summary = self.account.summarise(&ended);
            self.dir.leave_summary(Some(&summary));
            self.resources.left = Some(Instant::now());
        }
    }

    /// Warns of created energy, a share of the energy in play, while the run goes on: when it is first worth a word,
    /// and whenever it has doubled.
    fn tell_created(&mut self, time: f64, created: f64) {
        if created > 2.0 * self.latest.created_told
            && let Some(words) = created_words(created)
        {
            self.latest.created_told = created;
            tracing::warn!(
                "at t = {time:.6e} s {words}; a run that ends with more than time.created_energy = {} has failed",
                self.scene.time.created_energy
            );
        }
    }

    fn show(&mut self, epoch: &Epoch) {
        let clock = &self.account.tally.clock;
        let bound = epoch.bound.name();
        let progress = &mut self.outputs.progress;
        progress.show(clock.index(), clock.time(), epoch.dt, bound);
    }

    /// All points have arrived, at the end.
    pub(super) fn take_end(&mut self, round: &Round) -> Result<(), RunError> {
        self.account.drained();
        if !self.account.interrupted {
            self.account.state_hash = Some(state_hash(&round.points, &self.latest.bodies));
        }
        self.resources.disk.during(|| self.write_bodies())?;
        Ok(())
    }
}
