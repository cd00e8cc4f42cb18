//! Writes a recording, in a thread of its own.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::thread::JoinHandle;
use std::time::Duration;

use super::{About, BLOCK, FORMAT, MAGIC, MESSAGE_HEADER, RecordingError, check};
use crate::message::wire::{Record, StepHeader};
use crate::message::{Channel, Records};

/// Longest time that a message waits in memory while the run goes on: what a killed run loses at most.
const UNWRITTEN: Duration = Duration::from_millis(250);
/// Bytes that may wait for the disk. Beyond, the run waits with them: a recording has everything.
const WAITING: usize = 64 << 20;

/// Writes a recording. Dropping it without [`Self::finish`] leaves a recording without an end.
#[derive(Debug)]
pub struct Recorder {
    shared: Arc<Shared>,
    writer: Option<JoinHandle<()>>,
}

/// Where messages are noted.
#[derive(Debug, Clone)]
pub struct Tape(Arc<Shared>);

#[derive(Debug)]
struct Shared {
    state: Mutex<State>,
    /// There is something to write.
    work: Condvar,
    /// There is room again.
    room: Condvar,
}

#[derive(Debug, Default)]
struct State {
    pending: Vec<u8>,
    finished: bool,
    /// The recorder has been dropped.
    closed: bool,
    failure: Option<RecordingError>,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        // Nothing that holds it can panic but for want of memory.
        self.state.lock().expect("no holder has panicked")
    }

    fn fail(&self, error: RecordingError) {
        self.lock().failure.get_or_insert(error);
        self.room.notify_all();
    }
}

impl Recorder {
    /// Begins a recording at `path`, in the place of what is there.
    ///
    /// # Errors
    /// [`RecordingError::File`].
    pub fn create(path: &Path, about: &About) -> Result<Self, RecordingError> {
        let about = serde_json::to_vec(about).expect("strings and numbers");
        let mut bytes = MAGIC.to_vec();
        bytes.extend(FORMAT.to_le_bytes());
        bytes.extend((about.len() as u32).to_le_bytes());
        bytes.extend(&about);
        bytes.extend(check(&[&about]));
        let mut file = File::create(path).map_err(RecordingError::file("create", path))?;
        file.write_all(&bytes)
            .map_err(RecordingError::file("write", path))?;
        let shared = Arc::new(Shared {
            state: Mutex::default(),
            work: Condvar::new(),
            room: Condvar::new(),
        });
        let mut output = Output {
            file,
            path: path.to_path_buf(),
            blocks: 0,
            messages: 0,
            packed: Vec::new(),
        };
        let for_writer = Arc::clone(&shared);
        let writer = std::thread::Builder::new()
            .name("recorder".into())
            .spawn(move || {
                if let Err(error) = write(&for_writer, &mut output) {
                    for_writer.fail(error);
                }
            })
            .map_err(RecordingError::file("start a thread for", path))?;
        Ok(Self {
            shared,
            writer: Some(writer),
        })
    }

    /// Where messages are noted.
    pub fn tape(&self) -> Tape {
        Tape(Arc::clone(&self.shared))
    }

    /// Writes what is left, and the end.
    ///
    /// # Errors
    /// The first error of any write.
    pub fn finish(mut self) -> Result<(), RecordingError> {
        self.shared.lock().finished = true;
        self.close();
        self.tape().failure().map_or(Ok(()), Err)
    }

    fn close(&mut self) {
        self.shared.lock().closed = true;
        self.shared.work.notify_all();
        if let Some(writer) = self.writer.take()
            && writer.join().is_err()
        {
            self.shared
                .fail(RecordingError::Tap("the writer has panicked".into()));
        }
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        self.close();
    }
}

