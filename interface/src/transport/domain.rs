//! The domain of a run: a directory and a name prefix that no other run shares, and their removal.
//!
//! Two runs, of one user or of two, cannot interfere, because iceoryx2 only sees names below its root path and with its
//! prefix. The coupler holds a file lock in the directory for as long as it lives. A process that can take that lock
//! knows that the coupler is gone, and the next run (or `tandem clean`) removes the files of a killed one.

use std::fs::{self, DirBuilder, File, OpenOptions, Permissions, TryLockError};
use std::io;
use std::os::unix::fs::{DirBuilderExt, MetadataExt, OpenOptionsExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use iceoryx2::prelude::{Config, FileName, SemanticString};
use rustix::fs::OFlags;
use thiserror::Error;

use crate::message::control::Party;
use crate::transport::liveness::{Hold, hold_of};

/// Where the directories of runs are, if it is set: for tests, and for machines on which `/dev/shm` cannot hold sockets.
pub const RUNTIME_DIR: &str = "TANDEM_RUNTIME_DIR";
const DIRECTORY_PREFIX: &str = "tandem-";
const SHARED_MEMORY: &str = "/dev/shm";
const LOCK: &str = "lock";
/// What the file is called before the party's name that has the party's process.
const PROCESS_PREFIX: &str = "pid-";
/// What group and others may do with a file.
const OTHERS: u32 = 0o7077;
/// There while the coupler waits for its disk (clause O-7).
const WAITS_FOR_DISK: &str = "waits-coupler";

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

    /// The run's segments in shared memory that are there now.
    pub fn segments(&self) -> Vec<PathBuf> {
        segments_of(&self.id).collect()
    }

    /// How many channels and bells have a segment there: iceoryx2 makes one for each that ends in this.
    pub(crate) fn services(&self) -> usize {
        let segments = segments_of(&self.id);
        segments
            .filter(|path| path.extension().is_some_and(|end| end == "dynamic"))
            .count()
    }

    /// Whether the run's directory and these of its segments are still there. Those that there are once its channels have
    /// been created stay until its end, unless somebody else removes them.
    pub fn is_intact(&self, segments: &[PathBuf]) -> bool {
        self.root.join(LOCK).is_file() && segments.iter().all(|segment| segment.exists())
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
        self.root.join(format!("{PROCESS_PREFIX}{}", party.name()))
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
        let others = Party::ALL.into_iter();
        others.filter(|party| *party != me).find_map(|party| {
            let noted = fs::read_to_string(self.process_file(party)).ok()?;
            Some((party, hold_of(noted.parse().ok()?)?))
        })
    }

    /// Takes from everybody but this user what they may do with the run's segments: iceoryx2 makes one that all may write,
    /// since any user's nodes may meet in a domain, and whoever writes nonsense there keeps solvers from joining (D13).
    pub(crate) fn close_to_others(&self) {
        for segment in segments_of(&self.id) {
            // The file itself and not what a link of the same name leads to.
            let opened = OpenOptions::new()
                .read(true)
                .custom_flags(OFlags::NOFOLLOW.bits().cast_signed())
                .open(&segment);
            let closed = opened.and_then(|file| {
                let mode = file.metadata()?.permissions().mode();
                if mode & OTHERS == 0 {
                    return Ok(());
                }
                file.set_permissions(Permissions::from_mode(mode & !OTHERS))
            });
            if let Err(e) = closed {
                tracing::debug!("{} stays open to others: {e}", segment.display());
            }
        }
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
            // Made and locked under another name: whatever is called like a run has a lock that its coupler holds.
            let draft = draft_of(&id, std::process::id());
            DirBuilder::new()
                .mode(0o700)
                .create(&draft)
                .map_err(fail(&draft))?;
            // Whatever the umask, which iceoryx2 changes for a moment when it binds a socket in another thread.
            fs::set_permissions(&draft, fs::Permissions::from_mode(0o700)).map_err(fail(&draft))?;
            let locked = lock_in(&draft).and_then(|lock| fs::rename(&draft, &root).map(|()| lock));
            let lock = match locked {
                Ok(lock) => lock,
                // Somebody who cannot see this process has swept it.
                Err(e) if e.kind() == io::ErrorKind::NotFound => continue,
                Err(e) => {
                    let _ = fs::remove_dir_all(&draft);
                    // A run of this id is there.
                    if e.kind() == io::ErrorKind::DirectoryNotEmpty {
                        continue;
                    }
                    return Err(fail(&root)(e));
                }
            };
            let path = root.join(LOCK);
            let ours = File::open(&path).map_err(fail(&path))?;
            let domain = Domain {
                id,
                root,
                lock: ours.into(),
            };
            domain.note_process(Party::Coupler, std::process::id());
            return Ok(Self { domain, lock });
        }
    }

    /// The names.
    pub fn domain(&self) -> &Domain {
        &self.domain
    }

    /// From now on all others see the coupler as gone. It ends the waits of parties that no message reaches.
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
        if owner_of(&entry.path()) != me {
            continue;
        }
        if let Some(pid) = maker_of_draft(id) {
            if !Path::new("/proc").join(pid).exists() {
                let _ = fs::remove_dir_all(entry.path());
            }
            continue;
        }
        if !is_id(id) {
            continue;
        }
        // Held until everything is gone: a run that is just being created does not take what is about to be removed.
        let lock = File::open(entry.path().join(LOCK));
        let dead = match &lock {
            Ok(lock) => lock.try_lock().is_ok(),
            Err(_) => is_remains(id, &entry.path()),
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

/// Whether all that is in the directory of the run `id` is what a run puts there: a sweep was killed before its last
/// step, or a solver that had lost its coupler came to open a channel when the sweep was over.
fn is_remains(id: &str, root: &Path) -> bool {
    let prefix = shared_memory_prefix(id);
    let is_ours = |name: &str| {
        let made = ["services", "nodes", WAITS_FOR_DISK].contains(&name);
        made || name.starts_with(PROCESS_PREFIX) || name.starts_with(&prefix)
    };
    fs::read_dir(root).is_ok_and(|inside| {
        let mut names = inside.flatten().map(|entry| entry.file_name());
        names.all(|name| name.to_str().is_some_and(is_ours))
    })
}

/// A new lock, held.
fn lock_in(directory: &Path) -> io::Result<File> {
    let lock = OpenOptions::new()
        .create_new(true)
        .write(true)
        .mode(0o600)
        .open(directory.join(LOCK))?;
    lock.lock()?;
    Ok(lock)
}

/// Whether [`fresh_id`] can have made it.
fn is_id(id: &str) -> bool {
    id.len() == 8 && id.bytes().all(|b| b.is_ascii_hexdigit())
}

/// Removes the run's shared-memory segments and its directory, the lock last: who is killed in between leaves what the
/// next sweep finds. Errors are left for it to meet too.
fn remove(id: &str) {
    for segment in segments_of(id) {
        let _ = fs::remove_file(segment);
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

/// The segments of a run in shared memory.
fn segments_of(id: &str) -> impl Iterator<Item = PathBuf> {
    let prefix = shared_memory_prefix(id);
    let entries = fs::read_dir(SHARED_MEMORY).into_iter().flatten().flatten();
    let ours =
        entries.filter(move |entry| entry.file_name().to_string_lossy().starts_with(&prefix));
    ours.map(|entry| entry.path())
}

fn shared_memory_prefix(id: &str) -> String {
    format!("tandem_{id}_")
}

/// Where the process `pid` makes the directory of the run `id`.
fn draft_of(id: &str, pid: u32) -> PathBuf {
    runtime_dir().join(format!("{DIRECTORY_PREFIX}{id}.{pid}"))
}

/// The process that makes a run's directory in a draft, from what its name has after the prefix.
fn maker_of_draft(name: &str) -> Option<&str> {
    let (id, pid) = name.split_once('.')?;
    let is_pid = !pid.is_empty() && pid.bytes().all(|b| b.is_ascii_digit());
    (is_id(id) && is_pid).then_some(pid)
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
    use std::sync::{Mutex, MutexGuard, PoisonError};
    use std::time::{Duration, Instant};

    use super::*;

    /// Held by each test that sweeps, so that no other one sweeps what it has half made.
    fn alone() -> MutexGuard<'static, ()> {
        static SWEEPING: Mutex<()> = Mutex::new(());
        SWEEPING.lock().unwrap_or_else(PoisonError::into_inner)
    }

    #[test]
    fn a_live_run_is_joined_and_survives_a_sweep_and_a_dropped_one_is_gone() {
        let _alone = alone();
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
        let segment =
            Path::new(SHARED_MEMORY).join(format!("{}x", shared_memory_prefix(joined.id())));
        fs::write(&segment, b"x").unwrap();
        let there = joined.segments();
        assert_eq!(there, std::slice::from_ref(&segment));
        assert!(joined.is_intact(&there));
        fs::remove_file(&segment).unwrap();
        assert!(!joined.is_intact(&there), "a segment is missing");
        assert!(joined.is_intact(&[]));
        fs::remove_dir_all(joined.directory()).unwrap();
        assert!(!joined.is_intact(&[]), "its directory is missing");
        assert!(joined.coupler_lives());
        owned.release();
        assert!(!joined.coupler_lives());
    }

    /// D1: what a coupler left that was killed while it created its run stayed for ten seconds, or for ever.
    #[test]
    fn what_a_coupler_left_that_was_killed_while_it_began_is_swept_at_once() {
        let _alone = alone();
        let mut over = std::process::Command::new("true").spawn().unwrap();
        over.wait().unwrap();
        let (id, mine) = (fresh_id(), draft_of(&fresh_id(), std::process::id()));
        let drafts = [draft_of(&id, over.id()), draft_of(&fresh_id(), over.id())];
        for draft in drafts.iter().chain([&mine]) {
            fs::create_dir(draft).unwrap();
        }
        File::create(drafts[0].join(LOCK)).unwrap();
        sweep();
        assert!(!drafts.iter().any(|draft| draft.exists()));
        assert!(mine.is_dir(), "its process is still at it");
        fs::remove_dir(mine).unwrap();
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
        let _alone = alone();
        let id = fresh_id();
        let segment = Path::new(SHARED_MEMORY).join(format!("{}x", shared_memory_prefix(&id)));
        fs::write(&segment, b"x").unwrap();
        fs::create_dir(root_of(&id)).unwrap();
        File::create(root_of(&id).join(LOCK)).unwrap();
        // Another test's sweep may be the one that finds it, and be at it.
        let start = Instant::now();
        while root_of(&id).exists() && start.elapsed() < Duration::from_secs(10) {
            sweep();
        }
        assert!(!root_of(&id).exists());
        assert!(!segment.exists());
    }

    /// D1: a sweep let go of the lock before it removed, so a run that began meanwhile lost its directory.
    #[test]
    fn runs_begin_while_others_sweep() {
        let _alone = alone();
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
        let _alone = alone();
        let owned = OwnedDomain::create().unwrap();
        let id = fresh_id();
        let planted = root_of(&id);
        // A live run of the planted name: its segments went with the link.
        let segment = Path::new(SHARED_MEMORY).join(format!("{}x", shared_memory_prefix(&id)));
        fs::write(&segment, b"x").unwrap();
        std::os::unix::fs::symlink(root_of(owned.domain().id()), &planted).unwrap();
        owned.release();
        sweep();
        assert!(segment.exists(), "a segment behind a link was removed");
        fs::remove_file(&segment).unwrap();
        assert!(
            fs::symlink_metadata(&planted).is_ok(),
            "the link is not ours"
        );
        fs::remove_file(&planted).unwrap();
    }

    #[test]
    fn what_no_run_has_made_is_not_swept() {
        let _alone = alone();
        // Somebody's directory that begins as ours do, and one named like a run but with something in it.
        let [notes, full, empty, late] = [(); 4].map(|()| fresh_id());
        let notes = format!("notes-{notes}");
        for id in [&notes, &full, &empty, &late] {
            fs::create_dir(root_of(id)).unwrap();
        }
        // A solver that opened its channels when the sweep had been there.
        fs::create_dir(root_of(&late).join("services")).unwrap();
        let event = format!("{}1.event", shared_memory_prefix(&late));
        fs::write(root_of(&late).join(event), b"x").unwrap();
        for id in [&notes, &full] {
            fs::write(root_of(id).join("dear.txt"), b"x").unwrap();
        }
        sweep();
        assert!(root_of(&notes).is_dir() && root_of(&full).is_dir());
        assert!(!root_of(&empty).exists(), "left by a sweep that was killed");
        assert!(!root_of(&late).exists(), "made after a sweep");
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
