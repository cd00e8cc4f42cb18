//! A run's own corner of the machine: a directory and a name prefix that no other run shares, and their removal.
//!
//! Two runs, by one user or two, never meet, since iceoryx2 only sees names below its root path and with its prefix.
//! The coupler holds a file lock in the directory for as long as it lives; whoever can take that lock knows that the
//! coupler is gone, and the next run (or `tandem clean`) removes what a `kill -9` left behind.

use std::fs::{self, DirBuilder, File, OpenOptions, TryLockError};
use std::io;
use std::os::unix::fs::{DirBuilderExt, MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use iceoryx2::prelude::{Config, FileName, SemanticString};
use thiserror::Error;

use crate::message::control::Party;
use crate::transport::liveness::{Hold, hold_of};

/// Where the directories of runs are, if it is set: for tests, and for machines on which `/dev/shm` cannot hold sockets.
pub const RUNTIME_DIR: &str = "TANDEM_RUNTIME_DIR";
const DIRECTORY_PREFIX: &str = "tandem-";
const SHARED_MEMORY: &str = "/dev/shm";
const LOCK: &str = "lock";
/// There while the coupler waits for its disk (clause O-7).
const WAITS_FOR_DISK: &str = "waits-coupler";
/// A directory without a lock file that is older than this was left by a coupler killed while creating it.
const CREATION_GRACE: Duration = Duration::from_secs(10);

/// Creating or joining a run's corner failed.
#[derive(Debug, Error)]
pub enum DomainError {
    /// The directory or its lock cannot be made.
    #[error("cannot create the run's directory {path}: {source}")]
    Create {
        /// Where.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// There is no such run, or it is over.
    #[error("there is no run `{0}` to join on this machine (it may be over)")]
    NoSuchRun(String),
    /// The run id or the directory of runs cannot be a name in shared memory.
    #[error("`{0}` cannot be part of a shared-memory name")]
    Name(String),
}

/// The names under which one run communicates.
#[derive(Debug, Clone)]
pub struct Domain {
    id: String,
    root: PathBuf,
    /// The coupler's lock, open: it can be asked also after somebody has removed the file (systemd's `RemoveIPC`).
    lock: Arc<File>,
}

impl Domain {
    /// The corner of the run `id`, which a coupler has created.
    ///
    /// # Errors
    /// [`DomainError::NoSuchRun`] when it does not exist.
    pub fn join(id: &str) -> Result<Self, DomainError> {
        let plain =
            !id.is_empty() && id.len() <= 16 && id.bytes().all(|b| b.is_ascii_alphanumeric());
        let root = root_of(id);
        let lock = plain.then(|| File::open(root.join(LOCK)));
        match lock {
            Some(Ok(lock)) => Ok(Self {
                id: id.to_string(),
                root,
                lock: lock.into(),
            }),
            _ => Err(DomainError::NoSuchRun(id.into())),
        }
    }

    /// Whether the run's segments in shared memory and its directory are there, as they are until its end unless somebody
    /// else removes them.
    pub fn is_intact(&self) -> bool {
        let prefix = shared_memory_prefix(&self.id);
        let mut segments = fs::read_dir(SHARED_MEMORY).into_iter().flatten().flatten();
        let is_ours =
            |entry: &fs::DirEntry| entry.file_name().to_string_lossy().starts_with(&prefix);
        self.root.join(LOCK).is_file() && segments.any(|entry| is_ours(&entry))
    }

    /// The run's id.
    pub fn id(&self) -> &str {
        &self.id
    }

    /// The run's directory (clause O-2).
    pub fn directory(&self) -> &Path {
        &self.root
    }

    /// Whether the coupler that created the run still lives.
    pub fn coupler_lives(&self) -> bool {
        match self.lock.try_lock_shared() {
            Err(TryLockError::WouldBlock) => true,
            Ok(()) => {
                let _ = self.lock.unlock();
                false
            }
            Err(TryLockError::Error(_)) => false,
        }
    }

    /// Notes the process of a party (clause O-7), so that the others can see whether it runs. What goes wrong costs only
    /// that: its silence counts although it may be held.
    pub(crate) fn note_process(&self, party: Party, pid: u32) {
        if let Err(e) = fs::write(self.process_file(party), pid.to_string()) {
            tracing::debug!("the process of the {party} is not noted: {e}");
        }
    }

    /// Where the process of a party is noted.
    fn process_file(&self, party: Party) -> PathBuf {
        self.root.join(format!("pid-{}", party.name()))
    }

    /// To the others the coupler waits for its disk until this is dropped, and its silence does not count (clause O-7).
    pub fn waiting_for_disk(&self) -> WaitsForDisk {
        let path = self.root.join(WAITS_FOR_DISK);
        if let Err(e) = File::create(&path) {
            tracing::debug!("that the coupler waits for its disk is not noted: {e}");
        }
        WaitsForDisk(path)
    }

    /// A party besides `me` that lives and does not run, with why.
    pub fn held(&self, me: Party) -> Option<(Party, Hold)> {
        if me != Party::Coupler && self.root.join(WAITS_FOR_DISK).exists() {
            return Some((Party::Coupler, Hold::WaitsForDisk));
        }
        let others = [Party::Coupler, Party::Mpm, Party::Dem].into_iter();
        others.filter(|party| *party != me).find_map(|party| {
            let noted = fs::read_to_string(self.process_file(party)).ok()?;
            Some((party, hold_of(noted.parse().ok()?)?))
        })
    }

    /// The transport's configuration for this run; no configuration file is read.
    pub(crate) fn config(&self) -> Result<Config, DomainError> {
        let name = |e: &str| DomainError::Name(e.to_string());
        let mut config = Config::default();
        let prefix = shared_memory_prefix(&self.id);
        config.global.prefix = FileName::new(prefix.as_bytes()).map_err(|_| name(&prefix))?;
        let root = self.root.to_string_lossy();
        let root = iceoryx2::prelude::Path::new(root.as_bytes()).map_err(|_| name(&root))?;
        config.global.set_root_path(&root);
        // One run is one set of processes: who died is the coupler's business, and looking for dead nodes whenever
        // something opens costs 0.2 ms each time.
        config.global.service.cleanup_dead_nodes_on_open = false;
        config.global.node.cleanup_dead_nodes_on_creation = false;
        config.global.node.cleanup_dead_nodes_on_destruction = false;
        Ok(config)
    }
}

/// While it is there, the coupler waits for its disk.
#[derive(Debug)]
pub struct WaitsForDisk(PathBuf);

impl Drop for WaitsForDisk {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.0);
    }
}

