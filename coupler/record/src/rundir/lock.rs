//! The lock of a run directory. It is held on the directory itself, which cannot be removed while the run lives in it, and on
//! a file in it, because some file systems of clusters share locks of files but not those of directories. The file says who
//! holds both: the process and when it started, since the number of one that has ended may be given to another.

#![allow(clippy::disallowed_methods, reason = "a run directory, to lock it")]

use std::fs::{File, TryLockError};
use std::io::{self, ErrorKind, Seek, Write};
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::time::Duration;

use interface::files::{self, How, SMALL};
use interface::transport::wait::until;

use crate::error::{RunDirError, fail};

/// The file that the run in the directory keeps locked, with its process and command.
pub(super) const LOCK: &str = ".tandem.lock";

/// How long a lock that is held is tested, and the time between two tests.
const MOMENT: Duration = Duration::from_millis(100);
const LOOK: Duration = Duration::from_millis(20);

/// The lock, until it is dropped, whatever ends the process.
#[derive(Debug)]
pub(super) struct Lock {
    file: File,
    directory: File,
}

impl Drop for Lock {
    fn drop(&mut self) {
        // Closing does not unlock while a process that another thread starts has the files, too. It has them until its
        // program begins.
        for held in [&self.file, &self.directory] {
            let _ = held.unlock();
        }
    }
}

impl Lock {
    /// Locks a run directory.
    ///
    /// # Errors
    /// [`RunDirError`]: somebody has locked it, or it cannot be written.
    pub fn take(dir: &Path) -> Result<Self, RunDirError> {
        let path = dir.join(LOCK);
        let directory = open(dir).map_err(fail("open", dir))?;
        let file = files::open(dir, LOCK, How::Make).map_err(|error| match error.kind() {
            ErrorKind::InvalidInput => fail("lock", &path)(error),
            _ => fail("write in the run directory", dir)(error),
        })?;
        let mut lock = Self { file, directory };
        take(dir, &lock.directory, dir)?;
        take(dir, &lock.file, &path)?;
        let words = std::env::args_os().map(|word| word.to_string_lossy().into_owned());
        let words: Vec<String> = words.collect();
        let pid = std::process::id();
        let start = start_of(pid).unwrap_or_default();
        let words = words.join(" ");
        let holder = format!("process {pid} of tick {start} on {} (`{words}`)\n", host());
        let file = &mut lock.file;
        file.set_len(0)
            .and_then(|()| file.rewind())
            .and_then(|()| file.write_all(holder.as_bytes()))
            .map_err(fail("write", &path))?;
        Ok(lock)
    }

    /// Whether the directory is still at this path.
    ///
    /// # Errors
    /// It was moved or removed.
    pub fn is_at(&self, path: &Path) -> io::Result<()> {
        let [there, own] = [path.metadata()?, self.directory.metadata()?];
        if (there.dev(), there.ino()) == (own.dev(), own.ino()) {
            return Ok(());
        }
        Err(io::Error::new(
            ErrorKind::NotFound,
            "another directory is in its place",
        ))
    }
}

/// Opens the directory itself: `.` is in no pipe, which would wait.
fn open(dir: &Path) -> io::Result<File> {
    File::open(dir.join("."))
}

/// Locks one of the two.
fn take(dir: &Path, locked: &File, path: &Path) -> Result<(), RunDirError> {
    // A process that tests the lock holds it for a moment.
    let taken = until(MOMENT, LOOK, || match locked.try_lock() {
        Err(TryLockError::WouldBlock) => None,
        taken => Some(taken),
    });
    match taken {
        Some(Ok(())) => Ok(()),
        None => Err(RunDirError::InUse {
            path: dir.to_path_buf(),
            holder: holder(dir, locked),
        }),
        // Some cluster file systems have no locks, or none of directories; there a run works without.
        Some(Err(TryLockError::Error(error)))
            if path == dir || error.kind() == ErrorKind::Unsupported =>
        {
            tracing::warn!("{} cannot be locked: {error}", path.display());
            Ok(())
        }
        Some(Err(error)) => Err(fail("lock", path)(error.into()).into()),
    }
}

/// Who holds a lock: the run that says so in the file, if it lives and the system knows no other process.
fn holder(dir: &Path, locked: &File) -> String {
    let written = files::read_text(dir, LOCK, SMALL).unwrap_or_default();
    let inode = locked.metadata().map_or(0, |file| file.ino());
    holder_of(written.trim(), &holders_of(inode))
}

/// The processes that have locked the file of this number. The system's list may leave a lock out while others are taken and
/// released, so an empty answer is asked for again.
fn holders_of(inode: u64) -> Vec<u32> {
    let found = until(MOMENT, LOOK, || {
        let found = holders(&of_system("/proc/locks"), inode);
        (!found.is_empty()).then_some(found)
    });
    found.unwrap_or_default()
}

