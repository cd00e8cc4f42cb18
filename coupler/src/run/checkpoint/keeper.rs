//! When a checkpoint is due, and the thread that writes it while the run goes on.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};
use std::{fs, io};

use super::Checkpoint;
use super::file::{self, FOLDER};
use crate::record::rundir::{RunDir, RunDirError, fail};
use crate::scene::CheckpointPlan;

/// Checkpoints that are kept: the newest, and the one before.
const KEPT: usize = 2;

/// Keeps the checkpoints of a run.
#[derive(Debug)]
pub(crate) struct Keeper {
    plan: CheckpointPlan,
    /// When the last one was taken: wall time, and simulated time in s.
    last: (Instant, f64),
    /// One is being written or waits to be.
    busy: Arc<AtomicUsize>,
    queue: Option<SyncSender<Box<Checkpoint>>>,
    writer: Option<JoinHandle<Result<(), RunDirError>>>,
}

impl Keeper {
    /// Keeps checkpoints in `dir` from the simulated time `time` (s) on. `frames` counts those that are in their files.
    pub fn begin(
        plan: CheckpointPlan,
        dir: &RunDir,
        time: f64,
        frames: Option<Arc<AtomicUsize>>,
    ) -> Self {
        let busy = Arc::new(AtomicUsize::new(0));
        let (queue, taken) = sync_channel(1);
        let writer = Writer {
            dir: dir.clone(),
            folder: dir.path().join(FOLDER),
            frames,
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

    /// Whether one is to be taken at the simulated time `time` (s). While one is being written the next waits.
    pub fn is_due(&self, time: f64) -> bool {
        let (when, at) = self.last;
        let wall = self.plan.wall.is_some_and(|wall| when.elapsed() >= wall);
        let simulated = self.plan.time.is_some_and(|interval| time - at >= interval);
        (wall || simulated) && self.busy.load(Ordering::Acquire) == 0
    }

    /// Takes one, to be written soon.
    ///
    /// # Errors
    /// [`RunDirError`] when an earlier one could not be written.
    pub fn take(&mut self, checkpoint: Checkpoint) -> Result<(), RunDirError> {
        self.last = (Instant::now(), checkpoint.about.time);
        self.busy.fetch_add(1, Ordering::AcqRel);
        match self
            .queue
            .as_ref()
            .map(|queue| queue.send(checkpoint.into()))
        {
            Some(Ok(())) => Ok(()),
            // Nobody takes it: the writer has ended, and says why.
            _ => self.finish(),
        }
    }

    /// Everything taken so far is on disk.
    ///
    /// # Errors
    /// [`RunDirError`].
    pub fn finish(&mut self) -> Result<(), RunDirError> {
        self.queue = None;
        match self.writer.take() {
            Some(writer) => writer
                .join()
                .expect("the writer of checkpoints does not panic"),
            None => Ok(()),
        }
    }
}

impl Drop for Keeper {
    fn drop(&mut self) {
        // A run that has failed: its error is told, not that of its last checkpoint.
        let _ = self.finish();
    }
}

/// The writer's side.
struct Writer {
    dir: RunDir,
    folder: PathBuf,
    frames: Option<Arc<AtomicUsize>>,
    busy: Arc<AtomicUsize>,
}

impl Writer {
    fn write_all(self, taken: &Receiver<Box<Checkpoint>>) -> Result<(), RunDirError> {
        let mut synced = 0;
        for checkpoint in taken {
            let frames = checkpoint.state.frames.times.len();
            self.await_frames(frames);
            self.sync_outputs(synced..frames)?;
            synced = frames;
            self.write(&checkpoint)?;
            self.busy.fetch_sub(1, Ordering::AcqRel);
        }
        Ok(())
    }

    /// What the checkpoint relies on is written before it.
    fn await_frames(&self, count: usize) {
        while let Some(written) = &self.frames
            && written.load(Ordering::Acquire) < count
            // The run ends when the frames cannot be written: then this one is not needed.
            && Arc::strong_count(written) > 1
        {
            thread::sleep(Duration::from_millis(1));
        }
    }

    fn sync_outputs(&self, frames: std::ops::Range<usize>) -> Result<(), RunDirError> {
        let mut paths = vec![self.dir.path().join(crate::record::history::HISTORY)];
        paths.extend(crate::record::frames::paths(self.dir.path(), frames));
        for path in paths.iter().filter(|path| path.exists()) {
            let synced = fs::File::open(path).and_then(|file| file.sync_data());
            synced.map_err(fail("write", path))?;
        }
        Ok(())
    }

    /// Beside the others, then in their place: whoever reads sees whole ones only.
    fn write(&self, checkpoint: &Checkpoint) -> Result<(), RunDirError> {
        let bytes = file::write(checkpoint);
        let path = self.folder.join(file::name(checkpoint.about.step));
        let write = || -> io::Result<()> {
            fs::create_dir_all(&self.folder)?;
            let mut file = tempfile::NamedTempFile::new_in(&self.folder)?;
            io::Write::write_all(&mut file, &bytes)?;
            file.as_file().sync_all()?;
            file.persist(&path)?;
            fs::File::open(&self.folder)?.sync_all()
        };
        write().map_err(fail("write", &path))?;
        tracing::debug!(
            step = checkpoint.about.step,
            time = checkpoint.about.time,
            bytes = bytes.len(),
            "checkpoint"
        );
        for old in file::list(self.dir.path()).into_iter().skip(KEPT) {
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
