//! What a run has left in its directory, as far as it can be read: a run that was killed has left less.

use std::io;
use std::path::{Path, PathBuf};

use coupler::record::log::{self, Line};
use coupler::record::rundir::COURSE;
use coupler::record::{Summary, Table, fail};
use coupler::scene::Scene;
use coupler::scene::diagnostic::SceneErrors;
use interface::files::{self, TABLE};

use crate::ReportError;

/// What a run has left.
#[derive(Debug)]
pub struct Record {
    /// Its directory.
    pub path: PathBuf,
    /// What it has shown; `None` of a run that has not come to its end in order.
    pub summary: Option<Summary>,
    /// The scene as resolved, as it was written.
    pub scene_text: Option<String>,
    /// The same as checked; `None` where this build refuses it.
    pub scene: Option<Scene>,
    /// What the scene asks for over time.
    pub history: Option<Table>,
    /// Energies and steps over time.
    pub course: Option<Table>,
    /// What happened.
    pub log: Vec<Line>,
    /// What could not be read, for people.
    pub faults: Vec<String>,
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
            let read = Summary::parse(text.as_bytes());
            read.map_err(|e| faults.push(format!("{e}."))).ok()
        });
        let scene = scene_text.as_ref().and_then(|_| {
            let read = Scene::of_run(dir);
            let fault = |e: &SceneErrors| format!("scene.toml cannot be read: {}.", e.0[0].message);
            read.map_err(|errors| faults.push(fault(&errors))).ok()
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
            scene,
            scene_text,
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
    match files::read(dir, name, TABLE) {
        Ok(bytes) => Ok(Some(String::from_utf8(bytes).unwrap_or_else(|error| {
            String::from_utf8_lossy(error.as_bytes()).into_owned()
        }))),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(fail("read", &dir.join(name))(error).into()),
    }
}

fn table(name: &str, text: Option<String>, faults: &mut Vec<String>) -> Option<Table> {
    match Table::parse(&text?) {
        Ok(table) => {
            let of_file = table
                .faults
                .iter()
                .map(|fault| format!("{name}: {fault}; that is left out."));
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
    use std::fs;

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
