//! `history.csv`: one row for each output; rows are complete even if this process is killed.

use std::fs::File;
use std::io::{Seek, SeekFrom, Write};
use std::path::PathBuf;
use std::time::{Duration, Instant};

use blake3::Hasher;
use interface::files::How;

use super::background::{Background, Mark, appends};
use super::error::fail;
use super::rundir::{RunDir, RunDirError};
use super::seal::Sealed;

/// Buffer for rows that are not in the file yet, in bytes.
const ROWS: usize = 64 << 10;
/// Longest time that a row waits in memory while others follow.
const UNWRITTEN: Duration = Duration::from_secs(1);

/// `history.csv`, written by a separate thread. Rows are written whole and within [`UNWRITTEN`]. A row that is written
/// only in part, because the disk is full, is removed again; those before it stay.
#[derive(Debug)]
pub struct History {
    file: Background<Vec<u8>>,
    /// Whole rows that the writer does not have yet.
    rows: Vec<u8>,
    /// When rows were last given to the writer.
    flushed: Instant,
    /// Has taken the rows that the writer has.
    given: Hasher,
}

impl History {
    /// Opens the table `name`: a new one, or one that goes on behind what it had at a checkpoint. Of nothing, which no
    /// table is, it begins a new one and puts what is there aside.
    ///
    /// # Errors
    /// [`RunDirError`]: the file cannot be written, or was changed since the checkpoint.
    pub fn open(
        dir: &RunDir,
        name: &str,
        header: &[String],
        at: Option<&Sealed>,
    ) -> Result<Self, RunDirError> {
        if let Some(at) = at {
            if at.bytes > 0 {
                return Self::resume(dir, name, at);
            }
            dir.put_aside(name)?;
        }
        let (file, path) = dir.open(name, How::Replace)?;
        let mut history = Self::of(file, path, Hasher::new());
        let mut writer = csv::Writer::from_writer(Vec::new());
        writer
            .write_record(header)
            .expect("memory takes what is written");
        history.rows = writer.into_inner().expect("memory takes what is written");
        // If nothing can be written, the run does not begin.
        if !history.flush()?.is_reached() {
            history.finish()?;
        }
        Ok(history)
    }

    fn resume(dir: &RunDir, name: &str, at: &Sealed) -> Result<Self, RunDirError> {
        let given = at.compare(dir.path(), name);
        let given = given.map_err(fail("resume", &dir.path().join(name)))?;
        let (mut file, path) = dir.open(name, How::Change)?;
        let mut cut = || {
            file.set_len(at.bytes)?;
            file.seek(SeekFrom::End(0))
        };
        cut().map_err(fail("resume", &path))?;
        Ok(Self::of(file, path, given))
    }

    fn of(file: File, path: PathBuf, given: Hasher) -> Self {
        Self {
            file: appends(file, path, given.count()),
            given,
            rows: Vec::with_capacity(2 * ROWS),
            flushed: Instant::now(),
        }
    }

    /// What the writer was given so far.
    pub fn sealed(&self) -> Sealed {
        Sealed::of(&self.given)
    }

    /// Bytes that the writer has not written yet.
    pub fn behind(&self) -> u64 {
        self.file.behind()
    }

    /// Adds a row. Numbers are written so that they are read back to the same bits.
    ///
    /// # Errors
    /// [`RunDirError`].
    pub fn row(&mut self, row: &[f64]) -> Result<(), RunDirError> {
        for (k, number) in row.iter().enumerate() {
            let comma = if k == 0 { "" } else { "," };
            write!(self.rows, "{comma}{number}").expect("memory takes what is written");
        }
        self.rows.push(b'\n');
        if self.rows.len() > ROWS || self.flushed.elapsed() > UNWRITTEN {
            self.flush()?;
        }
        Ok(())
    }

    /// Gives all rows to the writer. When the mark is reached, they are in the file.
    ///
    /// # Errors
    /// [`RunDirError`] of an earlier row; the file then ends with the last row that was written whole.
    pub fn flush(&mut self) -> Result<Mark, RunDirError> {
        self.flushed = Instant::now();
        if !self.rows.is_empty() {
            let rows = std::mem::replace(&mut self.rows, Vec::with_capacity(2 * ROWS));
            let bytes = rows.len() as u64;
            self.given.update(&rows);
            self.file.give(rows, bytes)?;
        }
        Ok(self.file.mark())
    }

    /// Waits until all rows are in the file.
    ///
    /// # Errors
    /// As [`Self::row`], of all rows.
    pub fn finish(&mut self) -> Result<(), RunDirError> {
        let given = self.flush();
        let written = self.file.finish();
        given.and(written)
    }
}

#[cfg(test)]
mod tests {
    use super::super::rundir::HISTORY;
    use super::*;
    use std::fs;

    #[test]
    fn rows_reach_the_file_as_a_whole() {
        let dir = tempfile::tempdir().unwrap();
        let run = RunDir::create(dir.path(), "").unwrap();
        let mut history =
            History::open(&run, HISTORY, &["time [s]".into(), "x [m]".into()], None).unwrap();
        let mut sizes = std::collections::BTreeSet::new();
        let began = std::time::Instant::now();
        let mut row = [0.0; 2];
        // Writes at least so many rows, and until the writing thread has been seen idle in between.
        for k in 0.. {
            if k >= 20_000 && (sizes.len() > 2 || began.elapsed().as_secs() > 30) {
                break;
            }
            if k > 20_000 && k % 1000 == 0 {
                std::thread::sleep(std::time::Duration::from_millis(1));
            }
            row = [f64::from(k) / 3.0, 1e-300 / 7.0];
            history.row(&row).unwrap();
            // While a file is being written, it may contain half of a piece.
            if history.behind() > 0 {
                continue;
            }
            let size = fs::metadata(dir.path().join("history.csv")).unwrap().len();
            if sizes.insert(size) {
                let text = fs::read_to_string(dir.path().join("history.csv")).unwrap();
                assert!(text.ends_with('\n'));
            }
        }
        assert!(sizes.len() > 2, "the file grows while the run goes on");
        // Numbers read back to the same bits.
        history.finish().unwrap();
        let text = fs::read_to_string(dir.path().join("history.csv")).unwrap();
        let last = text.lines().last().unwrap().split(',');
        let read: Vec<f64> = last.map(|n| n.parse().unwrap()).collect();
        assert_eq!(read, row);
    }
}