/// The coupler's hold on a run's corner; dropping it removes everything.
#[derive(Debug)]
pub struct OwnedDomain {
    domain: Domain,
    lock: File,
}

impl OwnedDomain {
    /// A new corner with an id of its own.
    ///
    /// # Errors
    /// [`DomainError::Create`] when the directory of runs cannot be written.
    pub fn create() -> Result<Self, DomainError> {
        let fail = |path: &Path| {
            let path = path.to_path_buf();
            move |source| DomainError::Create { path, source }
        };
        loop {
            let id = fresh_id();
            let root = root_of(&id);
            match DirBuilder::new().mode(0o700).create(&root) {
                Ok(()) => {}
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists => continue,
                Err(e) => return Err(fail(&root)(e)),
            }
            let path = root.join(LOCK);
            let lock = OpenOptions::new()
                .create(true)
                .truncate(true)
                .write(true)
                .mode(0o600)
                .open(&path);
            let lock = match lock {
                Ok(lock) => lock,
                Err(e) if e.kind() == io::ErrorKind::NotFound => continue,
                Err(e) => return Err(fail(&path)(e)),
            };
            // A sweep of another run may have taken the lock before this one did, and has removed the directory or is
            // about to: then another id.
            match lock.try_lock() {
                Ok(()) if is_linked(&lock, &path) => {
                    let ours = File::open(&path).map_err(fail(&path))?;
                    let domain = Domain {
                        id,
                        root,
                        lock: ours.into(),
                    };
                    domain.note_process(Party::Coupler, std::process::id());
                    return Ok(Self { domain, lock });
                }
                Ok(()) | Err(TryLockError::WouldBlock) => {}
                Err(TryLockError::Error(e)) => return Err(fail(&root)(e)),
            }
        }
    }

    /// The names.
    pub fn domain(&self) -> &Domain {
        &self.domain
    }

    /// To everybody else the coupler is gone from now on: ends the waits of those who can no longer be told.
    pub fn release(&self) {
        if let Err(e) = self.lock.unlock() {
            tracing::debug!("the lock of run {} stays: {e}", self.domain.id);
        }
    }
}

impl Drop for OwnedDomain {
    fn drop(&mut self) {
        remove(&self.domain.id);
    }
}

