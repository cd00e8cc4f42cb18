//! `summary.json`: the results of a run, as it is written and as it is read.

use std::collections::BTreeMap;
use std::io;
use std::path::Path;

use interface::files::{self, SMALL};
use interface::message::wire::{BodyState, PointState};
use serde::de::value::MapDeserializer;
use serde::{Deserialize, Deserializer, Serialize};
use strum::IntoStaticStr;
use thiserror::Error;

use crate::check::{CheckResult, number};
use crate::ledger::{Balance, Energies};

/// Name of the file in a run directory.
pub const SUMMARY: &str = "summary.json";
/// Version of the file's keys. A file of another one is refused.
pub const VERSION: u32 = 2;

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Status {
    /// It reached its end, and every check holds.
    Done,
    /// It reached its end, and a check does not hold.
    CheckFailed,
    /// A solver failed, ended or refused its configuration.
    #[default]
    Failed,
    /// An unstable or non-finite state stopped the run.
    Unstable,
    /// It was interrupted and ended in order.
    Interrupted,
    /// The coupler was killed, or the machine stopped. The summary is written afterwards from the files.
    Killed,
}

impl Status {
    /// As `summary.json` spells it.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// Exit status of `tandem run`.
    pub const fn exit_code(self) -> u8 {
        match self {
            Self::Done => 0,
            Self::CheckFailed => 1,
            Self::Failed | Self::Killed => 3,
            Self::Unstable => 4,
            Self::Interrupted => 130,
        }
    }
}

/// How a process spent its wall time, in s.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct WallParts {
    /// Computing.
    pub compute: f64,
    /// Copying to and from the channels.
    pub exchange: f64,
    /// Waiting for the others.
    pub wait: f64,
}

/// The time that a run took, by the names of the processes.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Spent {
    /// Wall time from launch to the end in s.
    pub wall_s: f64,
    /// By process.
    pub wall_by_part: BTreeMap<String, WallParts>,
    /// CPU time by process in s. In one process: of each party's thread, without those of its pool.
    pub cpu_s: BTreeMap<String, f64>,
    /// Wall time of stepping in s: from the reports on the first grant, the opening step in which nothing moves, to
    /// those on the last. Start-up is what comes before.
    pub stepping_wall_s: f64,
    /// CPU time of stepping by process in s, as `cpu_s` counts it.
    pub stepping_cpu_s: BTreeMap<String, f64>,
}

/// The ledger at both ends of the run.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct EnergyLedger {
    /// At the first measurement, in J/m.
    #[serde(deserialize_with = "energies")]
    pub start: Energies,
    /// At the last, in J/m.
    #[serde(deserialize_with = "energies")]
    pub end: Energies,
    /// Largest positive residual relative to the largest energy in play.
    #[serde(deserialize_with = "number")]
    pub residual_max: f64,
    /// What the transfer between points and nodes has taken from the motion, at the last measurement, relative to the
    /// largest energy in play.
    #[serde(deserialize_with = "number")]
    pub transfer: f64,
    /// Work of the stress that is neither stored nor dissipated, at the last measurement, relative to the largest energy in
    /// play; `null` of a continuum that does not keep that work.
    pub work_gap: Option<f64>,
}

/// Steps in s that several criteria would allow, for comparison. They include safety factors, and leave out the scene's
/// `step_factor`, cap and outputs; `null` if nothing limits the step.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Criteria {
    /// Shortest step of the composed criterion (docs/physics.md section 4) in the run.
    pub composed: Option<f64>,
    /// Jiang 2020 eq. 51, the scene's own factors or those of the paper's scenes.
    pub jiang2020: Option<f64>,
    /// `min(kappa_1 L/c, 2 kappa sqrt(m_p/k_n))` with the mass of the lightest point and the safety factor kappa: the
    /// choice of someone who knows that a point is the lightest partner in its contact.
    pub lightest_point: Option<f64>,
}

/// The results of a run.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Summary {
    /// [`VERSION`] of a summary that was written.
    pub version: u32,
    /// What a reader of the results has to know first, in words: energy that the computation has created.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    /// Name of the scene.
    pub scene: String,
    /// Hash of the scene as resolved.
    pub scene_hash: String,
    /// Hash of the files of the scene's own solvers as the run began.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub solver_files: Option<String>,
    /// The state of another run with which the run began: `from` and `state` of its scene.toml.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub start: Option<[String; 2]>,
    /// How the run ended.
    pub status: Status,
    /// Why, unless it is done.
    pub reason: Option<String>,
    /// Steps that moved something.
    pub steps: u64,
    /// Simulated time reached in s.
    pub time: f64,
    /// Shortest step in s; `null` before the first.
    pub dt_min: Option<f64>,
    /// Longest step in s.
    pub dt_max: Option<f64>,
    /// Steps by what bound them.
    pub dt_bound_by: BTreeMap<String, u64>,
    /// Steps that criteria would have allowed.
    pub criteria: Criteria,
    /// Grants, each to every solver.
    pub grants: u64,
    /// Epochs: intervals of equal steps.
    pub epochs: u64,
    /// Rebuilds of the IMP set.
    pub rebuilds: u64,
    /// The time that it took.
    #[serde(flatten)]
    pub spent: Spent,
    /// Material points.
    pub points: u64,
    /// Most IMPs at a time.
    pub imps_max: u64,
    /// Bodies.
    pub bodies: u64,
    /// Largest momentum error relative to the largest momentum seen.
    #[serde(deserialize_with = "number")]
    pub momentum_error: f64,
    /// The same of angular momentum; `null` with periodic walls.
    #[serde(default)]
    pub angular_momentum_error: Option<f64>,
    /// The energy ledger.
    pub energy: EnergyLedger,
    /// BLAKE3 over all positions and velocities, in order of ids; absent if the end was not reached.
    pub state_hash: Option<String>,
    /// The scene's checks.
    pub checks: Vec<CheckResult>,
}

