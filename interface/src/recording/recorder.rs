//! Writes a recording, in a separate thread.

use std::fs::File;
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::{About, BLOCK, FORMAT, MAGIC, MESSAGE_HEADER, Playback, RecordingError, check};
use crate::message::wire::{StepHeader, bytes_of};
use crate::message::{Channel, Kind, Records};
use crate::transport::wait::until;

/// Longest time that a message waits in memory while the run continues. A killed run loses no more than this.
const UNWRITTEN: Duration = Duration::from_millis(250);
/// Bytes that may wait for the disk. If there are more, the run waits too, because a recording must be complete.
const WAITING: usize = 64 << 20;
/// Longest wait of [`RecordingSink::flush`] and [`RecordingSink::sync`].
const SYNC_LIMIT: Duration = Duration::from_secs(10);
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
    /// There is room again, or something has been written.
    room: Condvar,
    /// How often the tap has read every channel to its end.
    rounds: AtomicU64,
}

#[derive(Debug, Default)]
#[expect(clippy::struct_excessive_bools, reason = "each is a fact of its own")]
struct State {
    pending: Vec<u8>,
    /// Bytes that have been added, written, and are safely on disk.
    noted: u64,
    written: u64,
    synced: u64,
    /// Length of the file with everything that has been written.
    length: u64,
    /// Somebody waits until everything is written.
    flushing: bool,
    /// Somebody waits until everything is on disk.
    syncing: bool,
    /// In a continued run before its first grant: the handshake was recorded in its first part, and the states that the
    /// solvers restore are not messages of the run.
    resumed: bool,
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

    /// Waits for the writer until something is `done`; `None` at the time `end`, or when the writer has ended.
    fn wait(
        &self,
        end: Instant,
        mut done: impl FnMut(&mut State) -> bool,
    ) -> Option<MutexGuard<'_, State>> {
        let mut state = self.lock();
        while !done(&mut state) {
            let left = end.saturating_duration_since(Instant::now());
            if left.is_zero() || state.failure.is_some() || state.closed {
                return None;
            }
            self.work.notify_one();
            let waited = self.room.wait_timeout(state, left);
            (state, _) = waited.expect("no holder has panicked");
        }
        Some(state)
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
        Self::begin(file, path, [bytes.len() as u64, 0, 0], false)
    }

    /// Continues the recording of the same run in a file that can be read and written, from a checkpoint at which it had
    /// this `length` ([`RecordingSink::flush`]).
    ///
    /// # Errors
    /// [`RecordingError`], also if the recording is shorter or damaged before that; then the file is unchanged.
    pub fn resume(
        mut file: File,
        path: &Path,
        about: &About,
        length: u64,
    ) -> Result<Self, RecordingError> {
        let failed = || RecordingError::file("go on with", path);
        let playback = Playback::of(file.try_clone().map_err(failed())?, path)?;
        if playback.about() != about {
            let reason = "it is of another run or program".to_owned();
            let path = path.to_path_buf();
            return Err(RecordingError::Foreign { path, reason });
        }
        let [blocks, messages] = playback.read_up_to(length)?;
        file.set_len(length)
            .and_then(|()| file.sync_data())
            .and_then(|()| file.seek(SeekFrom::End(0)))
            .map_err(failed())?;
        Self::begin(file, path, [length, blocks, messages], true)
    }

    /// Adds to a file that has so many bytes, blocks and messages.
    fn begin(
        file: File,
        path: &Path,
        [bytes, blocks, messages]: [u64; 3],
        resumed: bool,
    ) -> Result<Self, RecordingError> {
        let shared = Arc::new(Shared {
            state: Mutex::new(State {
                length: bytes,
                resumed,
                ..State::default()
            }),
            work: Condvar::new(),
            room: Condvar::new(),
            rounds: AtomicU64::new(NO_TAP),
        });
        let mut output = Output {
            file,
            path: path.to_path_buf(),
            bytes,
            blocks,
            messages,
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
        state.resumed &= channel.kind != Kind::Grant;
        if state.resumed {
            return;
        }
        let pending = &mut state.pending;
        let begin = pending.len();
        put(pending, channel, header, records);
        let end = pending.len();
        state.noted += (end - begin) as u64;
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

    /// Waits until all messages that were sent so far are written. Returns the length that the file then has: a run that
    /// goes on from here cuts it to that. `None` if it takes longer than [`SYNC_LIMIT`] or the recording has failed.
    /// Nothing may be sent meanwhile.
    pub fn flush(&self) -> Option<u64> {
        let end = Instant::now() + SYNC_LIMIT;
        if !self.heard(SYNC_LIMIT) {
            return None;
        }
        let noted = self.0.lock().noted;
        let written = |state: &mut State| {
            state.flushing = state.written < noted;
            !state.flushing
        };
        let state = self.0.wait(end, written)?;
        Some(state.length)
    }

    /// Waits until the tap has read all that was sent before this call; false after `at_most`.
    fn heard(&self, at_most: Duration) -> bool {
        let rounds = &self.0.rounds;
        // The tap may already have passed a channel in its present round when a message came. The next round reads all
        // of it.
        let after = rounds.load(Ordering::Acquire).saturating_add(2);
        let is_after = || (rounds.load(Ordering::Acquire) >= after).then_some(());
        until(at_most, LOOK, is_after).is_some()
    }

    /// Waits until the tap has looked into the channels of all solvers that are ready, so that no message passes it. A
    /// subscriber is connected to a publisher only when it first looks for messages after the publisher was made. Until
    /// then iceoryx2 drops what the buffer does not hold, without a word to the sender. If that takes more than
    /// [`SYNC_LIMIT`] the recording fails.
    pub fn listen(&self) {
        if !self.heard(SYNC_LIMIT) {
            let text = format!("it has not read for {SYNC_LIMIT:?}");
            self.fail(RecordingError::Tap(text));
        }
    }

    /// Waits until all messages so far are on disk, for at most [`SYNC_LIMIT`].
    pub fn sync(&self) {
        let noted = self.0.lock().noted;
        let synced = |state: &mut State| {
            state.syncing = state.synced < noted;
            !state.syncing
        };
        drop(self.0.wait(Instant::now() + SYNC_LIMIT, synced));
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
        let urgent = state.closed || state.flushing || state.syncing;
        if state.pending.len() < BLOCK && !urgent {
            let waited = shared.work.wait_timeout(state, UNWRITTEN);
            (state, _) = waited.expect("no holder has panicked");
        }
        messages.clear();
        std::mem::swap(&mut messages, &mut state.pending);
        let (closed, finished) = (state.closed, state.finished);
        let syncing = std::mem::take(&mut state.syncing);
        state.flushing = false;
        drop(state);
        shared.room.notify_all();
        output.write(&messages)?;
        if syncing {
            output.sync()?;
        }
        let mut state = shared.lock();
        state.written += messages.len() as u64;
        state.length = output.bytes;
        if syncing {
            state.synced = state.written;
        }
        drop(state);
        shared.room.notify_all();
        if closed {
            return if finished { output.end() } else { Ok(()) };
        }
    }
}

struct Output {
    file: File,
    path: PathBuf,
    /// Length of the file that has been written.
    bytes: u64,
    blocks: u64,
    messages: u64,
    packed: Vec<u8>,
}

impl Output {
    fn sync(&self) -> Result<(), RecordingError> {
        let synced = self.file.sync_data();
        synced.map_err(RecordingError::file("write", &self.path))
    }

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
        self.bytes += self.packed.len() as u64;
        self.blocks += 1;
        self.messages += u64::from(messages);
        Ok(())
    }
}