impl Tape {
    /// Notes a message. Waits only when the disk is [`WAITING`] bytes behind.
    pub(crate) fn note(&self, channel: Channel, header: &StepHeader, records: Records<'_>) {
        let Shared { work, room, .. } = &*self.0;
        let mut state = self.0.lock();
        while state.pending.len() > WAITING && state.failure.is_none() {
            state = room.wait(state).expect("no holder has panicked");
        }
        if state.failure.is_some() {
            return; // it is told elsewhere
        }
        let pending = &mut state.pending;
        let begin = pending.len();
        let payload = begin + MESSAGE_HEADER;
        pending.push(channel.number() as u8);
        pending.resize(payload, 0);
        header.write(&mut pending[payload - size_of::<StepHeader>()..]);
        records.write(pending);
        let length = (pending.len() - payload) as u32;
        pending[begin + 1..begin + 5].copy_from_slice(&length.to_le_bytes());
        // The writer looks by itself when little is there.
        if begin < BLOCK && pending.len() >= BLOCK {
            work.notify_one();
        }
    }

    /// Whether so much waits for the disk that nothing should be added.
    pub fn is_behind(&self) -> bool {
        let state = self.0.lock();
        state.pending.len() > WAITING / 2 && state.failure.is_none()
    }

    /// Why the recording has failed, if it has.
    pub fn failure(&self) -> Option<RecordingError> {
        self.0.lock().failure.clone()
    }

    pub(crate) fn fail(&self, error: RecordingError) {
        self.0.fail(error);
    }
}

/// Writes what is noted until the recorder is closed.
fn write(shared: &Shared, output: &mut Output) -> Result<(), RecordingError> {
    let mut messages = Vec::new();
    loop {
        let mut state = shared.lock();
        if state.pending.len() < BLOCK && !state.closed {
            let waited = shared.work.wait_timeout(state, UNWRITTEN);
            (state, _) = waited.expect("no holder has panicked");
        }
        messages.clear();
        std::mem::swap(&mut messages, &mut state.pending);
        let (closed, finished) = (state.closed, state.finished);
        drop(state);
        shared.room.notify_all();
        output.write(&messages)?;
        if closed {
            return if finished { output.end() } else { Ok(()) };
        }
    }
}

struct Output {
    file: File,
    path: PathBuf,
    blocks: u64,
    messages: u64,
    packed: Vec<u8>,
}

impl Output {
    /// Whole messages, in blocks of about [`BLOCK`] bytes.
    fn write(&mut self, messages: &[u8]) -> Result<(), RecordingError> {
        let (mut begin, mut at, mut count) = (0, 0, 0);
        while at < messages.len() {
            let length = u32::from_le_bytes(messages[at + 1..at + 5].try_into().expect("4 bytes"));
            at += MESSAGE_HEADER + length as usize;
            count += 1;
            if at - begin >= BLOCK || at == messages.len() {
                self.block(&messages[begin..at], count)?;
                (begin, count) = (at, 0);
            }
        }
        Ok(())
    }

    fn end(&mut self) -> Result<(), RecordingError> {
        self.block(&self.messages.to_le_bytes(), 0)?;
        self.file
            .sync_all()
            .map_err(RecordingError::file("write", &self.path))
    }

    fn block(&mut self, body: &[u8], messages: u32) -> Result<(), RecordingError> {
        let packed = lz4_flex::block::compress(body);
        let stored = if packed.len() < body.len() {
            &packed
        } else {
            body
        };
        let numbers = [stored.len() as u32, body.len() as u32, messages];
        self.packed.clear();
        self.packed
            .extend(numbers.iter().flat_map(|n| n.to_le_bytes()));
        let sum = check(&[&self.blocks.to_le_bytes(), &self.packed]);
        self.packed.extend(sum);
        self.packed.extend(stored);
        self.packed.extend(check(&[stored]));
        self.file
            .write_all(&self.packed)
            .map_err(RecordingError::file("write", &self.path))?;
        self.blocks += 1;
        self.messages += u64::from(messages);
        Ok(())
    }
}