/// Removes what dead runs of this user left behind; returns their ids.
pub fn sweep() -> Vec<String> {
    let Ok(entries) = fs::read_dir(runtime_dir()) else {
        return Vec::new();
    };
    let me = owner_of(Path::new("/proc/self/."));
    let mut swept = Vec::new();
    for entry in entries.flatten() {
        let name = entry.file_name();
        let Some(id) = name.to_str().and_then(|n| n.strip_prefix(DIRECTORY_PREFIX)) else {
            continue;
        };
        // Other things may be called `tandem-...` too: only what a run can have made is removed.
        if !is_id(id) || owner_of(&entry.path()) != me {
            continue;
        }
        // Held until everything is gone: a run that is just being created does not take what is about to be removed.
        let lock = File::open(entry.path().join(LOCK));
        let dead = match &lock {
            Ok(lock) => lock.try_lock().is_ok(),
            Err(_) => is_abandoned(&entry.path()),
        };
        if dead {
            remove(id);
            swept.push(id.to_string());
        }
    }
    swept
}

/// Whose it is; a link is its own, not that of what it leads to.
fn owner_of(path: &Path) -> Option<u32> {
    let found = fs::symlink_metadata(path).ok();
    found.filter(fs::Metadata::is_dir).map(|m| m.uid())
}

/// Whether `path` still leads to this open file.
fn is_linked(file: &File, path: &Path) -> bool {
    let number = |m: fs::Metadata| (m.dev(), m.ino());
    let (open, there) = (file.metadata().map(number), fs::metadata(path).map(number));
    matches!((open, there), (Ok(open), Ok(there)) if open == there)
}

/// Whether a coupler was killed before it had made a lock.
fn is_abandoned(root: &Path) -> bool {
    let age = fs::metadata(root)
        .and_then(|m| m.modified())
        .ok()
        .and_then(|t| SystemTime::now().duration_since(t).ok());
    let empty = fs::read_dir(root).is_ok_and(|mut inside| inside.next().is_none());
    empty && age.is_some_and(|age| age > CREATION_GRACE)
}

/// Whether [`fresh_id`] can have made it.
fn is_id(id: &str) -> bool {
    id.len() == 8 && id.bytes().all(|b| b.is_ascii_hexdigit())
}

/// Removes the run's shared-memory segments and its directory, the lock last: who is killed in between leaves what the
/// next sweep finds. Errors are left for it to meet too.
fn remove(id: &str) {
    let prefix = shared_memory_prefix(id);
    for entry in fs::read_dir(SHARED_MEMORY).into_iter().flatten().flatten() {
        if entry.file_name().to_string_lossy().starts_with(&prefix) {
            let _ = fs::remove_file(entry.path());
        }
    }
    let root = root_of(id);
    for entry in fs::read_dir(&root).into_iter().flatten().flatten() {
        if entry.file_name() == LOCK {
            continue;
        }
        let _ = if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            fs::remove_dir_all(entry.path())
        } else {
            fs::remove_file(entry.path())
        };
    }
    let _ = fs::remove_file(root.join(LOCK));
    let _ = fs::remove_dir(&root);
}

/// Where the directories of runs are: beside the shared memory of their channels. There a file costs no disk, the path is
/// short enough for a socket, and what is left over is found wherever `TMPDIR` points to.
fn runtime_dir() -> PathBuf {
    match std::env::var_os(RUNTIME_DIR) {
        Some(dir) if !dir.is_empty() => dir.into(),
        _ => SHARED_MEMORY.into(),
    }
}

fn root_of(id: &str) -> PathBuf {
    runtime_dir().join(format!("{DIRECTORY_PREFIX}{id}"))
}

fn shared_memory_prefix(id: &str) -> String {
    format!("tandem_{id}_")
}

