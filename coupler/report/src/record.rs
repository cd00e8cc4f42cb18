//! What a run has left in its directory, as far as it can be read: a run that was killed has left less.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use coupler::record::check::{CheckResult, Meant};
use coupler::record::course::COURSE;
use coupler::scene::Scene;
use serde::Deserialize;

use crate::ReportError;
use crate::log::{self, Line};
use crate::table::Table;

/// What a run has left.
#[derive(Debug)]
pub struct Record {
    /// Its directory.
    pub path: PathBuf,
    /// What it has shown; `None` of a run that has not come to its end in order.
    pub summary: Option<Summary>,
    /// The scene as resolved, as it was written.
    pub scene_text: Option<String>,
    /// The same as a tree; empty where it cannot be read.
    pub written: toml::Table,
    /// The same as checked; `None` where this build refuses it.
    pub scene: Option<Scene>,
    /// What the scene asks for over time.
    pub history: Option<Table>,
    /// Energies and steps over time; `None` of a build that kept none.
    pub course: Option<Table>,
    /// What happened.
    pub log: Vec<Line>,
    /// What could not be read, for people.
    pub faults: Vec<String>,
}

/// `summary.json`. What a build does not say of a run is left at its default.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default)]
pub struct Summary {
    /// Name of the scene.
    pub scene: String,
    /// How the run ended.
    pub status: String,
    /// Why, unless it is done.
    pub reason: Option<String>,
    /// Steps that moved something.
    pub steps: u64,
    /// Simulated time in s.
    pub time: f64,
    /// Shortest and longest step in s.
    pub dt_min: Option<f64>,
    /// Likewise.
    pub dt_max: Option<f64>,
    /// Steps by what bound them.
    pub dt_bound_by: BTreeMap<String, u64>,
    /// Wall time in s.
    pub wall_s: f64,
    /// Wall time by process.
    pub wall_by_part: BTreeMap<String, Parts>,
    /// CPU time by process in s.
    pub cpu_s: BTreeMap<String, f64>,
    /// Material points.
    pub points: u64,
    /// Most of them near bodies at a time.
    pub imps_max: u64,
    /// Bodies.
    pub bodies: u64,
    /// Grants of steps.
    pub grants: u64,
    /// Intervals of equal steps.
    pub epochs: u64,
    /// Relative to the largest momentum seen.
    pub momentum_error: Option<f64>,
    /// The ledger at both ends.
    pub energy: Energy,
    /// Of the final state.
    pub state_hash: Option<String>,
    /// Of the scene.
    pub scene_hash: String,
    /// The verdicts.
    pub checks: Vec<Verdict>,
}

/// Wall time of a process in s.
#[derive(Debug, Clone, Copy, Default, PartialEq, Deserialize)]
#[serde(default)]
pub struct Parts {
    /// Computing.
    pub compute: f64,
    /// Copying to and from the channels.
    pub exchange: f64,
    /// Waiting for the others.
    pub wait: f64,
}

/// The ledger at both ends of a run, in J/m.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default)]
pub struct Energy {
    /// At the first measurement.
    pub start: BTreeMap<String, Option<f64>>,
    /// At the last.
    pub end: BTreeMap<String, Option<f64>>,
    /// Largest positive residual relative to the largest energy in play.
    pub residual_max: Option<f64>,
}

/// The verdict on a check. Numbers that could not be had are `None`.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default)]
pub struct Verdict {
    /// What was checked.
    pub name: String,
    /// What the run shows.
    pub value: Option<f64>,
    /// What the scene expects; empty of builds that do not say it.
    pub expected: Meant,
    /// What it should be.
    pub reference: Option<f64>,
    /// How far it is off.
    pub error: Option<f64>,
    /// How far it may be off.
    pub tolerance: Option<f64>,
    /// Whether it passes.
    pub pass: bool,
    /// Where the expected figure comes from.
    pub source: String,
    /// Unit of the value, of builds that say it.
    pub unit: Option<String>,
}

impl From<&CheckResult> for Verdict {
    /// As the summary has it.
    fn from(check: &CheckResult) -> Self {
        let number = |number: f64| Some(number).filter(|number| number.is_finite());
        Self {
            name: check.name.clone(),
            value: number(check.value),
            expected: check.expected.finite(),
            reference: number(check.reference),
            error: number(check.error),
            tolerance: number(check.tolerance),
            pass: check.pass,
            source: check.source.clone(),
            unit: None,
        }
    }
}

