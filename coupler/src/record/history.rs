//! `history.csv`: one row for each output, in whole rows whatever ends this process.

use std::fs::{File, OpenOptions};
use std::io::{self, Seek, SeekFrom, Write};
use std::path::PathBuf;
use std::time::{Duration, Instant};

use super::rundir::{HISTORY, RunDir, RunDirError, fail};

/// Room for rows that have not reached the file.
const ROWS: usize = 64 << 10;
/// Longest time that a row waits in memory while others follow.
const UNWRITTEN: Duration = Duration::from_secs(1);

/// `history.csv` being written. Rows reach the file as a whole and within [`UNWRITTEN`]; what reaches it in part, because
/// the disk is full, is taken back.
#[derive(Debug)]
pub struct History {
    file: File,
    /// For messages.
    path: PathBuf,
    /// Whole rows that have not reached the file.
    rows: Vec<u8>,
    /// Bytes of whole rows in the file.
    written: u64,
    /// When rows last reached the file.
    flushed: Instant,
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
        let mut history = Self::of(dir.open(name, false)?, path, 0);
        let mut writer = csv::Writer::from_writer(Vec::new());
        writer
            .write_record(header)
            .expect("memory takes what is written");
        history.rows = writer.into_inner().expect("memory takes what is written");
        history.flush()?;
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
        let file = open().map_err(fail("resume", &path))?;
        Ok(Self::of(file, path, bytes))
    }

    fn of(file: File, path: PathBuf, written: u64) -> Self {
        Self {
            file,
            path,
            rows: Vec::with_capacity(2 * ROWS),
            written,
            flushed: Instant::now(),
        }
    }

    /// Length in bytes of the file once all rows have reached it.
    pub fn bytes(&self) -> u64 {
        self.written + self.rows.len() as u64
    }

    /// Adds a row. Numbers are written so that they read back to the same bits.
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

    /// Everything written so far reaches the file.
    ///
    /// # Errors
    /// [`RunDirError`]; then the file ends with the last row that it has as a whole.
    pub fn flush(&mut self) -> Result<(), RunDirError> {
        self.flushed = Instant::now();
        if let Err(error) = self.file.write_all(&self.rows) {
            let end = SeekFrom::Start(self.written);
            let _ = self.file.set_len(self.written);
            let _ = self.file.seek(end);
            return Err(fail("write", &self.path)(error));
        }
        self.written += self.rows.len() as u64;
        self.rows.clear();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn rows_reach_the_file_as_a_whole() {
        let dir = tempfile::tempdir().unwrap();
        let run = RunDir::create(dir.path(), "").unwrap();
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
        let run = RunDir::create(dir.path(), "").unwrap();
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
