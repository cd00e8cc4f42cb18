//! The domain of a run: a directory and a name prefix that no other run shares.
//!
//! Two runs, of one user or of two, cannot interfere, because iceoryx2 only sees names below its root path and with its
//! prefix. The coupler holds a file lock in the directory for as long as it lives. A process that can take that lock
//! knows that the coupler is gone, and the next run (or `tandem clean`) removes the files of a killed one
//! ([`crate::transport::remains`]).

#![allow(clippy::disallowed_methods, reason = "the private directory of a run")]

use std::ffi::OsString;
use std::fs::{self, DirBuilder, File, OpenOptions, Permissions, TryLockError};
use std::io;
use std::os::unix::ffi::{OsStrExt, OsStringExt};
use std::os::unix::fs::{DirBuilderExt, OpenOptionsExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use iceoryx2::prelude::{Config, FileName, SemanticString};
use rustix::fs::OFlags;
use thiserror::Error;

use crate::message::control::Party;
use crate::transport::liveness::{Hold, hold_of};
use crate::transport::names::{
    JOINED_PREFIX, LOCK, PROCESS_PREFIX, TRACE, WAITS_FOR_DISK, draft_of, fresh_id, root_of,
    segments_of, shared_memory_prefix,
};
use crate::transport::remains::remove;

/// What group and others may do with a file.
const OTHERS: u32 = 0o7077;
/// How long a run that ends waits for solvers to close their ports.
const CLOSING: Duration = Duration::from_secs(1);

/// The directory of a run cannot be created or joined.
#[derive(Debug, Error)]
pub enum DomainError {
    /// The directory or its lock cannot be made.
    #[error("cannot create the run's directory in shared memory, {path}: {source}")]
    Create {
        /// Where.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The file cannot be made by which a solver notes that it takes part.
    #[error("cannot note in {path} that this process takes part in the run: {source}")]
    Join {
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
    /// Joins the run `id`, which a coupler has created.
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

    /// Notes that this process takes part in the run (clause O-8), before it makes anything in shared memory: whoever
    /// removes a dead run keeps its directory until this is dropped, and so finds what this process makes meanwhile.
    ///
    /// # Errors
    /// [`DomainError::NoSuchRun`] when the run is over; [`DomainError::Join`].
    pub(crate) fn take_part(&self) -> Result<Part, DomainError> {
        let over = || DomainError::NoSuchRun(self.id.clone());
        let name = format!("{JOINED_PREFIX}{}", std::process::id());
        let (lock, path) = loop {
            let path = self.root.join(format!("{name}.{}", fresh_id()));
            match new_file(&path) {
                Ok(file) => break (file, path),
                Err(e) if e.kind() == io::ErrorKind::NotFound => return Err(over()),
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {}
                Err(source) => return Err(DomainError::Join { path, source }),
            }
        };
        match lock.try_lock() {
            Ok(()) => {}
            // Somebody looks whether this process takes part, which is done only while a run is removed.
            Err(TryLockError::WouldBlock) => return Err(over()),
            Err(TryLockError::Error(source)) => return Err(DomainError::Join { path, source }),
        }
        // In this order: who removes the run takes this lock away first and then looks for those that take part.
        if !self.root.join(LOCK).exists() {
            return Err(over());
        }
        Ok(Part { _lock: lock })
    }

    /// The run's segments in shared memory that are there now.
    pub fn segments(&self) -> Vec<PathBuf> {
        segments_of(&self.id).collect()
    }

    /// How many channels have a segment there: iceoryx2 makes one for each that ends in this.
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

    /// Lets all parties write a timeline to this file ([`crate::trace`]).
    ///
    /// # Errors
    /// Those of the system.
    pub fn note_trace(&self, path: &Path) -> io::Result<()> {
        fs::write(self.root.join(TRACE), path.as_os_str().as_bytes())
    }

    /// The file of the timeline, if there is one.
    pub(crate) fn trace(&self) -> Option<PathBuf> {
        let path = fs::read(self.root.join(TRACE)).ok()?;
        Some(OsString::from_vec(path).into())
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

    /// Removes every other user's access to the run's segments: iceoryx2 makes one that all may write,
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

/// That a process takes part in a run; to be dropped after its ports.
#[derive(Debug)]
pub(crate) struct Part {
    _lock: File,
}

/// While it is there, the coupler waits for its disk.
#[derive(Debug)]
pub struct WaitsForDisk(PathBuf);

impl Drop for WaitsForDisk {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.0);
    }
}

/// The coupler's ownership of a run's directory; dropping it removes the directory and the segments.
#[derive(Debug)]
pub struct OwnedDomain {
    domain: Domain,
    lock: File,
}

impl OwnedDomain {
    /// Creates the directory of a run with a new id.
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
        remove(&self.domain.id, CLOSING);
    }
}

/// A file that was not there, for this user alone.
fn new_file(path: &Path) -> io::Result<File> {
    OpenOptions::new()
        .create_new(true)
        .write(true)
        .mode(0o600)
        .open(path)
}

/// A new lock, held.
fn lock_in(directory: &Path) -> io::Result<File> {
    let lock = new_file(&directory.join(LOCK))?;
    lock.lock()?;
    Ok(lock)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transport::names::{SHARED_MEMORY, shared_memory_prefix};

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
}
