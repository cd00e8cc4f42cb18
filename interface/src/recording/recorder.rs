//! Writes a recording, in a separate thread.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::thread::JoinHandle;
use std::time::Duration;

use super::{About, BLOCK, FORMAT, MAGIC, MESSAGE_HEADER, RecordingError, check};
use crate::message::wire::{StepHeader, bytes_of};
use crate::message::{Channel, Records};
use crate::transport::wait::until;

/// Longest time that a message waits in memory while the run continues. A killed run loses no more than this.
const UNWRITTEN: Duration = Duration::from_millis(250);
/// Bytes that may wait for the disk. If there are more, the run waits too, because a recording must be complete.
const WAITING: usize = 64 << 20;
/// Longest wait of [`RecordingSink::listen`].
const LISTEN_LIMIT: Duration = Duration::from_secs(10);
/// Time between two looks at the tap.
const LOOK: Duration = Duration::from_micros(500);
/// [`Shared::rounds`] of a recording without a tap.
const NO_TAP: u64 = u64::MAX;

/// Writes a recording. Dropping it without [`Self::finish`] leaves a recording without an end.
#[derive(Debug)]
pub struct Recorder {
    shared: Arc<Shared>,
    writer: Option<JoinHandle<()>>,
}

/// Adds messages to a recording.
#[derive(Debug, Clone)]
pub struct RecordingSink(Arc<Shared>);

#[derive(Debug)]
struct Shared {
    state: Mutex<State>,
    /// There is something to write.
    work: Condvar,
    /// There is room again.
    room: Condvar,
    /// How often the tap has read every channel to its end.
    rounds: AtomicU64,
}

#[derive(Debug, Default)]
struct State {
    pending: Vec<u8>,
    finished: bool,
    /// The recorder has been dropped.
    closed: bool,
    failure: Option<RecordingError>,
}

/// Appends a message in the format of the file.
fn put(bytes: &mut Vec<u8>, channel: Channel, header: &StepHeader, records: Records<'_>) {
    let begin = bytes.len();
    let first = begin + MESSAGE_HEADER;
    bytes.extend([channel.number() as u8, 0, 0, 0, 0]);
    bytes.extend_from_slice(bytes_of(std::slice::from_ref(header)));
    bytes.extend_from_slice(records.bytes());
    let length = (bytes.len() - first) as u32;
    bytes[begin + 1..begin + 5].copy_from_slice(&length.to_le_bytes());
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        // No holder of the lock can panic, unless memory runs out.
        self.state.lock().expect("no holder has panicked")
    }

    fn fail(&self, error: RecordingError) {
        self.lock().failure.get_or_insert(error);
        self.room.notify_all();
    }
}

impl Recorder {
    /// Begins a recording in an empty file; `path` is for messages.
    ///
    /// # Errors
    /// [`RecordingError::File`].
    pub fn create(mut file: File, path: &Path, about: &About) -> Result<Self, RecordingError> {
        let about = serde_json::to_vec(about).expect("strings and numbers");
        let mut bytes = MAGIC.to_vec();
        bytes.extend(FORMAT.to_le_bytes());
        bytes.extend((about.len() as u32).to_le_bytes());
        bytes.extend(&about);
        bytes.extend(check(&[&about]));
        file.write_all(&bytes)
            .map_err(RecordingError::file("write", path))?;
        let shared = Arc::new(Shared {
            state: Mutex::default(),
            work: Condvar::new(),
            room: Condvar::new(),
            rounds: AtomicU64::new(NO_TAP),
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

    /// The sink to which messages are added.
    pub fn sink(&self) -> RecordingSink {
        RecordingSink(Arc::clone(&self.shared))
    }

    /// Writes the rest and the end.
    ///
    /// # Errors
    /// The first error of any write.
    pub fn finish(mut self) -> Result<(), RecordingError> {
        self.shared.lock().finished = true;
        self.close();
        self.sink().failure().map_or(Ok(()), Err)
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

impl RecordingSink {
    /// Adds a message. It waits only if the disk is [`WAITING`] bytes behind.
    pub(crate) fn note(&self, channel: Channel, header: &StepHeader, records: Records<'_>) {
        let Shared { work, room, .. } = &*self.0;
        let mut state = self.0.lock();
        while state.pending.len() > WAITING && state.failure.is_none() {
            state = room.wait(state).expect("no holder has panicked");
        }
        if state.failure.is_some() {
            return; // the failure is reported elsewhere
        }
        let pending = &mut state.pending;
        let begin = pending.len();
        put(pending, channel, header, records);
        let end = pending.len();
        // The writer wakes up by itself when there is less than a block.
        if begin < BLOCK && end >= BLOCK {
            work.notify_one();
        }
    }

    /// Whether so much waits for the disk that nothing should be added.
    pub fn is_behind(&self) -> bool {
        let state = self.0.lock();
        state.pending.len() > WAITING / 2 && state.failure.is_none()
    }

    /// Waits until the tap has looked into the channels of all solvers that are ready, so that no message passes it. A
    /// subscriber is connected to a publisher only when it first looks for messages after the publisher was made. Until
    /// then iceoryx2 drops what the buffer does not hold, without a word to the sender. If that takes more than
    /// [`LISTEN_LIMIT`] the recording fails.
    pub fn listen(&self) {
        let rounds = &self.0.rounds;
        // The tap may already have passed a channel in its present round when a message came. The next round reads all
        // of it.
        let after = rounds.load(Ordering::Acquire).saturating_add(2);
        let is_after = || (rounds.load(Ordering::Acquire) >= after).then_some(());
        if until(LISTEN_LIMIT, LOOK, is_after).is_none() {
            let text = format!("it has not read for {LISTEN_LIMIT:?}");
            self.fail(RecordingError::Tap(text));
        }
    }

    /// A tap begins or ceases to listen.
    pub(super) fn tapped(&self, listens: bool) {
        let rounds = if listens { 0 } else { NO_TAP };
        self.0.rounds.store(rounds, Ordering::Release);
    }

    /// The tap has read every channel to its end.
    pub(super) fn round(&self) {
        self.0.rounds.fetch_add(1, Ordering::AcqRel);
    }

    /// Why the recording has failed, if it has.
    pub fn failure(&self) -> Option<RecordingError> {
        self.0.lock().failure.clone()
    }

    pub(crate) fn fail(&self, error: RecordingError) {
        self.0.fail(error);
    }
}

/// Writes the messages that are added until the recorder is closed.
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
    /// Writes whole messages, in blocks of about [`BLOCK`] bytes.
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
