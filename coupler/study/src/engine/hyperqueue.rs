//! Runs as tasks of HyperQueue, which is reached through its Python package: that has no command.

use std::thread;
use std::time::Duration;

use interface::files::{self, SMALL};
use interface::transport::remains::sweep;
use interface::transport::wait::until_there;
use rustix::process::Signal;
use serde_json::json;

use super::local::{signal, spawn};
use super::start::{Place, Start};
use crate::StudyError;
use crate::output::write;

/// The program that talks to HyperQueue.
const SCRIPT: &str = include_str!("hyperqueue_runs.py");
/// Time for solvers to end whose run was killed.
const SOON: Duration = Duration::from_secs(5);
/// Time between two looks.
const LOOK: Duration = Duration::from_millis(100);

pub(super) fn work(
    starts: &[&Start],
    place: &Place,
    look: &mut dyn FnMut() -> usize,
) -> Result<(), StudyError> {
    let runs = starts
        .iter()
        .map(|start| json!({ "command": start.command, "log": start.log }));
    // Without a server, processors of a worker of our own: those of this machine, and enough for one run.
    let have = thread::available_parallelism().map_or(1, usize::from);
    let worker = place.jobs.map_or(have, |jobs| jobs * place.cores);
    let asked = json!({
        "runs": runs.collect::<Vec<_>>(),
        "cores": place.cores,
        "memory": place.memory,
        "worker": worker.max(place.cores),
    });
    let [file, log] = ["json", "err"].map(|end| place.runs.join("hyperqueue").with_extension(end));
    write(&file, asked.to_string())?;
    let words = ["python3", "-c", SCRIPT, &file.to_string_lossy()].map(str::to_owned);
    let mut child = spawn(&words, &log)?;
    let mut told = false;
    let status = until_there(LOOK, || {
        look();
        let looked = child.try_wait().transpose();
        if looked.is_none() && place.interrupted() && !told {
            told = true;
            // A worker of its own hears SIGTERM and leaves its server waiting; its tasks are killed with it. `python3` may be
            // a script that starts another process.
            signal(&child, Signal::KILL);
        }
        looked
    });
    let status = status.map_err(StudyError::file("wait for", &file))?;
    if place.interrupted() {
        sweep(SOON);
        return Ok(());
    }
    if status.success() {
        return Ok(());
    }
    let said = files::read_named_text(&log, SMALL).unwrap_or_default();
    let last = said
        .trim_end()
        .lines()
        .next_back()
        .unwrap_or("it said nothing");
    Err(StudyError::asked(
        format!("HyperQueue did not make the runs ({status}): {last}"),
        format!("{} has all that it said", log.display()),
    ))
}
