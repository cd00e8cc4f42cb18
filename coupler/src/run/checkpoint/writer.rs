//! The times of checkpoints, and the thread that writes them while the run continues.

use std::time::Instant;

use interface::files::{self, How};

use super::file::{self, Checkpoint};
use crate::record::background::{Background, Mark};
use crate::record::fail;
use crate::record::rundir::{COURSE, HISTORY, RunDir, RunDirError};
use crate::scene::CheckpointPlan;

/// Number of checkpoints that are not deleted, besides those for other scenes: the newest one and the one before.
const KEPT: usize = 2;

/// Writes the checkpoints of a run.
#[derive(Debug)]
pub(crate) struct CheckpointWriter {
    plan: CheckpointPlan,
    /// When the last checkpoint was taken: wall time, and simulated time in s.
    last: (Instant, f64),
    /// Counts checkpoints.
    writer: Background<Taken>,
}

/// A checkpoint, and the marks that must be reached before it is written.
type Taken = (Box<Checkpoint>, Vec<Mark>);

impl CheckpointWriter {
    /// Writes checkpoints to `dir` from the simulated time `time` (s) on.
    pub fn begin(plan: CheckpointPlan, dir: &RunDir, time: f64) -> Self {
        let mut writer = WriterThread {
            dir: dir.clone(),
            synced: 0,
        };
        let write = move |(checkpoint, relies_on): Taken| {
            writer.write(&checkpoint, &relies_on);
            Ok(())
        };
        Self {
            plan,
            last: (Instant::now(), time),
            writer: Background::begin(0, write),
        }
    }

    /// Whether a checkpoint has to be taken at the simulated time `time` (s). While one is being written, none is.
    pub fn is_due(&self, time: f64) -> bool {
        let (when, at) = self.last;
        let wall = (self.plan.wall).is_some_and(|wall| when.elapsed().as_secs_f64() >= wall);
        let simulated = self.plan.time.is_some_and(|interval| time - at >= interval);
        (wall || simulated) && self.writer.behind() == 0
    }

    /// Whether one is being written and another one waits, so that no more should be taken.
    pub fn is_behind(&self) -> bool {
        self.writer.behind() > 1
    }

    /// Takes a checkpoint. It is written soon, after everything that it `relies_on`.
    pub fn take(&mut self, checkpoint: Checkpoint, relies_on: Vec<Mark>) {
        self.last = (Instant::now(), checkpoint.about.time);
        let given = self.writer.give((checkpoint.into(), relies_on), 1);
        given.expect("one that cannot be written is reported and passed over");
    }

    /// Waits until every checkpoint is on disk or was reported as not written.
    pub fn finish(&mut self) {
        let finished = self.writer.finish();
        finished.expect("one that cannot be written is reported and passed over");
    }
}

/// The state of the writing thread.
struct WriterThread {
    dir: RunDir,
    /// Frames that are on the disk.
    synced: usize,
}

impl WriterThread {
    /// Writes a checkpoint. One that cannot be written does not end the run, because the next one may succeed.
    fn write(&mut self, checkpoint: &Checkpoint, relies_on: &[Mark]) {
        if !relies_on.iter().all(Mark::is_reached) {
            // The run ends for that reason. This checkpoint would lack its rows or frames.
            return;
        }
        let frames = checkpoint.state.frames.times.len();
        let written = self.sync_outputs(self.synced..frames).and_then(|()| {
            self.synced = frames;
            self.write_file(checkpoint)
        });
        if let Err(error) = written {
            let time = checkpoint.about.time;
            tracing::warn!(
                "no checkpoint at t = {time:.6e} s: {error} ({})",
                error.advice()
            );
        }
    }

    fn sync_outputs(&self, frames: std::ops::Range<usize>) -> Result<(), RunDirError> {
        let dir = self.dir.path();
        let tables = [HISTORY, COURSE].map(str::to_owned).into_iter();
        for name in tables.chain(crate::record::frames::names(frames)) {
            if files::is_there(dir, &name) {
                let synced = files::open(dir, &name, How::Read).and_then(|file| file.sync_data());
                synced.map_err(fail("write", &dir.join(&name)))?;
            }
        }
        Ok(())
    }

    /// Writes the file under another name and then renames it, so that a reader sees only whole files.
    fn write_file(&self, checkpoint: &Checkpoint) -> Result<(), RunDirError> {
        let bytes = file::write(checkpoint);
        let name = file::name(&checkpoint.about);
        self.dir.replace(&name, &bytes, true)?;
        tracing::debug!(
            step = checkpoint.about.step,
            time = checkpoint.about.time,
            bytes = bytes.len(),
            "checkpoint"
        );
        for old in outdated(file::list(self.dir.path()), &name) {
            if let Err(error) = files::remove(self.dir.path(), &old) {
                tracing::warn!("{old} stays: {error}");
            }
        }
        Ok(())
    }
}

/// Which checkpoints are to be deleted once `name` is written; `all` of the directory are given newest first. Those of later
/// steps do not count: they are damaged, and the run goes on from an older one.
fn outdated(all: Vec<String>, name: &str) -> impl Iterator<Item = String> {
    let to_here = move |old: &String| !file::is_kept(old) && old.as_str() <= name;
    all.into_iter().filter(to_here).skip(KEPT)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// After damage to the two newest, each new checkpoint was deleted as the third.
    #[test]
    fn what_was_just_written_stays_whatever_later_steps_have_left() {
        let all = [
            "9.tandem",
            "8.tandem",
            "5.tandem",
            "4.kept.tandem",
            "3.tandem",
            "2.tandem",
        ];
        let outdated = |name| outdated(all.map(String::from).to_vec(), name);
        assert_eq!(outdated("5.tandem").collect::<Vec<_>>(), ["2.tandem"]);
        assert_eq!(
            outdated("9.tandem").collect::<Vec<_>>(),
            ["5.tandem", "3.tandem", "2.tandem"]
        );
    }
}
