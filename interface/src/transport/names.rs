//! The names of a run: its id, its directory, the files in it, and its segments in shared memory.

use std::path::PathBuf;

/// Where the directories of runs are, if it is set: for tests, and for machines on which `/dev/shm` cannot hold sockets.
pub(super) const RUNTIME_DIR: &str = "TANDEM_RUNTIME_DIR";
const DIRECTORY_PREFIX: &str = "tandem-";
pub(super) const SHARED_MEMORY: &str = "/dev/shm";
/// Locked by the coupler (clause O-4).
pub(super) const LOCK: &str = "lock";
/// What the file is called before the party's name that has the party's process (clause O-7).
pub(super) const PROCESS_PREFIX: &str = "pid-";
/// What the file is called before the process id that a solver locks (clause O-8).
pub(super) const JOINED_PREFIX: &str = "joined-";
/// There while the coupler waits for its disk (clause O-7).
pub(super) const WAITS_FOR_DISK: &str = "waits-coupler";
/// There in a run with a timeline: the path of its file.
pub(super) const TRACE: &str = "trace";
/// The file of the wake-ups between the parties (clause B-1).
pub(super) const WAKES: &str = "wakes";

/// Where the directories of runs are: beside the shared memory of their channels. There a file costs no disk, the path is
/// short enough for a socket, and what is left over is found wherever `TMPDIR` points to.
pub(super) fn runtime_dir() -> PathBuf {
    match std::env::var_os(RUNTIME_DIR) {
        Some(dir) if !dir.is_empty() => dir.into(),
        _ => SHARED_MEMORY.into(),
    }
}

/// The directory of the run `id`.
pub(super) fn root_of(id: &str) -> PathBuf {
    runtime_dir().join(format!("{DIRECTORY_PREFIX}{id}"))
}

/// What a directory's name has after the prefix of all runs.
pub(super) fn after_prefix(name: &str) -> Option<&str> {
    name.strip_prefix(DIRECTORY_PREFIX)
}

/// The segments of a run in shared memory.
pub(super) fn segments_of(id: &str) -> impl Iterator<Item = PathBuf> {
    let prefix = shared_memory_prefix(id);
    let entries = std::fs::read_dir(SHARED_MEMORY);
    let entries = entries.into_iter().flatten().flatten();
    let ours =
        entries.filter(move |entry| entry.file_name().to_string_lossy().starts_with(&prefix));
    ours.map(|entry| entry.path())
}

pub(super) fn shared_memory_prefix(id: &str) -> String {
    format!("tandem_{id}_")
}

/// Where the process `pid` makes the directory of the run `id`.
pub(super) fn draft_of(id: &str, pid: u32) -> PathBuf {
    runtime_dir().join(format!("{DIRECTORY_PREFIX}{id}.{pid}"))
}

/// The process that makes a run's directory in a draft, from what its name has after the prefix.
pub(super) fn maker_of_draft(name: &str) -> Option<&str> {
    let (id, pid) = name.split_once('.')?;
    let is_pid = !pid.is_empty() && pid.bytes().all(|b| b.is_ascii_digit());
    (is_id(id) && is_pid).then_some(pid)
}

/// A new id of a run.
pub(super) fn fresh_id() -> String {
    use std::hash::{BuildHasher, Hasher};
    // Seeded by the system's randomness; short, since socket paths are limited to 108 bytes.
    let mut hasher = std::hash::RandomState::new().build_hasher();
    hasher.write_u32(std::process::id());
    format!("{:08x}", hasher.finish() & 0xffff_ffff)
}

/// Whether [`fresh_id`] can have made it.
pub(super) fn is_id(id: &str) -> bool {
    id.len() == 8 && id.bytes().all(|b| b.is_ascii_hexdigit())
}
