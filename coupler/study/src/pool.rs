//! What starts runs: processes of this machine, so many at once. The run directories alone show what has ended, so that a
//! process may as well be one that waits for a queue, and a run whose node was lost may be started again.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

use coupler::record::fail;
use interface::files;
use interface::transport::wait::{until, until_there};
use rustix::process::{Pid, Signal, kill_process_group};

use crate::StudyError;

/// Time between two looks at a run.
const LOOK: Duration = Duration::from_millis(5);
/// Time between two looks at all of them.
const IDLE: Duration = Duration::from_millis(100);

/// A run that is to be made.
#[derive(Debug)]
pub(crate) struct Start {
    /// Its words.
    pub command: Vec<String>,
    /// File of its standard error.
    pub log: PathBuf,
}

impl Start {
    /// As a line for a shell.
    pub fn line(&self) -> String {
        let words = self.command.iter().map(String::as_str);
        shlex::try_join(words).expect("paths on a command line have no zero byte")
    }
}

/// Works on items, at most so many at once, in their order as far as that goes; `idle` is called now and then.
///
/// # Errors
/// The first that `work` gave.
pub(crate) fn pool<T: Sync>(
    items: &[T],
    most: usize,
    work: impl Fn(&T) -> Result<(), StudyError> + Sync,
    idle: &mut dyn FnMut(),
) -> Result<(), StudyError> {
    let next = AtomicUsize::new(0);
    let failure = OnceLock::new();
    let take = || {
        while let Some(item) = items.get(next.fetch_add(1, Ordering::Relaxed)) {
            if let Err(error) = work(item) {
                let _ = failure.set(error);
                // The others find no more to start.
                next.fetch_max(items.len(), Ordering::Relaxed);
            }
        }
    };
    thread::scope(|scope| {
        let threads: Vec<_> = (0..most.min(items.len()))
            .map(|_| scope.spawn(take))
            .collect();
        let all_done = || {
            let mut all = threads.iter();
            all.all(thread::ScopedJoinHandle::is_finished).then_some(())
        };
        while until(IDLE, LOOK, all_done).is_none() {
            idle();
        }
    });
    failure.into_inner().map_or(Ok(()), Err)
}

/// Starts a run and waits for its end; an interrupt is passed on, and after one none is started.
pub(crate) fn wait(start: &Start, interrupt: &AtomicBool) -> Result<(), StudyError> {
    if interrupt.load(Ordering::Relaxed) {
        return Ok(());
    }
    let mut child = spawn(&start.command, &start.log)?;
    let program = Path::new(&start.command[0]);
    let mut announced = false;
    let ended = until_there(LOOK, || {
        let looked = child.try_wait().transpose();
        if looked.is_none() && interrupt.load(Ordering::Relaxed) && !announced {
            announced = true;
            // It may have ended meanwhile, which the next look finds out.
            if let Some(group) = i32::try_from(child.id()).ok().and_then(Pid::from_raw) {
                let _ = kill_process_group(group, Signal::TERM);
            }
        }
        looked
    });
    ended.map_err(fail("wait for", program))?;
    Ok(())
}

/// Starts a command in a group of its own, so that Ctrl-C from the terminal reaches it once, through us.
fn spawn(command: &[String], log: &Path) -> Result<Child, StudyError> {
    use std::os::unix::process::CommandExt;
    let (program, arguments) = command.split_first().expect("a command has a first word");
    let log_file = files::make_named(log).map_err(fail("create", log))?;
    let child = Command::new(program)
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(log_file)
        .process_group(0)
        .spawn()
        .map_err(fail("start", Path::new(program)))?;
    Ok(child)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pool_is_bounded_does_all_and_stops_at_an_error() {
        let [now, most, sum] = [0; 3].map(AtomicUsize::new);
        let items: Vec<u64> = (0..40).collect();
        let work = |k: &u64| {
            most.fetch_max(now.fetch_add(1, Ordering::Relaxed) + 1, Ordering::Relaxed);
            thread::sleep(Duration::from_millis((40 - k) % 7));
            now.fetch_sub(1, Ordering::Relaxed);
            sum.fetch_add(*k as usize, Ordering::Relaxed);
            Ok(())
        };
        pool(&items, 3, work, &mut || ()).unwrap();
        assert_eq!(sum.load(Ordering::Relaxed), (0..40).sum::<usize>());
        assert!((2..=3).contains(&most.load(Ordering::Relaxed)));
        let begun = AtomicUsize::new(0);
        let fails = |_: &u64| -> Result<(), _> {
            begun.fetch_add(1, Ordering::Relaxed);
            Err(StudyError::Interrupted)
        };
        assert!(pool(&items, 3, fails, &mut || ()).is_err());
        assert!(begun.load(Ordering::Relaxed) <= 3);
    }
}