/// Why a summary cannot be read.
#[derive(Debug, Error)]
pub enum SummaryError {
    /// The file is not there, or cannot be opened.
    #[error("{SUMMARY} cannot be read: {0}")]
    File(#[from] io::Error),
    /// It is no summary.
    #[error("{SUMMARY} cannot be read: {0}")]
    Content(#[from] serde_json::Error),
    /// Another version of Tandem wrote it.
    #[error(
        "{SUMMARY} has version {0}, expected {VERSION}: another version of Tandem has made this run"
    )]
    Version(u32),
}

impl Summary {
    /// Reads the summary of a run directory.
    ///
    /// # Errors
    /// [`SummaryError`].
    pub fn read(dir: &Path) -> Result<Self, SummaryError> {
        Self::parse(&files::read(dir, SUMMARY, SMALL)?)
    }

    /// Reads the content of a summary.
    ///
    /// # Errors
    /// [`SummaryError`].
    pub fn parse(json: &[u8]) -> Result<Self, SummaryError> {
        #[derive(Deserialize)]
        struct Head {
            version: u32,
        }
        match serde_json::from_slice(json)? {
            Head { version: VERSION } => Ok(serde_json::from_slice(json)?),
            Head { version } => Err(SummaryError::Version(version)),
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
        self.spent.cpu_s.values().sum()
    }

    /// CPU time of stepping of all processes in s.
    pub fn stepping_cpu(&self) -> f64 {
        self.spent.stepping_cpu_s.values().sum()
    }

    /// The verdict on a check.
    pub fn check(&self, name: &str) -> Option<&CheckResult> {
        self.checks.iter().find(|check| check.name == name)
    }

    /// Takes the ledger into the summary.
    pub fn set_balance(&mut self, balance: &Balance) {
        self.momentum_error = balance.momentum_error_max;
        let most = balance.angular_momentum_error().map(|[_, most]| most);
        self.angular_momentum_error = most;
        self.energy = EnergyLedger {
            start: balance.start(),
            end: balance.now,
            residual_max: balance.residual_max,
            transfer: balance.transfer_relative(),
            work_gap: balance.work_gap_relative(),
        };
    }
}

fn energies<'de, D: Deserializer<'de>>(from: D) -> Result<Energies, D::Error> {
    let numbers = BTreeMap::<String, Option<f64>>::deserialize(from)?;
    let numbers = numbers
        .into_iter()
        .map(|(name, number)| (name, number.unwrap_or(f64::NAN)));
    Energies::deserialize(MapDeserializer::new(numbers))
}

/// BLAKE3 over positions and velocities of points, then positions, angles, velocities and spins of bodies, each number
/// as eight little-endian bytes.
pub fn state_hash(points: &[PointState], bodies: &[BodyState]) -> String {
    let mut hasher = blake3::Hasher::new();
    let mut take = |numbers: &[f64]| {
        for number in numbers {
            hasher.update(&number.to_le_bytes());
        }
    };
    for p in points {
        take(&p.position);
        take(&p.velocity);
    }
    for b in bodies {
        take(&b.position);
        take(&[b.angle]);
        take(&b.velocity);
        take(&[b.spin]);
    }
    hasher.finalize().to_hex().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_status_is_named_as_it_is_written() {
        for status in [
            Status::Done,
            Status::CheckFailed,
            Status::Failed,
            Status::Unstable,
            Status::Interrupted,
            Status::Killed,
        ] {
            let written = serde_json::to_value(status).unwrap();
            assert_eq!(written, status.name());
        }
    }

    #[test]
    fn a_summary_is_read_as_it_was_written_and_another_version_is_refused() {
        let mut summary = Summary {
            version: VERSION,
            status: Status::CheckFailed,
            dt_bound_by: [("contact".to_owned(), 3)].into(),
            checks: vec![CheckResult {
                name: "height".into(),
                value: 0.1,
                ..CheckResult::default()
            }],
            ..Summary::default()
        };
        let json = |summary: &Summary| serde_json::to_vec(summary).unwrap();
        assert_eq!(Summary::parse(&json(&summary)).unwrap(), summary);
        // JSON has no number that is not finite.
        summary.checks[0].value = f64::NAN;
        summary.energy.start.total = f64::INFINITY;
        let read = Summary::parse(&json(&summary)).unwrap();
        assert!(read.checks[0].value.is_nan() && read.energy.start.total.is_nan());
        summary.version = VERSION + 1;
        let refused = Summary::parse(&json(&summary)).unwrap_err().to_string();
        assert!(refused.contains("has version 3, expected 2"), "{refused}");
        let refused = Summary::parse(b"{\"scene\": \"x\"}")
            .unwrap_err()
            .to_string();
        assert!(refused.contains("missing field `version`"), "{refused}");
    }

    #[test]
    fn the_hash_sees_the_last_bit() {
        let point = PointState {
            position: [0.1, 0.2],
            ..PointState::default()
        };
        let mut moved = point;
        moved.velocity[1] = f64::from_bits(1);
        assert_ne!(state_hash(&[point], &[]), state_hash(&[moved], &[]));
        assert_eq!(state_hash(&[point], &[]), state_hash(&[point], &[]));
    }
}
