//! A run as its page while it goes on: the page is made again when the run has written something, and loads itself again.

use std::path::Path;
use std::time::{Duration, Instant, SystemTime};

use coupler::record::fail;
use coupler::record::rundir::{COURSE, FRAME_LIST, HISTORY, in_use, is_to_be_replaced};
use interface::files::{self, How};
use interface::session::cpu_time;
use interface::transport::wait::until;

use crate::ReportError;
use crate::page::page;
use crate::record::Record;

/// Name of the page in the run directory: no run writes a file of this name, and so none takes it away.
pub const LIVE: &str = "live.html";
/// Time between two looks at the run's files, and between two looks at whether to stop.
const LOOK: Duration = Duration::from_secs(1);
const TICK: Duration = Duration::from_millis(100);
/// After a page there is no other for so many times the CPU time that it took: a run may need the processor, and pages of
/// large runs take long. Not the wall time: beside other work a page of a second would be the only one for an hour.
const REST: u32 = 60;

/// Keeps the page of the run in `dir` up to date until the run has ended or `stop` says so; `shown` gets the first page, or
/// before it with `None` that there is nothing to show yet.
/// It reads what the run has written, and writes the page only.
///
/// # Errors
/// [`ReportError`]: what the run has left cannot be read, or the page cannot be written.
pub fn follow(
    dir: &Path,
    stop: impl Fn() -> bool,
    mut shown: impl FnMut(Option<&Path>),
) -> Result<(), ReportError> {
    let path = dir.join(LIVE);
    let [mut is_shown, mut waits] = [false; 2];
    let mut seen = None;
    let mut rested = Instant::now();
    loop {
        // In this order: after its end the run writes nothing more.
        let ended = !in_use(dir) || stop();
        let written = state(dir);
        if ended || (seen.as_ref() != Some(&written) && Instant::now() >= rested) {
            seen = Some(written);
            let begun = cpu_time();
            // The one that goes on has nothing to show then.
            let is_earlier = !ended && is_to_be_replaced(dir);
            // A run that has just begun has no history to show.
            match Record::read(dir) {
                Ok(record) if record.history.is_some() && !is_earlier => {
                    let rest = || LOOK.max(REST * cpu_time().saturating_sub(begun));
                    let html = page(&[record], (!ended).then(rest));
                    let written = files::replace(dir, LIVE, html.as_bytes(), false);
                    written.map_err(fail("write", &path))?;
                    rested = Instant::now() + rest();
                    if !is_shown {
                        shown(Some(&path));
                    }
                    is_shown = true;
                }
                Ok(_) | Err(ReportError::NotARun { .. }) => {
                    if !waits && !is_shown {
                        shown(None);
                    }
                    waits = true;
                }
                Err(error) => return Err(error),
            }
        }
        if ended {
            return Ok(());
        }
        until(LOOK, TICK, || stop().then_some(()));
    }
}

/// Size and time of what a run writes to while it goes on.
fn state(dir: &Path) -> Vec<Option<(u64, SystemTime)>> {
    let names = [HISTORY, COURSE, "log.jsonl", "summary.json", FRAME_LIST];
    let of = |name: &str| {
        let file = files::open(dir, name, How::Read).ok()?.metadata().ok()?;
        Some((file.len(), file.modified().ok()?))
    };
    names.into_iter().map(of).collect()
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use coupler::record::rundir::RunDir;

    use super::*;

    /// It was shown as "Under way".
    #[test]
    fn an_earlier_run_is_not_shown_as_the_one_that_begins() {
        let dir = tempfile::tempdir().unwrap();
        let earlier = RunDir::create(dir.path(), "").unwrap();
        earlier.replace(HISTORY, b"time [s]\n0\n", false).unwrap();
        drop(earlier);
        let _new = RunDir::create(dir.path(), "").unwrap();
        let (asked, mut shown) = (Cell::new(0), Vec::new());
        // Looks once while the run goes on, and once at its end.
        let stop = || asked.replace(asked.get() + 1) > 0;
        follow(dir.path(), stop, |page| shown.push(page.is_some())).unwrap();
        assert_eq!(shown, [false, true]);
    }
}
