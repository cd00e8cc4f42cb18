//! Waiting for a disk. Files are written in the background; if a writer is too far behind, the run waits. The solvers
//! are told, so that the time does not count towards their deadlines.

use std::thread;
use std::time::{Duration, Instant};

use interface::session::StartDeadlines;
use interface::transport::domain::{Domain, WaitsForDisk};

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
    /// The disk of a run whose solvers are processes. If the run has start limits of its own, it may take longer to
    /// start than a solver that is ready would wait.
    pub fn of(domain: Domain, start: StartDeadlines) -> Self {
        let usual = StartDeadlines::default();
        let longer = start.hello > usual.hello || start.ready > usual.ready;
        Self {
            starting: longer.then(|| domain.waiting_for_disk()),
            domain: Some(domain),
        }
    }

    /// The run has begun.
    pub fn started(&mut self) {
        self.starting = None;
    }

    /// Waits while something `is_behind`.
    pub fn wait(&self, is_behind: impl Fn() -> bool) {
        if !is_behind() {
            return;
        }
        self.during(|| {
            let began = Instant::now();
            let mut named = false;
            while is_behind() {
                if began.elapsed() >= NOTICE && !named {
                    named = true;
                    tracing::warn!("the disk does not accept data: the run waits for it");
                }
                thread::sleep(LOOK);
            }
            if named {
                tracing::info!("the disk accepts data again");
            }
        });
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
        let disk = Disk::of(domain.clone(), StartDeadlines::default());
        let (held, looks) = (|| domain.held(Party::Mpm).is_some(), Cell::new(0));
        assert!(!held());
        disk.wait(|| {
            looks.set(looks.get() + 1);
            // The first look is whether there is anything to wait for.
            assert_eq!(held(), looks.get() > 1);
            looks.get() < 5
        });
        assert_eq!((looks.get(), held()), (5, false));
    }
}
