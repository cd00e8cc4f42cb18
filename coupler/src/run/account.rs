//! The accumulated results of a run, from which a summary can be written whenever the run ends.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::time::{Duration, Instant};

use interface::message::control::Party;
use interface::message::wire::Report;
use interface::step::Clock;
use serde::{Deserialize, Serialize};

use crate::record::check::{Recorded, Recorder};
use crate::record::ledger::{Balance, Since, created_words};
use crate::record::summary::{Criteria, Spent, Status, Summary, VERSION};
use crate::run::failure::RunError;
use crate::run::pace::{Pace, SoFar};
use crate::scene::Scene;

/// The time used up to a moment.
#[derive(Debug, Clone)]
struct Moment {
    at: Instant,
    /// CPU time of the coupler, and of each solver by its last report.
    cpu: BTreeMap<Party, f64>,
}

/// The part of an account that continues in another process.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Kept {
    recorded: Recorded,
    pub so_far: SoFar,
    tally: Tally,
    spent: Spent,
}

/// What a run has counted and measured so far.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Tally {
    pub since: Since,
    pub balance: Balance,
    pub criteria: Criteria,
    pub clock: Clock,
    pub imps_max: u64,
    pub grants: u64,
    pub epochs: u64,
    epochs_before: u64,
}

/// The data of a run at any time, enough for a summary however the run ends.
pub(crate) struct Account {
    pub scene: String,
    pub scene_hash: String,
    solver_files: Option<String>,
    start: Option<[String; 2]>,
    pub recorder: Recorder,
    pub tally: Tally,
    /// The share of created energy that the scene takes.
    created_energy: f64,
    pub pace: Pace,
    pub reports: BTreeMap<Party, Report>,
    pub waited: Duration,
    pub cpu_at_start: Duration,
    pub state_hash: Option<String>,
    pub interrupted: bool,
    /// The coupler was killed, and a later process writes this.
    pub cut_short: bool,
    /// The last output of the solver at which the run failed.
    pub last_words: Option<(Party, String)>,
    /// When this process began, and the time that earlier processes used.
    started: Instant,
    earlier: Spent,
    /// When the first reports arrived, and when the last ones did.
    stepping: [Option<Moment>; 2],
    /// Whether the solvers compute in the coupler's thread.
    shared_thread: bool,
}

impl Account {
    pub fn new(scene: &Scene, shared_thread: bool) -> Self {
        Self {
            scene: scene.name.clone(),
            scene_hash: scene.hash.clone(),
            solver_files: scene.solver_files(),
            start: scene.begins_with(),
            recorder: Recorder::new(&scene.output.columns, &scene.checks, scene.time.end),
            tally: Tally {
                since: Since::default(),
                balance: Balance::default(),
                criteria: Criteria::default(),
                clock: Clock::new(0.0),
                imps_max: 0,
                grants: 0,
                epochs: 0,
                epochs_before: 0,
            },
            created_energy: scene.time.created_energy,
            pace: Pace::new(scene.time, scene.output.every),
            reports: BTreeMap::new(),
            waited: Duration::ZERO,
            cpu_at_start: interface::session::cpu_time(),
            state_hash: None,
            interrupted: false,
            cut_short: false,
            last_words: None,
            started: Instant::now(),
            earlier: Spent::default(),
            stepping: [None, None],
            shared_thread,
        }
    }

    /// The reports on a grant have arrived. The first grant is the opening step, in which nothing moves. In it solvers
    /// allocate their memory, so it belongs to start-up. (In a run that continues, the first grant is a window of
    /// steps.)
    pub fn reported(&mut self) {
        if self.stepping[0].is_none() {
            self.stepping[0] = Some(self.moment());
        }
    }

    /// There are no more grants.
    pub fn drained(&mut self) {
        self.stepping[1] = Some(self.moment());
    }

    /// Whether this process has been stepping for this long.
    pub fn is_stepping_for(&self, most: Duration) -> bool {
        let [first, _] = &self.stepping;
        first
            .as_ref()
            .is_some_and(|first| first.at.elapsed() >= most)
    }

    fn moment(&self) -> Moment {
        let mut cpu: BTreeMap<Party, f64> = self
            .reports
            .iter()
            .map(|(&party, report)| (party, report.cpu_ns as f64 * 1e-9))
            .collect();
        cpu.insert(Party::Coupler, self.own_cpu());
        Moment {
            at: Instant::now(),
            cpu,
        }
    }

    /// CPU time of the coupler in this process so far, in s. Of a shared thread it is what the solvers have left. Of
    /// their last turns they report wall time, which may be more than that.
    fn own_cpu(&self) -> f64 {
        let all = interface::session::cpu_time().saturating_sub(self.cpu_at_start);
        let reports = self.reports.values().filter(|_| self.shared_thread);
        let shared: f64 = reports.map(|report| report.cpu_ns as f64 * 1e-9).sum();
        (all.as_secs_f64() - shared).max(0.0)
    }

    /// Adds the time of stepping of this process.
    fn add_stepping(&self, spent: &mut Spent) {
        let [Some(first), last] = &self.stepping else {
            return;
        };
        let last = last.clone().unwrap_or_else(|| self.moment());
        spent.stepping_wall_s += last.at.duration_since(first.at).as_secs_f64();
        for (party, cpu) in last.cpu {
            let before = first.cpu.get(&party).copied().unwrap_or(0.0);
            let sum = spent.stepping_cpu_s.entry(party.name().to_owned());
            *sum.or_default() += (cpu - before).max(0.0);
        }
    }

    /// The part that continues in another process.
    pub fn keep(&self) -> Kept {
        Kept {
            recorded: self.recorder.recorded.clone(),
            so_far: self.pace.so_far.clone(),
            tally: self.tally.clone(),
            spent: self.spent(),
        }
    }

