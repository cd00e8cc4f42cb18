//! The times of checkpoints, and the thread that writes them while the run continues.

use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{self, JoinHandle};
use std::time::Instant;

use super::file::{self, Checkpoint};
use interface::recording::RecordingSink;

use crate::record::background::Mark;
use crate::record::course::COURSE;
use crate::record::rundir::{HISTORY, RunDir, RunDirError, fail};
use crate::scene::CheckpointPlan;

/// Number of checkpoints that are not deleted, besides those for other scenes: the newest one and the one before.
const KEPT: usize = 2;

/// Writes the checkpoints of a run.
#[derive(Debug)]
pub(crate) struct CheckpointWriter {
    plan: CheckpointPlan,
    /// When the last checkpoint was taken: wall time, and simulated time in s.
    last: (Instant, f64),
    /// Number of checkpoints that are being written or wait.
    busy: Arc<AtomicUsize>,
    queue: Option<Sender<Taken>>,
    writer: Option<JoinHandle<()>>,
}

impl CheckpointWriter {
    /// Writes checkpoints to `dir` from the simulated time `time` (s) on. `sink` is where the run is recorded.
    pub fn begin(
        plan: CheckpointPlan,
        dir: &RunDir,
        time: f64,
        sink: Option<RecordingSink>,
    ) -> Self {
        let busy = Arc::new(AtomicUsize::new(0));
        let (queue, taken) = channel();
        let writer = WriterThread {
            dir: dir.clone(),
            sink,
            busy: busy.clone(),
        };
        Self {
            plan,
            last: (Instant::now(), time),
            busy,
            queue: Some(queue),
            writer: Some(thread::spawn(move || writer.write_all(&taken))),
        }
    }

    /// Whether a checkpoint has to be taken at the simulated time `time` (s). While one is being written, none is.
    pub fn is_due(&self, time: f64) -> bool {
        let (when, at) = self.last;
        let wall = self.plan.wall.is_some_and(|wall| when.elapsed() >= wall);
        let simulated = self.plan.time.is_some_and(|interval| time - at >= interval);
        (wall || simulated) && self.busy.load(Ordering::Acquire) == 0
    }

    /// Whether one is being written and another one waits, so that no more should be taken.
    pub fn is_behind(&self) -> bool {
        self.busy.load(Ordering::Acquire) > 1
    }

    /// Takes a checkpoint. It is written soon, after everything that it `relies_on`.
    pub fn take(&mut self, checkpoint: Checkpoint, relies_on: Vec<Mark>) {
        self.last = (Instant::now(), checkpoint.about.time);
        self.busy.fetch_add(1, Ordering::AcqRel);
        let sent = self
            .queue
            .as_ref()
            .map(|queue| queue.send((checkpoint.into(), relies_on)));
        assert!(
            matches!(sent, Some(Ok(()))),
            "the writer lives until the end"
        );
    }

    /// Waits until every checkpoint is on disk or was reported as not written.
    pub fn finish(&mut self) {
        self.queue = None;
        if let Some(writer) = self.writer.take() {
            writer
                .join()
                .expect("the writer of checkpoints does not panic");
        }
    }
}

impl Drop for CheckpointWriter {
    fn drop(&mut self) {
        self.finish();
    }
}

/// A checkpoint, and the marks that must be reached before it is written.
type Taken = (Box<Checkpoint>, Vec<Mark>);

/// The state of the writing thread.
struct WriterThread {
    dir: RunDir,
    sink: Option<RecordingSink>,
    busy: Arc<AtomicUsize>,
}

impl WriterThread {
    /// Writes all checkpoints. One that cannot be written does not end the run, because the next one may succeed.
    fn write_all(self, taken: &Receiver<Taken>) {
        let mut synced = 0;
        for (checkpoint, relies_on) in taken {
            let frames = checkpoint.state.frames.times.len();
            if !relies_on.iter().all(Mark::is_reached) {
                // The run ends for that reason. This checkpoint would lack its rows or frames.
                self.busy.fetch_sub(1, Ordering::AcqRel);
                continue;
            }
            if let Some(sink) = &self.sink {
                sink.sync();
            }
            let written = self.sync_outputs(synced..frames).and_then(|()| {
                synced = frames;
                self.write(&checkpoint)
            });
            if let Err(error) = written {
                let time = checkpoint.about.time;
                tracing::warn!(
                    "no checkpoint at t = {time:.6e} s: {error} ({})",
                    error.advice()
                );
            }
            self.busy.fetch_sub(1, Ordering::AcqRel);
        }
    }

    fn sync_outputs(&self, frames: std::ops::Range<usize>) -> Result<(), RunDirError> {
        let mut paths = [HISTORY, COURSE]
            .map(|table| self.dir.path().join(table))
            .to_vec();
        paths.extend(crate::record::frames::paths(self.dir.path(), frames));
        for path in paths.iter().filter(|path| path.exists()) {
            let synced = fs::File::open(path).and_then(|file| file.sync_data());
            synced.map_err(fail("write", path))?;
        }
        Ok(())
    }

    /// Writes the file under another name and then renames it, so that a reader sees only whole files.
    fn write(&self, checkpoint: &Checkpoint) -> Result<(), RunDirError> {
        let bytes = file::write(checkpoint);
        let name = file::name(&checkpoint.about);
        self.dir.write_durably(&name, &bytes)?;
        tracing::debug!(
            step = checkpoint.about.step,
            time = checkpoint.about.time,
            bytes = bytes.len(),
            "checkpoint"
        );
        let all = file::list(self.dir.path()).into_iter();
        for old in all.filter(|path| !file::is_kept(path)).skip(KEPT) {
            remove(&old);
        }
        Ok(())
    }
}

fn remove(path: &Path) {
    if let Err(error) = fs::remove_file(path) {
        tracing::warn!("{} stays: {error}", path.display());
    }
}
