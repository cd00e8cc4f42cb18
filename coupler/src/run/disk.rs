//! Waiting for a disk. Files are written in the background; if a writer is too far behind, the run waits. The solvers
//! know of it, so that the time does not count towards their deadlines.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use interface::session::START;
use interface::transport::domain::{Domain, WaitsForDisk};
use interface::transport::wait::{until, until_there};

/// Time between two looks.
const LOOK: Duration = Duration::from_millis(1);
/// A wait of this length is reported.
const NOTICE: Duration = Duration::from_secs(3);

/// The disk of a run, and the directory in which solvers see that the run waits for it.
#[derive(Debug, Default)]
pub(crate) struct Disk {
    domain: Option<Domain>,
    /// The run has not begun. That may take longer than solvers wait by themselves.
    starting: Option<WaitsForDisk>,
}

impl Disk {
    /// The disk of a run whose solvers are processes. If the run waits longer than usual for a solver to `start`, it may take
    /// longer than a solver that is ready would wait.
    pub fn of(domain: Domain, start: Duration) -> Self {
        Self {
            starting: (start > START).then(|| domain.waiting_for_disk()),
            domain: Some(domain),
        }
    }

    /// The run has begun.
    pub fn started(&mut self) {
        self.starting = None;
    }

    /// Waits while something `is_behind`; false if the run is to end `at_once` before.
    pub fn wait(&self, is_behind: impl Fn() -> bool, at_once: &AtomicBool) -> bool {
        let over = || (!is_behind() || at_once.load(Ordering::Relaxed)).then_some(());
        if !is_behind() {
            return true;
        }
        self.during(|| {
            if until(NOTICE, LOOK, over).is_none() {
                tracing::warn!(
                    "the disk does not accept data: the run waits for it (a second Ctrl-C does not)"
                );
                until_there(LOOK, over);
                tracing::info!("the run waits for the disk no more");
            }
            !is_behind()
        })
    }

    /// Does something that may take long because it writes.
    pub fn during<T>(&self, write: impl FnOnce() -> T) -> T {
        let _waits = self.domain.as_ref().map(Domain::waiting_for_disk);
        write()
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use interface::message::control::Party;
    use interface::transport::domain::OwnedDomain;

    use super::*;

    #[test]
    fn solvers_see_that_the_run_waits_for_its_disk() {
        let owned = OwnedDomain::create().unwrap();
        let domain = owned.domain();
        let disk = Disk::of(domain.clone(), START);
        let (held, looks) = (|| domain.held(Party::Mpm).is_some(), Cell::new(0));
        assert!(!held());
        let is_behind = || {
            looks.set(looks.get() + 1);
            // The first look is whether there is anything to wait for.
            assert_eq!(held(), looks.get() > 1);
            looks.get() < 5
        };
        assert!(disk.wait(is_behind, &AtomicBool::new(false)));
        assert_eq!((looks.get(), held()), (6, false));
    }

    /// A disk that did not answer kept a run, its solvers and its shared memory for ever, whatever was asked.
    #[test]
    fn a_run_that_is_to_end_at_once_does_not_wait_for_its_disk() {
        let at_once = AtomicBool::new(false);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                std::thread::sleep(Duration::from_millis(50));
                at_once.store(true, Ordering::Relaxed);
            });
            assert!(!Disk::default().wait(|| true, &at_once));
        });
    }
}