fn holder_of(written: &str, holders: &[u32]) -> String {
    match (owner(written), holders.first()) {
        (Some(owner), holder) if holder.is_none() || holders.contains(&owner) => written.to_owned(),
        (_, Some(pid)) => {
            let name = of_system(&format!("/proc/{pid}/comm"));
            format!("process {pid} (`{name}`), which is not a run that {LOCK} names")
        }
        (_, None) => {
            format!("a process that the system does not name; {LOCK} names none that lives")
        }
    }
}

/// The process that the text of the file names, unless it has ended on this machine.
fn owner(written: &str) -> Option<u32> {
    let (pid, rest) = written.strip_prefix("process ")?.split_once(" of tick ")?;
    let (start, rest) = rest.split_once(" on ")?;
    let pid = pid.parse().ok()?;
    let is_elsewhere = !rest.starts_with(&format!("{} (", host()));
    (is_elsewhere || start_of(pid).as_deref() == Some(start)).then_some(pid)
}

/// When a process of this machine has started, in ticks since the machine has.
fn start_of(pid: u32) -> Option<String> {
    let stat = of_system(&format!("/proc/{pid}/stat"));
    // The name stands in parentheses and may contain anything.
    let mut after_name = stat.rsplit_once(')')?.1.split_whitespace();
    after_name.nth(19).map(str::to_owned)
}

fn host() -> String {
    of_system("/proc/sys/kernel/hostname")
}

/// What the system says in this file, without the end of its last line; empty where it does not.
fn of_system(file: &str) -> String {
    let text = files::read_named_text(Path::new(file), SMALL);
    text.unwrap_or_default().trim_end().to_owned()
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
    let is_held = |file: File| {
        let refused = matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock));
        let _ = file.unlock();
        refused
    };
    files::open(dir, LOCK, How::Read).is_ok_and(is_held) || open(dir).is_ok_and(is_held)
}

#[cfg(test)]
mod tests {
    use std::io::Read;
    use std::sync::atomic::{AtomicBool, Ordering};

    use super::*;

    /// The list of the system, which is read by pieces, left out one lock in a few hundred while others came and went, and a
    /// run that had ended was named as the holder.
    #[test]
    fn a_holder_is_found_while_other_locks_come_and_go() {
        let held = tempfile::tempfile().unwrap();
        held.lock().unwrap();
        let inode = held.metadata().unwrap().ino();
        let is_over = AtomicBool::new(false);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                let others: Vec<File> = (0..150).map(|_| tempfile::tempfile().unwrap()).collect();
                while !is_over.load(Ordering::Relaxed) {
                    for other in &others {
                        other.lock().unwrap();
                    }
                    for other in &others {
                        other.unlock().unwrap();
                    }
                }
            });
            let missed = (0..3000).filter(|_| !holders_of(inode).contains(&std::process::id()));
            let missed = missed.count();
            is_over.store(true, Ordering::Relaxed);
            assert_eq!(missed, 0);
        });
    }

    /// The name of a run that had ended was shown for ever where the system does not show who holds the lock.
    #[test]
    fn a_process_that_has_ended_is_not_told_as_the_holder() {
        let me = std::process::id();
        let start = start_of(me).unwrap();
        let written = |start: &str| format!("process {me} of tick {start} on {} (`run`)", host());
        let (mine, earlier) = (written(&start), written("1"));
        for holders in [&[][..], &[me], &[1, me]] {
            assert_eq!(holder_of(&mine, holders), mine);
        }
        // The number was given again.
        for written in [&earlier, ""] {
            assert!(holder_of(written, &[]).contains("names none that lives"));
            assert!(holder_of(written, &[me]).starts_with(&format!("process {me} (`")));
        }
        let elsewhere = "process 1 of tick 1 on elsewhere (`run`)";
        assert_eq!(holder_of(elsewhere, &[]), elsewhere);
    }

    /// Somebody who may only read can lock the file: then no run is there, and the message names that process.
    #[test]
    fn a_directory_that_somebody_has_locked_by_reading_is_refused_with_the_process() {
        let dir = tempfile::tempdir().unwrap();
        drop(Lock::take(dir.path()).unwrap());
        for path in [dir.path().join(LOCK), dir.path().join(".")] {
            let other = std::process::Command::new("flock")
                .arg("-F")
                .arg(&path)
                .args(["sh", "-c", "echo; exec sleep 60"])
                .stdout(std::process::Stdio::piped())
                .spawn();
            let mut other = other.unwrap();
            other.stdout.take().unwrap().read_exact(&mut [0]).unwrap();
            let message = Lock::take(dir.path()).unwrap_err().to_string();
            assert!(
                message.contains(&format!("process {} (`", other.id())),
                "{message}"
            );
            other.kill().unwrap();
            other.wait().unwrap();
        }
    }
}
