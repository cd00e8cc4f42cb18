//! What runs that did the same have in common to the bit.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;

/// What a run has left that must be the same, by name.
pub type Bits = BTreeMap<String, Vec<u8>>;

/// What a run has left; none if it has no summary.
pub fn bits(dir: &Path) -> Option<Bits> {
    let summary = fs::read(dir.join("summary.json")).ok()?;
    let summary: Value = serde_json::from_slice(&summary).ok()?;
    let frames = fs::read_dir(dir.join("frames")).into_iter().flatten();
    let frames = frames.map(|entry| entry.unwrap().path());
    let tables = ["history.csv", "course.csv", "bodies.csv"].map(|name| dir.join(name));
    let read = |path: PathBuf| {
        let name = path.file_name()?.to_string_lossy().into_owned();
        Some((name, fs::read(path).ok()?))
    };
    let mut bits: Bits = frames.chain(tables).filter_map(read).collect();
    for key in ["state_hash", "steps"] {
        bits.insert(key.into(), summary[key].to_string().into());
    }
    Some(bits)
}
