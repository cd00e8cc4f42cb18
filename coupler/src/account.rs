//! What a run adds up to, kept so that however it ends there is a summary.

use std::collections::BTreeMap;
use std::time::Duration;

use interface::control::Party;
use interface::step::Clock;
use interface::wire::Report;

use crate::check::Recorder;
use crate::failure::RunError;
use crate::ledger::Balance;
use crate::pace::Pace;
use crate::scene::Scene;
use crate::stability::Criteria;
use crate::summary::{EnergyLedger, Status, Summary, WallParts};

/// What is known of a run at any time: enough for a summary, however it ends.
pub(crate) struct Account {
    pub scene: String,
    pub scene_hash: String,
    pub recorder: Recorder,
    pub balance: Balance,
    pub pace: Pace,
    pub criteria: Criteria,
    pub clock: Clock,
    pub reports: BTreeMap<Party, Report>,
    pub imps_max: u64,
    pub grants: u64,
    pub epochs: u64,
    pub waited: Duration,
    pub cpu_at_start: Duration,
    pub state_hash: Option<String>,
    pub interrupted: bool,
    /// The solvers compute in the coupler's thread.
    shared_thread: bool,
}

impl Account {
    pub fn new(scene: &Scene, shared_thread: bool) -> Self {
        Self {
            scene: scene.name.clone(),
            scene_hash: scene.hash.clone(),
            recorder: Recorder::new(scene),
            balance: Balance::default(),
            pace: Pace::new(scene.time, scene.output.every),
            criteria: Criteria::default(),
            clock: Clock::new(0.0),
            reports: BTreeMap::new(),
            imps_max: 0,
            grants: 0,
            epochs: 0,
            waited: Duration::ZERO,
            cpu_at_start: interface::session::cpu_time(),
            state_hash: None,
            interrupted: false,
            shared_thread,
        }
    }

    pub fn summarise(self, ended: &Result<(), RunError>, wall: Duration) -> Summary {
        let whole = ended.is_ok() && !self.interrupted;
        let checks = if whole {
            self.recorder.finish()
        } else {
            Vec::new()
        };
        let failed = checks.iter().any(|check| !check.pass);
        let status = match ended {
            Err(error) => error.status(),
            Ok(()) if self.interrupted => Status::Interrupted,
            Ok(()) if failed => Status::CheckFailed,
            Ok(()) => Status::Done,
        };
        let reason = match ended {
            Err(error) => Some(format!("{error} ({})", error.advice())),
            Ok(()) if self.interrupted => {
                Some(format!("interrupted at t = {:.6e} s", self.clock.time()))
            }
            Ok(()) => None,
        };
        let mut wall_by_part = BTreeMap::new();
        let mut cpu_s = BTreeMap::new();
        let seconds = |ns: u64| ns as f64 * 1e-9;
        for (party, report) in &self.reports {
            let parts = WallParts {
                compute: seconds(report.compute_ns),
                exchange: seconds(report.exchange_ns),
                wait: seconds(report.wait_ns),
            };
            wall_by_part.insert(party.name(), parts);
            cpu_s.insert(party.name(), seconds(report.cpu_ns));
        }
        let wait = self.waited.as_secs_f64();
        let coupler = WallParts {
            compute: wall.as_secs_f64() - wait,
            exchange: 0.0,
            wait,
        };
        wall_by_part.insert(Party::Coupler.name(), coupler);
        let cpu = interface::session::cpu_time().saturating_sub(self.cpu_at_start);
        let others: f64 = if self.shared_thread {
            cpu_s.values().sum()
        } else {
            0.0
        };
        cpu_s.insert(Party::Coupler.name(), (cpu.as_secs_f64() - others).max(0.0));
        let items = |party| {
            self.reports
                .get(&party)
                .map_or(0, |report: &Report| report.items)
        };
        let mut summary = Summary {
            scene: self.scene,
            scene_hash: self.scene_hash,
            status,
            reason,
            steps: self.pace.bound_by.values().sum(),
            time: self.clock.time(),
            dt_min: self.pace.range.map(|(low, _)| low),
            dt_max: self.pace.range.map(|(_, high)| high),
            dt_bound_by: self.pace.bound_by,
            criteria: self.criteria,
            grants: self.grants,
            epochs: self.epochs,
            rebuilds: self
                .reports
                .get(&Party::Mpm)
                .map_or(0, |report| report.rebuilds),
            wall_s: wall.as_secs_f64(),
            wall_by_part,
            cpu_s,
            points: items(Party::Mpm),
            imps_max: self.imps_max,
            bodies: items(Party::Dem),
            momentum_error: 0.0,
            energy: EnergyLedger::default(),
            state_hash: self.state_hash,
            checks,
        };
        summary.set_balance(&self.balance);
        summary
    }
}