fn fresh_id() -> String {
    use std::hash::{BuildHasher, Hasher};
    // Seeded by the system's randomness; short, since socket paths are limited to 108 bytes.
    let mut hasher = std::hash::RandomState::new().build_hasher();
    hasher.write_u32(std::process::id());
    format!("{:08x}", hasher.finish() & 0xffff_ffff)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_live_run_is_joined_and_survives_a_sweep_and_a_dropped_one_is_gone() {
        let owned = OwnedDomain::create().unwrap();
        let id = owned.domain().id().to_string();
        let joined = Domain::join(&id).unwrap();
        assert!(joined.coupler_lives());
        assert!(!sweep().contains(&id));
        assert!(root_of(&id).is_dir());
        owned.release();
        assert!(!joined.coupler_lives());
        drop(owned);
        assert!(!root_of(&id).exists());
        assert!(!joined.coupler_lives());
        assert!(matches!(Domain::join(&id), Err(DomainError::NoSuchRun(_))));
    }

    /// D3: systemd removes what a user has in shared memory when the user logs out.
    #[test]
    fn a_coupler_lives_whatever_becomes_of_its_files() {
        let owned = OwnedDomain::create().unwrap();
        let joined = Domain::join(owned.domain().id()).unwrap();
        assert!(!joined.is_intact(), "there are no segments");
        fs::remove_dir_all(joined.directory()).unwrap();
        assert!(joined.coupler_lives());
        owned.release();
        assert!(!joined.coupler_lives());
    }

    #[test]
    fn a_coupler_that_waits_for_its_disk_is_held_until_it_goes_on() {
        let owned = OwnedDomain::create().unwrap();
        let held = || owned.domain().held(Party::Mpm);
        assert_eq!(held(), None);
        let waits = owned.domain().waiting_for_disk();
        assert_eq!(held(), Some((Party::Coupler, Hold::WaitsForDisk)));
        assert_eq!(owned.domain().held(Party::Coupler), None);
        drop(waits);
        assert_eq!(held(), None);
    }

    #[test]
    fn what_a_killed_coupler_left_is_swept() {
        let id = fresh_id();
        let segment = Path::new(SHARED_MEMORY).join(format!("{}x", shared_memory_prefix(&id)));
        fs::write(&segment, b"x").unwrap();
        fs::create_dir(root_of(&id)).unwrap();
        File::create(root_of(&id).join(LOCK)).unwrap();
        // Another test's sweep may be the one that finds it, and be at it.
        let start = SystemTime::now();
        while root_of(&id).exists() && start.elapsed().is_ok_and(|t| t < CREATION_GRACE) {
            sweep();
        }
        assert!(!root_of(&id).exists());
        assert!(!segment.exists());
    }

    /// D1: a sweep let go of the lock before it removed, so a run that began meanwhile lost its directory.
    #[test]
    fn runs_begin_while_others_sweep() {
        let over = std::sync::atomic::AtomicBool::new(false);
        let relaxed = std::sync::atomic::Ordering::Relaxed;
        std::thread::scope(|scope| {
            let sweeps = scope.spawn(|| {
                while !over.load(relaxed) {
                    sweep();
                }
            });
            let lives = |_| {
                let owned = OwnedDomain::create().unwrap();
                let joined = Domain::join(owned.domain().id());
                joined.is_ok_and(|run| run.coupler_lives())
            };
            let lost = (0..2000).map(lives).filter(|lives| !lives).count();
            over.store(true, relaxed);
            assert_eq!(lost, 0);
            sweeps.join().unwrap();
        });
    }

    #[test]
    fn a_link_is_not_followed_to_a_run_of_somebody() {
        let owned = OwnedDomain::create().unwrap();
        let planted = root_of(&fresh_id());
        std::os::unix::fs::symlink(root_of(owned.domain().id()), &planted).unwrap();
        owned.release();
        sweep();
        assert!(
            fs::symlink_metadata(&planted).is_ok(),
            "the link is not ours"
        );
        fs::remove_file(&planted).unwrap();
    }

    #[test]
    fn what_no_run_has_made_is_not_swept() {
        let aged = |path: &Path| {
            let before = SystemTime::now() - 10 * CREATION_GRACE;
            File::open(path).unwrap().set_modified(before).unwrap();
        };
        // Somebody's directory that begins as ours do, and one named like a run but with something in it.
        let [notes, full, empty] = [format!("notes-{}", fresh_id()), fresh_id(), fresh_id()];
        for id in [&notes, &full, &empty] {
            fs::create_dir(root_of(id)).unwrap();
        }
        for id in [&notes, &full] {
            fs::write(root_of(id).join("dear.txt"), b"x").unwrap();
        }
        for id in [&notes, &full, &empty] {
            aged(&root_of(id));
        }
        sweep();
        assert!(root_of(&notes).is_dir() && root_of(&full).is_dir());
        assert!(!root_of(&empty).exists(), "left by a coupler killed early");
        for id in [&notes, &full] {
            fs::remove_dir_all(root_of(id)).unwrap();
        }
    }

    #[test]
    fn ids_that_are_paths_are_not_joined() {
        for id in ["", "../../etc", "a/b", "0123456789abcdef0"] {
            assert!(
                matches!(Domain::join(id), Err(DomainError::NoSuchRun(_))),
                "{id}"
            );
        }
    }
}
