//! The removal of what runs leave behind: a run's own files at its end, and those of runs whose coupler was killed.

#![allow(clippy::disallowed_methods, reason = "the private directories of runs")]

use std::ffi::OsString;
use std::fs::{self, File, TryLockError};
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::time::Duration;

use crate::transport::names::{
    JOINED_PREFIX, LOCK, PROCESS_PREFIX, TRACE, WAITS_FOR_DISK, WAKES, after_prefix, is_id,
    maker_of_draft, root_of, runtime_dir, segments_of, shared_memory_prefix,
};
use crate::transport::wait::until;

/// Time between two looks whether the solvers have closed their ports.
const LOOK: Duration = Duration::from_millis(1);

/// What a sweep has found; runs by their ids.
#[derive(Debug, Default)]
pub struct Swept {
    /// Dead runs of which nothing is left.
    pub removed: Vec<String>,
    /// Dead runs of which a solver still lives. Their directories stay: by them the next sweep finds what that solver may
    /// make meanwhile.
    pub inhabited: Vec<String>,
}

/// Removes what dead runs of this user left behind. The solvers of each have `patience` to end.
pub fn sweep(patience: Duration) -> Swept {
    let Ok(entries) = fs::read_dir(runtime_dir()) else {
        return Swept::default();
    };
    let me = owner_of(Path::new("/proc/self/."));
    let mut swept = Swept::default();
    for entry in entries.flatten() {
        let name = entry.file_name();
        let Some(id) = name.to_str().and_then(after_prefix) else {
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
            // Shared from then on: to the solvers of the run it is not the coupler that holds it.
            Ok(lock) => lock.try_lock().is_ok() && lock.try_lock_shared().is_ok(),
            Err(_) => is_remains(id, &entry.path()),
        };
        if dead {
            let ids = if remove(id, patience) {
                &mut swept.removed
            } else {
                &mut swept.inhabited
            };
            ids.push(id.to_string());
        }
    }
    swept
}

/// Whose it is; a link is its own, not that of what it leads to.
fn owner_of(path: &Path) -> Option<u32> {
    let found = fs::symlink_metadata(path).ok();
    found.filter(fs::Metadata::is_dir).map(|m| m.uid())
}

/// Whether all that is in the directory of the run `id` is what a run puts there: a sweep has begun, and was killed or
/// found a solver that still lived.
fn is_remains(id: &str, root: &Path) -> bool {
    let prefix = shared_memory_prefix(id);
    let is_ours = |name: &str| {
        let made = ["services", "nodes", WAITS_FOR_DISK, WAKES, TRACE].contains(&name);
        let begins = [PROCESS_PREFIX, JOINED_PREFIX, &prefix];
        made || begins.iter().any(|begin| name.starts_with(begin))
    };
    fs::read_dir(root).is_ok_and(|inside| {
        let mut names = inside.flatten().map(|entry| entry.file_name());
        names.all(|name| name.to_str().is_some_and(is_ours))
    })
}

/// Removes the run's shared-memory segments and its directory; whether nothing is left. Solvers that take part have
/// `patience` to close their ports. As long as one has not, the directory stays with the file that it has locked, since
/// whatever that solver still makes is found by the directory. Errors are left for the next sweep.
pub(super) fn remove(id: &str, patience: Duration) -> bool {
    let root = root_of(id);
    // First: a solver that notes after this that it takes part finds that the run is over, and makes nothing (O-8).
    // One that noted it before is seen below.
    let _ = fs::remove_file(root.join(LOCK));
    let mut present = Vec::new();
    until(patience, LOOK, || {
        present = taking_part(&root);
        present.is_empty().then_some(())
    });
    for segment in segments_of(id) {
        let _ = fs::remove_file(segment);
    }
    for entry in fs::read_dir(&root).into_iter().flatten().flatten() {
        if present.contains(&entry.file_name()) {
            continue;
        }
        let _ = if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            fs::remove_dir_all(entry.path())
        } else {
            fs::remove_file(entry.path())
        };
    }
    let _ = fs::remove_dir(&root);
    !root.exists()
}

/// The files by which solvers note that they take part (O-8) whose solvers live and have not closed their ports.
pub fn taking_part(root: &Path) -> Vec<OsString> {
    let entries = fs::read_dir(root).into_iter().flatten().flatten();
    let joined = entries.filter(|entry| {
        let name = entry.file_name();
        name.as_encoded_bytes()
            .starts_with(JOINED_PREFIX.as_bytes())
    });
    let locked = joined.filter(|entry| {
        // A solver's lock is exclusive; this one disturbs nobody who also looks.
        let lock = File::open(entry.path()).map(|file| file.try_lock_shared());
        matches!(lock, Ok(Err(TryLockError::WouldBlock)))
    });
    locked.map(|entry| entry.file_name()).collect()
}

#[cfg(test)]
mod tests {
    use std::sync::{Mutex, MutexGuard, PoisonError};
    use std::time::Instant;

    use super::*;
    use crate::transport::domain::{Domain, DomainError, OwnedDomain};
    use crate::transport::names::{SHARED_MEMORY, draft_of, fresh_id};

    /// Held by each test that sweeps, so that no other one sweeps what it has half made.
    fn alone() -> MutexGuard<'static, ()> {
        static SWEEPING: Mutex<()> = Mutex::new(());
        SWEEPING.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn sweep_now() -> Vec<String> {
        sweep(Duration::ZERO).removed
    }

