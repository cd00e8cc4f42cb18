//! Writes a recording, in a separate thread.

use std::fs::File;
use std::io::{self, Write};
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::thread::JoinHandle;
use std::time::Duration;

use lz4_flex::frame::FrameEncoder;

use super::{About, END, NAME, RecordingError};
use crate::message::wire::{StepHeader, bytes_of};
use crate::message::{Channel, Records};
use crate::packed::{self, BlockSize};
use crate::transport::wait::until;

/// The writer wakes up when so many bytes wait for it. A torn file loses at most its last block, which is no longer.
const BLOCK: usize = 1 << 16;
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
    /// Messages that were added.
    messages: u64,
    finished: bool,
    /// The recorder has been dropped.
    closed: bool,
    failure: Option<RecordingError>,
}

/// Appends a message in the format of the file.
fn put(bytes: &mut Vec<u8>, channel: u8, header: &StepHeader, payload: &[u8]) {
    bytes.push(channel);
    bytes.extend((payload.len() as u32).to_le_bytes());
    bytes.extend_from_slice(bytes_of(std::slice::from_ref(header)));
    bytes.extend_from_slice(payload);
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
        file.write_all(&packed::head(NAME, about))
            .map_err(RecordingError::file("write", path))?;
        let shared = Arc::new(Shared {
            state: Mutex::default(),
            work: Condvar::new(),
            room: Condvar::new(),
            rounds: AtomicU64::new(NO_TAP),
        });
        let mut file = packed::packer(file, BlockSize::Max64KB);
        let failed = RecordingError::file("write", path);
        let for_writer = Arc::clone(&shared);
        let writer = std::thread::Builder::new()
            .name("recorder".into())
            .spawn(move || {
                if let Err(error) = write(&for_writer, &mut file) {
                    for_writer.fail(failed(error));
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
        if u32::try_from(records.bytes().len()).is_err() {
            drop(state);
            let what = format!("a message of {} has more than 4 GiB", channel.name());
            return self.0.fail(RecordingError::Tap(what));
        }
        state.messages += 1;
        let pending = &mut state.pending;
        let begin = pending.len();
        put(pending, channel.number() as u8, header, records.bytes());
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

/// Writes the messages that are added until the recorder is closed, and then the end if it is finished.
fn write(shared: &Shared, file: &mut FrameEncoder<File>) -> io::Result<()> {
    let mut messages = Vec::new();
    loop {
        let mut state = shared.lock();
        if state.pending.len() < BLOCK && !state.closed {
            let waited = shared.work.wait_timeout(state, UNWRITTEN);
            (state, _) = waited.expect("no holder has panicked");
        }
        messages.clear();
        std::mem::swap(&mut messages, &mut state.pending);
        let (closed, finished, count) = (state.closed, state.finished, state.messages);
        drop(state);
        shared.room.notify_all();
        if closed && finished {
            let count = count.to_le_bytes();
            put(&mut messages, END, &StepHeader::default(), &count);
        }
        file.write_all(&messages)?;
        file.flush()?;
        if closed && finished {
            file.try_finish()?;
            file.get_ref().sync_all()?;
        }
        if closed {
            return Ok(());
        }
    }
}