impl Record {
    /// Reads what a run has left.
    ///
    /// # Errors
    /// [`ReportError::NotARun`]; [`ReportError::File`] for a file that is there and cannot be opened.
    pub fn read(dir: &Path) -> Result<Self, ReportError> {
        let not_a_run = |what| ReportError::NotARun {
            path: dir.to_path_buf(),
            what,
        };
        if !dir.is_dir() {
            return Err(not_a_run("there is no such directory"));
        }
        let [summary, scene, history] =
            ["summary.json", "scene.toml", "history.csv"].map(|name| text(dir, name));
        let (summary, scene_text, history) = (summary?, scene?, history?);
        if summary.is_none() && scene_text.is_none() && history.is_none() {
            return Err(not_a_run(
                "no run was here: it has no summary.json, scene.toml or history.csv",
            ));
        }
        let mut faults = Vec::new();
        let summary = summary.and_then(|text| {
            let read = serde_json::from_str(&text);
            read.map_err(|e| faults.push(format!("summary.json cannot be read: {e}.")))
                .ok()
        });
        let written = scene_text.as_deref().map(str::parse::<toml::Table>);
        let written = written.transpose().unwrap_or_else(|error| {
            let words = error.message();
            faults.push(format!("scene.toml cannot be read: {words}."));
            None
        });
        let history = table("history.csv", history, &mut faults);
        let course = table(COURSE, text(dir, COURSE)?, &mut faults);
        let (log, unread) = log::parse(&text(dir, "log.jsonl")?.unwrap_or_default());
        if unread > 0 {
            faults.push(format!("log.jsonl has {unread} lines that cannot be read."));
        }
        Ok(Self {
            path: dir.to_path_buf(),
            summary,
            scene: Scene::load(&dir.join("scene.toml"), None, &[]).ok(),
            scene_text,
            written: written.unwrap_or_default(),
            history,
            course,
            log,
            faults,
        })
    }
}

/// The text of a file of the directory, if it is there. Bytes that are no text, as a machine that lost power may leave
/// them, become marks of such.
fn text(dir: &Path, name: &str) -> Result<Option<String>, ReportError> {
    let path = dir.join(name);
    match fs::read(&path) {
        Ok(bytes) => Ok(Some(String::from_utf8_lossy(&bytes).into_owned())),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(ReportError::file("read", &path)(error)),
    }
}

fn table(name: &str, text: Option<String>, faults: &mut Vec<String>) -> Option<Table> {
    match Table::parse(&text?) {
        Ok(table) => {
            let of_file = table.faults.iter().map(|fault| format!("{name}: {fault}."));
            faults.extend(of_file);
            Some(table)
        }
        Err(what) => {
            faults.push(format!("{name} cannot be read: {what}."));
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_run_is_refused_in_plain_words() {
        let dir = tempfile::tempdir().unwrap();
        let of = |path: &Path| Record::read(path).unwrap_err().to_string();
        assert!(of(&dir.path().join("x")).contains("there is no such directory"));
        let empty = of(dir.path());
        assert!(
            empty.contains("no run was here") && empty.contains("help:"),
            "{empty}"
        );
    }

    #[test]
    fn a_killed_run_is_read_as_far_as_it_has_come() {
        let dir = tempfile::tempdir().unwrap();
        fs::write(
            dir.path().join("history.csv"),
            "time [s],v [m/s]\n0,1\n0.1,",
        )
        .unwrap();
        fs::write(dir.path().join("summary.json"), "{\"scene\": \"x\", \"ste").unwrap();
        fs::write(dir.path().join("log.jsonl"), b"\xff\xfe{").unwrap();
        let record = Record::read(dir.path()).unwrap();
        assert_eq!(record.history.unwrap().rows(), 1);
        assert!(record.summary.is_none() && record.course.is_none());
        let faults = record.faults.join(" ");
        for name in ["summary.json", "history.csv", "log.jsonl"] {
            assert!(faults.contains(name), "{faults}");
        }
    }
}
