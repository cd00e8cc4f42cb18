//! What a run has left, to be compared byte for byte.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::command::read;

/// Tables that must be the same.
const TABLES: [&str; 3] = ["history.csv", "course.csv", "bodies.csv"];

/// What a run has left.
#[derive(Debug, Clone)]
pub struct RunResult {
    /// Its exit status.
    pub code: Option<i32>,
    /// Of the last state.
    pub state_hash: Option<String>,
    /// How many steps it took.
    pub steps: Option<u64>,
    /// Tables and frames.
    files: BTreeMap<String, Vec<u8>>,
}

impl RunResult {
    /// Of a directory with a summary.
    pub fn read(dir: &Path) -> Option<Self> {
        let summary: Value = serde_json::from_slice(&read(&dir.join("summary.json"))?).ok()?;
        let text = |key: &str| summary[key].as_str().map(str::to_owned);
        let mut files = BTreeMap::new();
        for name in TABLES {
            files.extend(read(&dir.join(name)).map(|bytes| (name.to_owned(), bytes)));
        }
        for entry in fs::read_dir(dir.join("frames"))
            .into_iter()
            .flatten()
            .flatten()
        {
            let name = format!("frames/{}", entry.file_name().to_string_lossy());
            files.extend(read(&entry.path()).map(|bytes| (name, bytes)));
        }
        Some(Self {
            code: None,
            state_hash: text("state_hash"),
            steps: summary["steps"].as_u64(),
            files,
        })
    }

    /// Of a run that ended with this exit status.
    #[must_use]
    pub fn that_ended(mut self, code: Option<i32>) -> Self {
        self.code = code;
        self
    }

    /// What differs from `other`, if something does.
    pub fn difference(&self, other: &Self) -> Option<String> {
        if self.state_hash != other.state_hash {
            return Some("the state hash".into());
        }
        if self.steps != other.steps {
            return Some("the number of steps".into());
        }
        let names = self.files.keys().chain(other.files.keys());
        let differs = |name: &&String| self.files.get(*name) != other.files.get(*name);
        names.into_iter().find(differs).map(|name| {
            match (
                self.files.contains_key(name),
                other.files.contains_key(name),
            ) {
                (true, true) => name.clone(),
                (true, false) => format!("{name}, which is missing"),
                _ => format!("{name}, which should not be there"),
            }
        })
    }

    /// What there is to compare.
    pub fn words(&self) -> String {
        let bytes: usize = self.files.values().map(Vec::len).sum();
        let files = self.files.len();
        let steps = self.steps.unwrap_or_default();
        format!("takes {steps} steps; {files} files of {bytes} bytes are compared")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn result(hash: &str, name: &str, bytes: &[u8]) -> RunResult {
        RunResult {
            code: Some(0),
            state_hash: Some(hash.into()),
            steps: Some(7),
            files: BTreeMap::from([(name.to_owned(), bytes.to_vec())]),
        }
    }

    #[test]
    fn the_first_difference_is_named() {
        let whole = result("a", "history.csv", b"1\n");
        assert_eq!(whole.difference(&whole), None);
        let other = |other: &RunResult| whole.difference(other).unwrap();
        assert_eq!(other(&result("b", "history.csv", b"1\n")), "the state hash");
        assert_eq!(other(&result("a", "history.csv", b"2\n")), "history.csv");
        let more = result("a", "bodies.csv", b"1\n");
        assert_eq!(other(&more), "history.csv, which is missing");
    }
}
