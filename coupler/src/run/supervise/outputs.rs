//! The files that grow during a run, and its recording.

use interface::message::wire::BodyState;
use interface::recording::RecordingSink;

use crate::record::background::Mark;
use crate::record::frames::{Frames, Listed};
use crate::record::history::History;
use crate::record::progress::Progress;
use crate::record::rundir::{HISTORY, RunDir, RunDirError};
use crate::run::account::Account;
use crate::run::checkpoint::CouplerState;
use crate::run::course::Course;
use crate::run::options::RunOptions;
use crate::scene::Scene;

/// Bytes of a table that may wait for the disk.
const BEHIND: u64 = 4 << 20;

/// The files that a run writes while it runs.
pub(crate) struct Outputs {
    pub(super) history: History,
    pub(super) course: Course,
    /// `None` if the scene asks for no frames.
    pub(super) frames: Option<Frames>,
    /// The recording of all messages, if the run has one.
    pub(crate) sink: Option<RecordingSink>,
    pub(super) progress: Progress,
}

impl Outputs {
    /// New files, or those of a run that `continues`, as they were at its checkpoint. `start` are the bodies at their
    /// initial positions, if they are known.
    ///
    /// # Errors
    /// [`RunDirError`].
    pub(super) fn open(
        scene: &Scene,
        options: &RunOptions,
        dir: &RunDir,
        account: &Account,
        continues: Option<&CouplerState>,
        start: &[BodyState],
    ) -> Result<Self, RunDirError> {
        let header = account.recorder.header();
        let history = History::open(dir, HISTORY, &header, continues.map(|at| &at.history))?;
        let course = Course::open(dir, continues.map(|at| &at.course))?;
        let listed = continues.map_or_else(Listed::default, |at| at.frames.clone());
        let (mpm, dem) = (scene.mpm.is_some(), scene.dem.as_ref());
        let frames = || Frames::resume(dir, mpm, dem, &scene.output.content, listed, start);
        Ok(Self {
            history,
            course,
            frames: scene.output.frames.map(|_| frames()).transpose()?,
            sink: None,
            progress: Progress::new(scene.time.end, options.progress, options.screen.clone()),
        })
    }

    /// Whether so much waits for the disk that nothing should be added.
    pub(super) fn is_behind(&self) -> bool {
        self.history.behind().max(self.course.rows.behind()) > BEHIND
            || self.frames.as_ref().is_some_and(Frames::is_behind)
            || self.sink.as_ref().is_some_and(RecordingSink::is_behind)
    }

    /// Begins to write all rows so far. When the marks are reached, rows and frames are in their files.
    ///
    /// # Errors
    /// [`RunDirError`].
    pub(super) fn flush(&mut self) -> Result<Vec<Mark>, RunDirError> {
        let mut marks = vec![self.history.flush()?, self.course.rows.flush()?];
        marks.extend(self.frames.as_ref().map(Frames::mark));
        Ok(marks)
    }

    /// Waits until tables and frames are written; returns the results of both.
    pub(super) fn finish(&mut self) -> [Result<(), RunDirError>; 2] {
        self.progress.finish();
        let tables = self.history.finish().and(self.course.rows.finish());
        let frames = self.frames.as_mut().map_or(Ok(()), Frames::finish);
        // A checkpoint waits for the frames that it lists, so their writer ends first.
        self.frames = None;
        [tables, frames]
    }
}
