//! The lock of a run directory. It is held on a file in it, which says who holds it, and on the directory itself, which
//! cannot be removed while the run lives in it: so a second run is refused also where somebody has removed the file.

#![allow(clippy::disallowed_methods, reason = "a run directory, to lock it")]

use std::fs::{File, TryLockError};
use std::io::{self, ErrorKind, Seek, Write};
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::thread;
use std::time::Duration;

use interface::files::{self, How, SMALL};

use crate::record::error::{RunDirError, fail};

/// The file that the run in the directory keeps locked, with its process and command.
pub(super) const LOCK: &str = ".tandem.lock";

/// Number of tests of a lock that is held, and the time between them.
const LOOKS: usize = 5;
const LOOK: Duration = Duration::from_millis(20);

/// The lock, until it is dropped, whatever ends the process.
#[derive(Debug)]
pub(super) struct Lock {
    _file: File,
    _directory: File,
}

impl Lock {
    /// Locks a run directory.
    ///
    /// # Errors
    /// [`RunDirError`]: somebody has locked it, or it cannot be written.
    pub fn take(dir: &Path) -> Result<Self, RunDirError> {
        let path = dir.join(LOCK);
        let directory = open(dir).map_err(fail("open", dir))?;
        let mut file = files::open(dir, LOCK, How::Make).map_err(|error| match error.kind() {
            ErrorKind::InvalidInput => fail("lock", &path)(error),
            _ => fail("write in the run directory", dir)(error),
        })?;
        take(dir, &file, &path)?;
        take(dir, &directory, dir)?;
        let words = std::env::args_os().map(|word| word.to_string_lossy().into_owned());
        let words: Vec<String> = words.collect();
        let host = files::read_named_text(Path::new("/proc/sys/kernel/hostname"), SMALL);
        let host = host.unwrap_or_default();
        let holder = format!(
            "process {} on {} (`{}`)\n",
            std::process::id(),
            host.trim(),
            words.join(" ")
        );
        file.set_len(0)
            .and_then(|()| file.rewind())
            .and_then(|()| file.write_all(holder.as_bytes()))
            .map_err(fail("write", &path))?;
        Ok(Self {
            _file: file,
            _directory: directory,
        })
    }
}

/// Opens the directory itself: `.` is in no pipe, which would wait.
fn open(dir: &Path) -> io::Result<File> {
    File::open(dir.join("."))
}

/// Locks one of the two.
fn take(dir: &Path, locked: &File, path: &Path) -> Result<(), RunDirError> {
    // A process that tests the lock holds it for a moment.
    let mut taken = locked.try_lock();
    for _ in 0..LOOKS {
        if matches!(taken, Err(TryLockError::WouldBlock)) {
            thread::sleep(LOOK);
            taken = locked.try_lock();
        }
    }
    match taken {
        Ok(()) => Ok(()),
        Err(TryLockError::WouldBlock) => Err(RunDirError::InUse {
            path: dir.to_path_buf(),
            holder: holder(dir, locked),
        }),
        // Some cluster file systems have no locks, or none of directories; there a run works without.
        Err(TryLockError::Error(error))
            if path == dir || error.kind() == ErrorKind::Unsupported =>
        {
            tracing::warn!("{} cannot be locked: {error}", path.display());
            Ok(())
        }
        Err(TryLockError::Error(error)) => Err(fail("lock", path)(error)),
    }
}

/// Who holds a lock: the run that says so in the file, unless the system knows another process.
fn holder(dir: &Path, locked: &File) -> String {
    let said = files::read_text(dir, LOCK, SMALL).unwrap_or_default();
    let said = said.trim();
    let locks = files::read_named_text(Path::new("/proc/locks"), SMALL).unwrap_or_default();
    let inode = locked.metadata().map_or(0, |file| file.ino());
    let others = holders(&locks, inode);
    let is_named = |pid: &u32| said.starts_with(&format!("process {pid} "));
    match others.first() {
        Some(pid) if !others.iter().any(is_named) => {
            let name = files::read_named_text(Path::new(&format!("/proc/{pid}/comm")), SMALL);
            let name = name.unwrap_or_default();
            format!(
                "process {pid} (`{}`), which is not the run that {LOCK} names",
                name.trim()
            )
        }
        _ if said.is_empty() => "another run".to_owned(),
        _ => said.to_owned(),
    }
}

/// The processes that have locked the file of this number, from the text of `/proc/locks`.
fn holders(locks: &str, inode: u64) -> Vec<u32> {
    let of_line = |line: &str| {
        let words: Vec<&str> = line.split_whitespace().collect();
        let (kind, pid, file) = (*words.get(1)?, words.get(4)?, words.get(5)?);
        let of_file = file.rsplit(':').next()?.parse() == Ok(inode);
        (kind == "FLOCK" && of_file)
            .then(|| pid.parse().ok())
            .flatten()
    };
    locks.lines().filter_map(of_line).collect()
}

/// Whether a run directory has a running owner.
pub fn in_use(dir: &Path) -> bool {
    let is_held = |file: File| matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock));
    files::open(dir, LOCK, How::Read).is_ok_and(is_held) || open(dir).is_ok_and(is_held)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_holder_of_a_lock_is_found_by_the_number_of_its_file() {
        let locks = "1: FLOCK  ADVISORY  WRITE 4711 08:01:131079 0 EOF\n\
                     2: POSIX  ADVISORY  READ  12 08:01:131079 0 EOF\n\
                     2: -> FLOCK  ADVISORY  WRITE 13 08:01:131079 0 EOF\n\
                     3: FLOCK  ADVISORY  READ  14 00:2f:9 0 EOF\n";
        assert_eq!(holders(locks, 131_079), [4711]);
        assert_eq!(holders(locks, 9), [14]);
        assert!(holders(locks, 1).is_empty());
    }

    /// With the file gone, a second run took the directory of the first.
    #[test]
    fn a_lock_whose_file_was_removed_is_held_all_the_same() {
        let dir = tempfile::tempdir().unwrap();
        let lock = Lock::take(dir.path()).unwrap();
        std::fs::remove_file(dir.path().join(LOCK)).unwrap();
        assert!(in_use(dir.path()));
        let told = Lock::take(dir.path()).unwrap_err().to_string();
        assert!(
            told.contains(&format!("process {}", std::process::id())),
            "{told}"
        );
        drop(lock);
        assert!(!in_use(dir.path()));
        Lock::take(dir.path()).unwrap();
    }

    /// A lock that somebody else holds was told as one of the last run, which had ended.
    #[test]
    fn who_holds_the_lock_is_named_and_not_who_held_it_last() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(
            dir.path().join(LOCK),
            "process 1 on elsewhere (`tandem run`)\n",
        )
        .unwrap();
        let other = File::open(dir.path().join(LOCK)).unwrap();
        other.lock().unwrap();
        let told = Lock::take(dir.path()).unwrap_err().to_string();
        let me = format!("is in use by process {} (`", std::process::id());
        assert!(told.contains(&me) && told.contains("not the run"), "{told}");
    }
}
