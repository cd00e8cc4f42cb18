//! Background writing: a separate thread appends to a file, so that no step waits for a disk.

use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use super::error::{RunDirError, fail};
use super::rundir::RunDir;

/// Time between two looks of a thread that waits for a writer.
const LOOK: Duration = Duration::from_millis(1);

/// How much a writer has written, in bytes or frames.
#[derive(Debug, Default)]
pub(crate) struct Written {
    count: AtomicU64,
    ended: AtomicBool,
}

impl Written {
    /// Begins with what was written before.
    pub fn from(count: u64) -> Arc<Self> {
        Arc::new(Self {
            count: count.into(),
            ended: false.into(),
        })
    }

    /// The amount that is in the file.
    pub fn count(&self) -> u64 {
        self.count.load(Ordering::Acquire)
    }

    /// Whether nothing more will be written, because everything has been or because the writer has failed.
    pub fn has_ended(&self) -> bool {
        self.ended.load(Ordering::Acquire)
    }

    /// Sets the amount that is in the file.
    pub fn reach(&self, count: u64) {
        self.count.store(count, Ordering::Release);
    }

    /// A guard that marks the end of the writer, whether it returns or panics.
    pub fn until_the_end(self: &Arc<Self>) -> Ends {
        Ends(self.clone())
    }

    /// A mark that is reached when the first `until` have been written.
    pub fn mark(self: &Arc<Self>, until: u64) -> Mark {
        Mark {
            written: self.clone(),
            until,
        }
    }
}

/// Marks the writer as ended when it is dropped.
pub(crate) struct Ends(Arc<Written>);

impl Drop for Ends {
    fn drop(&mut self) {
        self.0.ended.store(true, Ordering::Release);
    }
}

/// An amount that must be written before something else that relies on it.
#[derive(Debug)]
pub(crate) struct Mark {
    written: Arc<Written>,
    until: u64,
}

impl Mark {
    /// Waits until it is written; false if the writer has failed before.
    pub fn is_reached(&self) -> bool {
        loop {
            // The order matters: after its end the writer writes nothing more.
            let ended = self.written.has_ended();
            if self.written.count() >= self.until {
                return true;
            }
            if ended {
                return false;
            }
            thread::sleep(LOOK);
        }
    }
}

/// A file to which a thread appends. A piece that is written only in part, because the disk is full, is removed again.
#[derive(Debug)]
pub(crate) struct BackgroundWriter {
    queue: Option<Sender<Vec<u8>>>,
    written: Arc<Written>,
    /// Length of the file in bytes when everything is written.
    bytes: u64,
    writer: Option<JoinHandle<Result<(), RunDirError>>>,
}

impl BackgroundWriter {
    /// Appends to `file`, which has `bytes` bytes. `path` is for messages.
    pub fn begin(file: File, path: PathBuf, bytes: u64) -> Self {
        let (queue, taken) = channel();
        let written = Written::from(bytes);
        let reached = written.clone();
        let writer =
            thread::spawn(move || write_all(file, &taken, &reached).map_err(fail("write", &path)));
        Self {
            queue: Some(queue),
            written,
            bytes,
            writer: Some(writer),
        }
    }

    /// Takes a piece that is to be appended; the thread writes it soon.
    ///
    /// # Errors
    /// [`RunDirError`] if an earlier piece could not be written. The file then ends with the last piece that was
    /// written whole.
    pub fn add(&mut self, piece: Vec<u8>) -> Result<(), RunDirError> {
        self.bytes += piece.len() as u64;
        match self.queue.as_ref().map(|queue| queue.send(piece)) {
            Some(Ok(())) => Ok(()),
            // The receiver is gone: the writer has ended with an error, which is reported.
            _ => self.finish(),
        }
    }

    /// Length of the file in bytes when everything is written.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Bytes that are not written yet and still will be.
    pub fn behind(&self) -> u64 {
        if self.written.has_ended() {
            return 0;
        }
        self.bytes - self.written.count()
    }

    /// The mark of everything that was taken so far.
    pub fn mark(&self) -> Mark {
        self.written.mark(self.bytes)
    }

