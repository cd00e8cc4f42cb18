//! What a run left in its directory, as far as a study asks.

use std::collections::BTreeMap;
use std::path::Path;

use coupler::record::summary::Criteria;
use coupler::record::summary::Status;
use serde::Deserialize;

use crate::table::Table;

/// What `summary.json` says. Numbers that could not be had are absent there.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Outcome {
    /// Hash of the scene that ran.
    pub scene_hash: String,
    /// How the run ended.
    pub status: Status,
    /// Why, unless it is done.
    pub reason: Option<String>,
    /// Steps that moved something.
    pub steps: u64,
    /// Simulated time reached in s.
    pub time: f64,
    /// Shortest step in s.
    pub dt_min: Option<f64>,
    /// Longest step in s.
    pub dt_max: Option<f64>,
    /// Steps by what bound them.
    pub dt_bound_by: BTreeMap<String, u64>,
    /// Steps that criteria would have allowed.
    pub criteria: Criteria,
    /// Wall time in s.
    pub wall_s: f64,
    /// CPU time by process in s.
    pub cpu_s: BTreeMap<String, f64>,
    /// Wall time of stepping in s: without start-up.
    pub stepping_wall_s: f64,
    /// CPU time of stepping by process in s.
    pub stepping_cpu_s: BTreeMap<String, f64>,
    /// Material points.
    pub points: u64,
    /// Energies.
    pub energy: Energy,
    /// Verdicts.
    pub checks: Vec<Verdict>,
}

/// The energy ledger.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Energy {
    /// Largest positive residual relative to the largest energy in play.
    pub residual_max: f64,
}

/// The verdict on a check.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Verdict {
    /// What was checked.
    pub name: String,
    /// What the run shows.
    pub value: Option<f64>,
    /// What it should be.
    pub reference: Option<f64>,
    /// How far the value is off, in the check's own measure.
    pub error: Option<f64>,
}

impl Outcome {
    /// Of a run directory; `None` where there is no whole summary.
    pub fn read(directory: &Path) -> Option<Self> {
        let text = std::fs::read_to_string(directory.join("summary.json")).ok()?;
        serde_json::from_str(&text).ok()
    }

    /// Of a run that left no summary.
    pub fn lost(reason: String) -> Self {
        Self {
            scene_hash: String::new(),
            status: Status::Failed,
            reason: Some(reason),
            steps: 0,
            time: 0.0,
            dt_min: None,
            dt_max: None,
            dt_bound_by: BTreeMap::new(),
            criteria: Criteria::default(),
            wall_s: 0.0,
            cpu_s: BTreeMap::new(),
            stepping_wall_s: 0.0,
            stepping_cpu_s: BTreeMap::new(),
            points: 0,
            energy: Energy { residual_max: 0.0 },
            checks: Vec::new(),
        }
    }

    /// Whether the run reached its end, whatever its checks say.
    pub fn whole(&self) -> bool {
        matches!(self.status, Status::Done | Status::CheckFailed)
    }

    /// Whether the same run would end in the same way again: an instability does, a machine that failed need not.
    pub fn settled(&self) -> bool {
        self.whole() || self.status == Status::Unstable
    }

    /// CPU time of all processes in s.
    pub fn cpu(&self) -> f64 {
        self.cpu_s.values().sum()
    }

    /// CPU time of stepping of all processes in s.
    pub fn stepping_cpu(&self) -> f64 {
        self.stepping_cpu_s.values().sum()
    }

    /// A check's verdict.
    pub fn verdict(&self, name: &str) -> Option<&Verdict> {
        self.checks.iter().find(|check| check.name == name)
    }
}

/// A column of `history.csv` in a run directory, by its name without its unit.
pub fn history_column(directory: &Path, name: &str) -> Option<Vec<f64>> {
    let history = Table::read(&directory.join("history.csv")).ok()?;
    history.column(name)
}
