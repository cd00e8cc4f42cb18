//! Background writing: a thread does what takes a disk, in its order, so that no step waits for one. The recorder has a
//! thread of its own, which packs small messages into blocks while it waits.

use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use interface::files::How;
use interface::transport::wait::until_there;

use super::error::{RunDirError, fail};
use super::rundir::{LOG, RunDir};

/// Time between two looks of a thread that waits for a writer.
const LOOK: Duration = Duration::from_millis(1);

/// A thread that writes pieces in the order in which they are given. It ends at the first that it cannot write.
#[derive(Debug)]
pub struct Background<T> {
    queue: Option<Sender<(T, u64)>>,
    progress: Arc<Progress>,
    /// The amount that was given.
    given: u64,
    writer: Option<JoinHandle<Result<(), RunDirError>>>,
}

/// How much has been written, in the unit of the pieces' amounts.
#[derive(Debug, Default)]
struct Progress {
    written: AtomicU64,
    ended: AtomicBool,
}

/// Marks the writer as ended when it is dropped, also after a panic.
struct Ends(Arc<Progress>);

impl Drop for Ends {
    fn drop(&mut self) {
        self.0.ended.store(true, Ordering::Release);
    }
}

/// An amount that must be written before something else that relies on it.
#[derive(Debug)]
pub struct Mark {
    progress: Arc<Progress>,
    given: u64,
}

impl Mark {
    /// Waits until it is written; false if the writer has failed before.
    pub fn is_reached(&self) -> bool {
        until_there(LOOK, || {
            // The order matters: after its end the writer writes nothing more.
            let ended = self.progress.ended.load(Ordering::Acquire);
            let reached = self.progress.written.load(Ordering::Acquire) >= self.given;
            (reached || ended).then_some(reached)
        })
    }
}

impl<T: Send + 'static> Background<T> {
    /// Begins a thread that writes each piece with `write`, after `written` that were written before.
    pub fn begin(
        written: u64,
        mut write: impl FnMut(T) -> Result<(), RunDirError> + Send + 'static,
    ) -> Self {
        let (queue, taken) = channel::<(T, u64)>();
        let progress = Arc::new(Progress {
            written: written.into(),
            ended: false.into(),
        });
        let ends = Ends(progress.clone());
        let writer = thread::spawn(move || {
            for (piece, amount) in taken {
                write(piece)?;
                ends.0.written.fetch_add(amount, Ordering::AcqRel);
            }
            Ok(())
        });
        Self {
            queue: Some(queue),
            progress,
            given: written,
            writer: Some(writer),
        }
    }

    /// Gives a piece of this amount; the thread writes it soon.
    ///
    /// # Errors
    /// [`RunDirError`], once, if an earlier piece could not be written.
    pub fn give(&mut self, piece: T, amount: u64) -> Result<(), RunDirError> {
        self.given += amount;
        match self.queue.as_ref().map(|queue| queue.send((piece, amount))) {
            Some(Ok(())) => Ok(()),
            // The receiver is gone: the writer has ended with an error, which is reported.
            _ => self.finish(),
        }
    }

    /// The amount that is not written yet and still will be.
    pub fn behind(&self) -> u64 {
        if self.progress.ended.load(Ordering::Acquire) {
            return 0;
        }
        self.given - self.progress.written.load(Ordering::Acquire)
    }

    /// The mark of everything that was given so far.
    pub fn mark(&self) -> Mark {
        Mark {
            progress: self.progress.clone(),
            given: self.given,
        }
    }

    /// Waits until everything that was given is written.
    ///
    /// # Errors
    /// [`RunDirError`], once.
    pub fn finish(&mut self) -> Result<(), RunDirError> {
        self.queue = None;
        match self.writer.take() {
            Some(writer) => writer.join().expect("who writes does not panic"),
            None => Ok(()),
        }
    }
}

impl<T> Drop for Background<T> {
    fn drop(&mut self) {
        self.queue = None;
        // After a failed run its own error is reported, not that of its last pieces.
        if let Some(writer) = self.writer.take() {
            let _ = writer.join();
        }
    }
}

/// A text of `bytes` bytes to which a thread appends pieces of whole lines. If the disk is full, the lines that have room
/// stay, and the part of a line that follows them is removed. `path` is for messages.
pub(crate) fn appends(mut file: File, path: PathBuf, bytes: u64) -> Background<Vec<u8>> {
    let mut length = bytes;
    Background::begin(bytes, move |piece: Vec<u8>| {
        let written = file.write_all(&piece);
        if let Err(error) = written {
            let there = file.stream_position().unwrap_or(length);
            let there = there.saturating_sub(length) as usize;
            let there = &piece[..there.min(piece.len())];
            let lines = there.iter().rposition(|byte| *byte == b'\n');
            let whole = length + lines.map_or(0, |end| end as u64 + 1);
            let _ = file.set_len(whole);
            let _ = file.seek(SeekFrom::Start(whole));
            return Err(fail("write", &path)(error).into());
        }
        length += piece.len() as u64;
        Ok(())
    })
}

/// The log of a run, to which any thread may add lines.
#[derive(Debug, Clone)]
pub struct LogFile(Arc<Mutex<Background<Vec<u8>>>>);

impl LogFile {
    /// The log of a run, which begins anew or is appended to.
    ///
    /// # Errors
    /// [`RunDirError`].
    pub fn of(dir: &RunDir, append: bool) -> Result<Self, RunDirError> {
        let how = if append { How::Append } else { How::Replace };
        // Messages name it where it will be when the run has begun.
        let (file, path) = (dir.open(LOG, how)?.0, dir.path().join(LOG));
        let bytes = file.metadata().map_or(0, |file| file.len());
        Ok(Self(Arc::new(appends(file, path, bytes).into())))
    }

    /// Waits until all lines so far are in the file, or cannot be written.
    pub fn sync(&self) {
        let mark = self.0.lock().expect("who adds does not panic").mark();
        mark.is_reached();
    }
}

impl Write for &LogFile {
    fn write(&mut self, line: &[u8]) -> io::Result<usize> {
        let mut log = self.0.lock().expect("who adds does not panic");
        // A log that cannot be written does not end a run.
        if log.queue.is_some() {
            let _ = log.give(line.to_vec(), line.len() as u64);
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
    fn stuck() -> (io::PipeReader, Background<Vec<u8>>) {
        let (reader, writer) = io::pipe().unwrap();
        let file = File::from(std::os::fd::OwnedFd::from(writer));
        (reader, appends(file, "pipe".into(), 0))
    }

    #[test]
    fn a_blocked_disk_delays_no_step_and_loses_nothing() {
        let (mut reader, mut aside) = stuck();
        let start = Instant::now();
        for k in 0..1000_u32 {
            aside.give(k.to_le_bytes().repeat(256), 1024).unwrap();
        }
        assert!(start.elapsed() < Duration::from_secs(5));
        assert!(aside.behind() > 0);
        assert_eq!(aside.given, 1_024_000);
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
}