    /// Continues the account of another process of the same scene.
    pub fn resume(&mut self, kept: Kept) {
        self.tally = kept.tally;
        self.pace.so_far = kept.so_far;
        self.earlier = kept.spent;
        self.recorder.recorded = kept.recorded;
    }

    /// Begins with the account of a run of another scene. The clock shows 0 if `from_zero`. The numbers of epochs and
    /// steps continue, as the solvers expect.
    pub fn branch(&mut self, kept: &Kept, from_zero: bool) {
        let mut clock = kept.tally.clock;
        if from_zero {
            let (index, before) = (clock.index(), clock.interval_behind());
            clock = Clock::within_epoch(index, 0.0, 0, before, 0.0);
        }
        self.pace.branch(&kept.so_far, clock.time());
        let tally = &mut self.tally;
        (tally.clock, tally.since) = (clock, Since::Next);
        tally.epochs = kept.tally.epochs;
        tally.epochs_before = tally.epochs;
    }

    /// Time used by this process and by earlier ones.
    fn spent(&self) -> Spent {
        let mut spent = self.earlier.clone();
        let mut add = |party: Party, [compute, exchange, wait, cpu]: [f64; 4]| {
            let parts = spent
                .wall_by_part
                .entry(party.name().to_owned())
                .or_default();
            parts.compute += compute;
            parts.exchange += exchange;
            parts.wait += wait;
            *spent.cpu_s.entry(party.name().to_owned()).or_default() += cpu;
        };
        for (&party, report) in &self.reports {
            let own = [
                report.compute_ns,
                report.exchange_ns,
                report.wait_ns,
                report.cpu_ns,
            ];
            add(party, own.map(|ns| ns as f64 * 1e-9));
        }
        let wall = self.started.elapsed().as_secs_f64();
        let waited = self.waited.as_secs_f64();
        add(Party::Coupler, [wall - waited, 0.0, waited, self.own_cpu()]);
        spent.wall_s += wall;
        self.add_stepping(&mut spent);
        spent
    }

    /// Why the run did not reach its end, the advice, and the last output of the solver.
    fn reason(&self, error: &RunError) -> String {
        let mut reason = format!("{error} ({})", error.advice());
        if let Some((party, words)) = &self.last_words {
            let _ = write!(reason, "\nlast lines of {}.log:", party.name());
            for line in words.lines() {
                let _ = write!(reason, "\n  {line}");
            }
        }
        reason
    }

    #[allow(clippy::too_many_lines)] // one struct, field by field
    pub fn summarise(&self, ended: &Result<(), RunError>) -> Summary {
        let whole = ended.is_ok() && !self.interrupted && !self.cut_short;
        let checks = if whole {
            self.recorder.finish()
        } else {
            self.recorder.so_far()
        };
        let created = self.tally.balance.created_relative();
        let too_much = created > self.created_energy;
        let warnings = created_words(created).map(|words| {
            if too_much {
                format!(
                    "{words}, more than time.created_energy = {}",
                    self.created_energy
                )
            } else {
                words
            }
        });
        let status = match ended {
            Err(error) => error.status(),
            Ok(()) if self.interrupted => Status::Interrupted,
            Ok(()) if too_much || checks.iter().any(|check| !check.pass) => Status::CheckFailed,
            Ok(()) => Status::Done,
        };
        let reason = match ended {
            Err(error) => Some(self.reason(error)),
            Ok(()) if self.interrupted => Some(format!(
                "interrupted at t = {:.6e} s",
                self.tally.clock.time()
            )),
            Ok(()) => None,
        };
        let report = |party| self.reports.get(&party);
        let items = |party| report(party).map_or(0, |report: &Report| report.items);
        let laid_out = &self.pace.so_far;
        let bound_by = laid_out.bound_by.iter();
        let bound_by = bound_by.map(|(bound, &steps)| (bound.name().to_owned(), steps));
        let mut summary = Summary {
            version: VERSION,
            warnings: warnings.into_iter().collect(),
            scene: self.scene.clone(),
            scene_hash: self.scene_hash.clone(),
            solver_files: self.solver_files.clone(),
            start: self.start.clone(),
            status,
            reason,
            steps: laid_out.bound_by.values().sum(),
            time: self.tally.clock.time(),
            dt_min: laid_out.range.map(|(low, _)| low),
            dt_max: laid_out.range.map(|(_, high)| high),
            dt_bound_by: bound_by.collect(),
            criteria: self.tally.criteria,
            grants: self.tally.grants,
            epochs: self.tally.epochs - self.tally.epochs_before,
            rebuilds: report(Party::Mpm).map_or(0, |report| report.rebuilds),
            spent: self.spent(),
            points: items(Party::Mpm),
            imps_max: self.tally.imps_max,
            bodies: items(Party::Dem),
            state_hash: self.state_hash.clone(),
            checks,
            ..Summary::default()
        };
        summary.set_balance(&self.tally.balance);
        summary
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    /// Beside other programs, what solvers report of a shared thread may be more than its CPU time.
    #[test]
    fn stepping_takes_no_more_of_a_shared_thread_than_the_whole_run() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR"));
        let file = file.join("../scenes/jiang2020/collision_hard.toml");
        let scene = Scene::load(&file, None, &[]).unwrap();
        let mut account = Account::new(&scene, true);
        let report = Report {
            cpu_ns: 1_000_000_000,
            ..Report::default()
        };
        account.reports.insert(Party::Mpm, report);
        account.reported();
        account.drained();
        let spent = account.spent();
        assert!(spent.stepping_cpu_s["coupler"] <= spent.cpu_s["coupler"]);
    }
}
