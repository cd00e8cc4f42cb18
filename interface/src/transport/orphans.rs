//! Segments in shared memory whose run has no directory any more.
//!
//! A solver can create a segment while a sweep removes the run of its killed coupler, and be killed in turn. Nothing leads to
//! that segment but its name. Somebody else's run may have its directory elsewhere (`TANDEM_RUNTIME_DIR`),
//! so a segment counts as an orphan only if no process has a segment of its run open or mapped.

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// The orphans among the files of `folder` that `uid` owns, by run. `run_of` tells the run from the name of a segment, and
/// `has_directory` whether that run has a directory.
pub(super) fn orphans(
    folder: &Path,
    uid: u32,
    run_of: impl Fn(&str) -> Option<String>,
    has_directory: impl Fn(&str) -> bool,
) -> BTreeMap<String, Vec<PathBuf>> {
    let mut found: BTreeMap<String, Vec<PathBuf>> = BTreeMap::new();
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let run = entry.file_name().to_str().and_then(&run_of);
        let owner = fs::symlink_metadata(entry.path()).map(|file| file.uid());
        if let Some(run) = run
            && owner.is_ok_and(|owner| owner == uid)
        {
            found.entry(run).or_default().push(entry.path());
        }
    }
    found.retain(|run, _| !has_directory(run));
    if !found.is_empty() {
        keep_unused(&mut found);
    }
    found
}

/// Leaves out the runs of which a process uses a segment.
fn keep_unused(found: &mut BTreeMap<String, Vec<PathBuf>>) {
    for process in fs::read_dir("/proc").into_iter().flatten().flatten() {
        let process = process.path();
        // Unreadable are those of others, and those that have ended meanwhile.
        let mapped = fs::read_to_string(process.join("maps")).unwrap_or_default();
        let open = fs::read_dir(process.join("fd")).into_iter().flatten();
        let open: Vec<PathBuf> = open
            .filter_map(|file| fs::read_link(file.ok()?.path()).ok())
            .collect();
        let uses = |segment: &PathBuf| {
            open.contains(segment) || segment.to_str().is_some_and(|name| mapped.contains(name))
        };
        found.retain(|_, segments| !segments.iter().any(uses));
    }
}

#[cfg(test)]
mod tests {
    use std::fs::File;

    use super::*;

    #[test]
    fn only_what_nobody_uses_and_no_directory_leads_to_is_an_orphan() {
        let folder = tempfile::tempdir().unwrap();
        let segment = |name: &str| folder.path().join(name);
        let all = ["a.left", "b.open", "b.closed", "c.listed", "other"];
        for name in all {
            fs::write(segment(name), b"x").unwrap();
        }
        let used = File::open(segment("b.open")).unwrap();
        let run_of = |name: &str| name.split_once('.').map(|(run, _)| run.to_owned());
        let find = |uid| orphans(folder.path(), uid, run_of, |run| run == "c");
        let me = fs::metadata("/proc/self").unwrap().uid();
        let one = |run: &str, names: &[&str]| {
            (run.to_owned(), names.iter().map(|n| segment(n)).collect())
        };
        assert_eq!(find(me), BTreeMap::from([one("a", &["a.left"])]));
        assert!(find(me + 1).is_empty(), "somebody else's");
        drop(used);
        let mut found = find(me);
        for segments in found.values_mut() {
            segments.sort();
        }
        assert_eq!(
            found,
            BTreeMap::from([one("a", &["a.left"]), one("b", &["b.closed", "b.open"])])
        );
    }
}