    /// Waits until everything that was taken is in the file.
    ///
    /// # Errors
    /// [`RunDirError`], once.
    pub fn finish(&mut self) -> Result<(), RunDirError> {
        self.queue = None;
        match self.writer.take() {
            Some(writer) => writer.join().expect("who adds to a file does not panic"),
            None => Ok(()),
        }
    }
}

impl Drop for BackgroundWriter {
    fn drop(&mut self) {
        // After a failed run its own error is reported, not that of its last rows.
        let _ = self.finish();
    }
}

fn write_all(mut file: File, taken: &Receiver<Vec<u8>>, written: &Arc<Written>) -> io::Result<()> {
    let _ends = written.until_the_end();
    for piece in taken {
        let before = written.count();
        if let Err(error) = file.write_all(&piece) {
            let _ = file.set_len(before);
            let _ = file.seek(SeekFrom::Start(before));
            return Err(error);
        }
        written.reach(before + piece.len() as u64);
    }
    Ok(())
}

/// The log of a run, to which any thread may add lines.
#[derive(Debug, Clone)]
pub struct LogFile(Arc<Mutex<BackgroundWriter>>);

impl LogFile {
    /// The log of a run, which begins anew or is appended to.
    ///
    /// # Errors
    /// [`RunDirError`].
    pub fn of(dir: &RunDir, append: bool) -> Result<Self, RunDirError> {
        let (file, path) = dir.log(append)?;
        let bytes = file.metadata().map_or(0, |file| file.len());
        Ok(Self(Arc::new(
            BackgroundWriter::begin(file, path, bytes).into(),
        )))
    }

    /// Waits until all lines so far are in the file, or cannot be written.
    pub fn sync(&self) {
        let mark = self.0.lock().expect("who adds does not panic").mark();
        mark.is_reached();
    }
}

impl Write for &LogFile {
    fn write(&mut self, line: &[u8]) -> io::Result<usize> {
        let mut aside = self.0.lock().expect("who adds does not panic");
        // A log that cannot be written does not end a run.
        if aside.queue.is_some() {
            let _ = aside.add(line.to_vec());
        }
        Ok(line.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;
    use std::time::Instant;

    /// A pipe that nobody reads, in place of a disk that does not answer.
    fn stuck() -> (io::PipeReader, BackgroundWriter) {
        let (reader, writer) = io::pipe().unwrap();
        let file = File::from(std::os::fd::OwnedFd::from(writer));
        (reader, BackgroundWriter::begin(file, "pipe".into(), 0))
    }

    #[test]
    fn a_blocked_disk_delays_no_step_and_loses_nothing() {
        let (mut reader, mut aside) = stuck();
        let start = Instant::now();
        for k in 0..1000_u32 {
            aside.add(k.to_le_bytes().repeat(256)).unwrap();
        }
        assert!(start.elapsed() < Duration::from_secs(5));
        assert!(aside.behind() > 0);
        assert_eq!(aside.bytes(), 1_024_000);
        let mark = aside.mark();
        let read = thread::spawn(move || {
            let mut all = Vec::new();
            reader.read_to_end(&mut all).unwrap();
            all
        });
        assert!(mark.is_reached());
        aside.finish().unwrap();
        let all = read.join().unwrap();
        assert_eq!(all.len(), 1_024_000);
        let numbers = all
            .chunks(1024)
            .map(|c| u32::from_le_bytes(c[..4].try_into().unwrap()));
        assert!(numbers.eq(0..1000));
    }

    #[test]
    fn an_error_is_reported_once_and_later_marks_are_not_reached() {
        let mut aside = BackgroundWriter::begin(File::open("/dev/null").unwrap(), "null".into(), 0);
        aside.add(vec![1]).unwrap();
        let mark = aside.mark();
        assert!(!mark.is_reached());
        assert_eq!(aside.behind(), 0);
        let error = aside.add(vec![2]).unwrap_err().to_string();
        assert!(error.starts_with("cannot write null: "), "{error}");
        aside.finish().unwrap();
    }
}