    #[test]
    fn a_live_run_is_joined_and_survives_a_sweep_and_a_dropped_one_is_gone() {
        let _alone = alone();
        let owned = OwnedDomain::create().unwrap();
        let id = owned.domain().id().to_string();
        let joined = Domain::join(&id).unwrap();
        assert!(joined.coupler_lives());
        assert!(!sweep_now().contains(&id));
        assert!(root_of(&id).is_dir());
        owned.release();
        assert!(!joined.coupler_lives());
        drop(owned);
        assert!(!root_of(&id).exists());
        assert!(!joined.coupler_lives());
        assert!(matches!(Domain::join(&id), Err(DomainError::NoSuchRun(_))));
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
        sweep_now();
        assert!(!drafts.iter().any(|draft| draft.exists()));
        assert!(mine.is_dir(), "its process is still at it");
        fs::remove_dir(mine).unwrap();
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
            sweep_now();
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
                    sweep_now();
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
        sweep_now();
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
        // A solver that opened its channels, or began its part of a timeline, when the sweep had been there.
        fs::create_dir(root_of(&late).join("services")).unwrap();
        let event = format!("{}1.event", shared_memory_prefix(&late));
        fs::write(root_of(&late).join(event), b"x").unwrap();
        fs::write(root_of(&late).join(TRACE), b"x").unwrap();
        for id in [&notes, &full] {
            fs::write(root_of(id).join("dear.txt"), b"x").unwrap();
        }
        sweep_now();
        assert!(root_of(&notes).is_dir() && root_of(&full).is_dir());
        assert!(!root_of(&empty).exists(), "left by a sweep that was killed");
        assert!(!root_of(&late).exists(), "made after a sweep");
        for id in [&notes, &full] {
            fs::remove_dir_all(root_of(id)).unwrap();
        }
    }

    /// A solver created a segment while the run of its killed coupler was swept, and nobody found it again.
    #[test]
    fn what_a_solver_makes_after_a_sweep_is_found_by_the_next_one() {
        let _alone = alone();
        let owned = OwnedDomain::create().unwrap();
        let id = owned.domain().id().to_string();
        let joined = Domain::join(&id).unwrap();
        let part = joined.take_part().unwrap();
        owned.release();
        assert!(!sweep_now().contains(&id), "a solver is still there");
        let segment = Path::new(SHARED_MEMORY).join(format!("{}x", shared_memory_prefix(&id)));
        fs::write(&segment, b"x").unwrap();
        assert!(!sweep_now().contains(&id), "it still is");
        assert!(!segment.exists());
        fs::write(&segment, b"x").unwrap();
        drop(part);
        assert!(sweep_now().contains(&id));
        assert!(!segment.exists() && !root_of(&id).exists());
    }

    /// A solver of a killed coupler took the lock of whoever removed the run for that of its coupler, and lived on.
    #[test]
    fn a_coupler_is_seen_as_gone_while_its_run_is_removed() {
        let _alone = alone();
        let owned = OwnedDomain::create().unwrap();
        let joined = Domain::join(owned.domain().id()).unwrap();
        let part = joined.take_part().unwrap();
        owned.release();
        let removing = || !joined.directory().join(LOCK).exists();
        std::thread::scope(|scope| {
            let sweeps = scope.spawn(|| sweep(Duration::from_secs(3)));
            while !removing() && !sweeps.is_finished() {
                std::thread::sleep(LOOK);
            }
            let seen = (!sweeps.is_finished()).then(|| joined.coupler_lives());
            drop(part);
            assert_eq!(seen, Some(false));
        });
    }

    #[test]
    fn a_run_that_ends_waits_until_its_solvers_have_closed_their_ports() {
        let owned = OwnedDomain::create().unwrap();
        let id = owned.domain().id().to_string();
        let part = Domain::join(&id).unwrap().take_part().unwrap();
        std::thread::scope(|scope| {
            scope.spawn(|| {
                while root_of(&id).join(LOCK).exists() {
                    std::thread::sleep(LOOK);
                }
                drop(part);
            });
            drop(owned);
        });
        assert!(!root_of(&id).exists());
    }

    #[test]
    fn nobody_takes_part_in_a_run_that_has_been_swept() {
        let _alone = alone();
        let owned = OwnedDomain::create().unwrap();
        let joined = Domain::join(owned.domain().id()).unwrap();
        owned.release();
        sweep_now();
        let refused = joined.take_part();
        assert!(matches!(refused, Err(DomainError::NoSuchRun(_))));
        // A sweep that was killed has left the directory.
        fs::create_dir(joined.directory()).unwrap();
        let refused = joined.take_part();
        assert!(matches!(refused, Err(DomainError::NoSuchRun(_))));
        sweep_now();
        assert!(!joined.directory().exists());
    }

    #[test]
    fn solvers_join_while_their_run_is_swept() {
        let _alone = alone();
        let joins = |joined: &Domain| {
            let Ok(_part) = joined.take_part() else {
                return 0;
            };
            let prefix = shared_memory_prefix(joined.id());
            fs::write(Path::new(SHARED_MEMORY).join(format!("{prefix}x")), b"x").unwrap();
            1
        };
        let (mut took_part, rounds) = (0, 500);
        for _ in 0..rounds {
            let owned = OwnedDomain::create().unwrap();
            let joined = Domain::join(owned.domain().id()).unwrap();
            owned.release();
            std::thread::scope(|scope| {
                let solver = scope.spawn(|| joins(&joined));
                sweep_now();
                took_part += solver.join().unwrap();
            });
            sweep_now();
            assert_eq!(joined.segments(), Vec::<std::path::PathBuf>::new());
            assert!(!joined.directory().exists());
        }
        println!("{took_part} of {rounds} took part");
    }
}
