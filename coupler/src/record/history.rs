//! `history.csv`: one row for each output, in whole rows whatever ends this process.

use std::fs::{File, OpenOptions};
use std::io::{self, Seek, SeekFrom};
use std::path::PathBuf;
use std::time::{Duration, Instant};

use crate::record::rundir::{RunDir, RunDirError, fail};

/// Its name in a run directory.
pub(crate) const HISTORY: &str = "history.csv";
/// Room for rows that have not reached the file.
const ROWS: usize = 64 << 10;
/// Longest time that a row waits in memory while others follow.
const UNWRITTEN: Duration = Duration::from_secs(1);

/// `history.csv` being written. Rows reach the file as a whole and within [`UNWRITTEN`], so that it reads back whatever
/// ends this process.
#[derive(Debug)]
pub struct History {
    writer: csv::Writer<File>,
    path: PathBuf,
    /// Most bytes that the rows in memory may have.
    unwritten: usize,
    written: Instant,
    /// All that has been written, in memory or not.
    bytes: u64,
}

impl History {
    /// Begins `history.csv`.
    ///
    /// # Errors
    /// [`RunDirError`].
    pub fn begin(dir: &RunDir, header: &[String]) -> Result<Self, RunDirError> {
        Self::begin_table(dir, HISTORY, header)
    }

    /// Begins the table `name`, which is written as `history.csv` is.
    pub(crate) fn begin_table(
        dir: &RunDir,
        name: &str,
        header: &[String],
    ) -> Result<Self, RunDirError> {
        let path = dir.path().join(name);
        let file = File::create(&path).map_err(fail("create", &path))?;
        let mut history = Self::of(file, path, 0);
        history
            .writer
            .write_record(header)
            .map_err(|e| fail("write", &history.path)(e.into()))?;
        history.flush()?;
        let written = history.writer.get_ref().metadata();
        history.bytes = written.map_err(fail("write", &history.path))?.len();
        Ok(history)
    }

    /// Goes on with `history.csv` after its first `bytes` bytes.
    ///
    /// # Errors
    /// [`RunDirError`], also when there are not as many.
    pub fn resume(dir: &RunDir, bytes: u64) -> Result<Self, RunDirError> {
        Self::resume_table(dir, HISTORY, bytes)
    }

    /// Goes on with such a table after its first `bytes` bytes.
    pub(crate) fn resume_table(dir: &RunDir, name: &str, bytes: u64) -> Result<Self, RunDirError> {
        let path = dir.path().join(name);
        let open = || {
            let mut file = OpenOptions::new().write(true).open(&path)?;
            if file.metadata()?.len() < bytes {
                return Err(io::Error::other("it is shorter than at the checkpoint"));
            }
            file.set_len(bytes)?;
            file.seek(SeekFrom::End(0))?;
            Ok(file)
        };
        let file = open().map_err(fail("go on with", &path))?;
        Ok(Self::of(file, path, bytes))
    }

    fn of(file: File, path: PathBuf, bytes: u64) -> Self {
        Self {
            writer: csv::WriterBuilder::new()
                .buffer_capacity(2 * ROWS)
                .from_writer(file),
            path,
            unwritten: 0,
            written: Instant::now(),
            bytes,
        }
    }

    /// Length in bytes of the file once all rows have reached it.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Adds a row. Numbers are written so that they read back to the same bits.
    ///
    /// # Errors
    /// [`RunDirError`].
    pub fn row(&mut self, row: &[f64]) -> Result<(), RunDirError> {
        let row: Vec<String> = row.iter().map(f64::to_string).collect();
        let length: usize = row.iter().map(|number| number.len() + 1).sum();
        // The writer would pass half a row on when it is full, so it never gets full.
        if self.unwritten + length > ROWS {
            self.flush()?;
        }
        self.writer
            .write_record(row)
            .map_err(|e| fail("write", &self.path)(e.into()))?;
        self.unwritten += length;
        self.bytes += length as u64;
        if self.written.elapsed() > UNWRITTEN {
            self.flush()?;
        }
        Ok(())
    }

    /// Everything written so far reaches the file.
    ///
    /// # Errors
    /// [`RunDirError`].
    pub fn flush(&mut self) -> Result<(), RunDirError> {
        self.unwritten = 0;
        self.written = Instant::now();
        self.writer.flush().map_err(fail("write", &self.path))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn rows_reach_the_file_as_a_whole() {
        let dir = tempfile::tempdir().unwrap();
        let run = RunDir::create(dir.path()).unwrap();
        let mut history = History::begin(&run, &["time [s]".into(), "x [m]".into()]).unwrap();
        let mut sizes = std::collections::BTreeSet::new();
        for k in 0..20_000 {
            history.row(&[f64::from(k) / 3.0, 1e-300 / 7.0]).unwrap();
            let size = fs::metadata(dir.path().join("history.csv")).unwrap().len();
            if sizes.insert(size) {
                let text = fs::read_to_string(dir.path().join("history.csv")).unwrap();
                assert!(text.ends_with('\n'));
            }
        }
        assert!(sizes.len() > 2, "the file grows while the run goes on");
    }

    #[test]
    fn numbers_read_back_to_the_same_bits() {
        let dir = tempfile::tempdir().unwrap();
        let run = RunDir::create(dir.path()).unwrap();
        let mut history = History::begin(&run, &["time [s]".into(), "x [m]".into()]).unwrap();
        let row = [0.1 + 0.2, 1e-300 / 3.0];
        history.row(&row).unwrap();
        history.flush().unwrap();
        let text = fs::read_to_string(dir.path().join("history.csv")).unwrap();
        let read: Vec<f64> = text
            .lines()
            .nth(1)
            .unwrap()
            .split(',')
            .map(|n| n.parse().unwrap())
            .collect();
        assert_eq!(read, row);
    }
}
