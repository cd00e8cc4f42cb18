//! Describes a run whose coupler was killed: it left a scene, a log and a history, and perhaps a checkpoint, but no
//! summary.

use std::path::Path;

use interface::files::{self, TABLE};

use crate::record::rundir::{COURSE, HISTORY, LOG, RunDir, RunDirError, SCENE, in_use};
use crate::record::summary::{SUMMARY, Status, Summary};
use crate::record::{Table, log};
use crate::run::account::Account;
use crate::run::checkpoint::file::{About, newest};
use crate::scene::Scene;

/// The progress of a run that ended without a summary.
#[derive(Debug, Clone, PartialEq)]
pub struct Killed {
    /// Number of steps, as far as `course.csv` shows.
    pub steps: u64,
    /// Time of the last row of the history in s.
    pub time: f64,
    /// The last warning or error of the log.
    pub last_message: Option<String>,
}

impl Killed {
    /// Looks at a run directory. `None` if there is a summary, no run, or a run that is alive.
    pub fn find(dir: &Path) -> Option<Self> {
        let ended = files::is_regular(dir, SCENE).unwrap_or(false)
            && !files::is_there(dir, SUMMARY)
            && !in_use(dir);
        ended.then(|| Self::read(dir))
    }

    fn read(dir: &Path) -> Self {
        let last = |name, is_asked: fn(&str) -> bool| {
            let table = Table::parse(&files::read_text(dir, name, TABLE).ok()?).ok()?;
            table.last(is_asked)
        };
        let steps = last(COURSE, |name| name.starts_with("steps by "));
        let log = files::read_text(dir, LOG, TABLE).unwrap_or_default();
        let loud = log::parse(&log).0.into_iter().rfind(log::Line::is_loud);
        Self {
            steps: steps.unwrap_or(0.0) as u64,
            time: last(HISTORY, |name| name == "time").unwrap_or(0.0),
            last_message: loud.map(|line| line.message().to_owned()),
        }
    }

    /// One sentence for the user.
    pub fn words(&self) -> String {
        let mut words = format!(
            "the run ended without a summary (its coupler was killed, the machine stopped, or the disk was full); its history ends at t = {:.6e} s",
            self.time
        );
        if let Some(message) = &self.last_message {
            words = format!("{words}; the last warning in log.jsonl: {message}");
        }
        words
    }

    /// Writes the summary that the run could not write, from its history, its log and its checkpoint, if there is one.
    ///
    /// # Errors
    /// As [`RunDir::write_summary`].
    pub fn write_summary(&self, scene: &Scene, dir: &RunDir) -> Result<Summary, RunDirError> {
        let mut account = Account::new(scene, false);
        account.cut_short = true;
        if let Ok((_, checkpoint, _)) = newest(dir.path(), &About::of(scene)) {
            account.resume(checkpoint.state.account);
        }
        let mut summary = account.summarise(&Ok(()));
        summary.status = Status::Killed;
        summary.reason = Some(self.words());
        summary.steps = summary.steps.max(self.steps);
        summary.time = summary.time.max(self.time);
        dir.write_summary(&summary)?;
        Ok(summary)
    }
}
