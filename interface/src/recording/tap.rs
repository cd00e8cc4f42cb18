//! Reads the messages between the two solvers of a recorded run over shared memory.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::thread::JoinHandle;
use std::time::Duration;

use super::{RecordingError, RecordingSink};
use crate::message::control::Party;
use crate::message::{Channel, Kind, Message};
use crate::transport::domain::Domain;
use crate::transport::iceoryx;
use crate::transport::wait::nap;
use crate::transport::{Transport, TransportError};

/// Sleep between two looks. A channel of a recorded run has room for many more messages than are sent in this time, so
/// no solver waits for the tap, and the tap takes no processor from a solver.
const NAP: Duration = Duration::from_micros(500);

/// A second receiver of every channel between the solvers. When it is dropped, it first reads what is left in them.
pub struct Tap {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

/// The channels between the solvers, in the order within a step, so that the order in the file is nearly that of the run.
const KINDS: [Kind; 4] = [Kind::Envelopes, Kind::Set, Kind::States, Kind::Forces];

/// Records everything that is there; returns whether there was anything.
fn drain(
    transport: &mut dyn Transport,
    buffers: &mut [Message],
    sink: &RecordingSink,
) -> Result<bool, TransportError> {
    let mut any = false;
    for (kind, buffer) in KINDS.into_iter().zip(buffers) {
        let channel = Channel::of(Party::Mpm, kind);
        while transport.receive(channel, buffer)? {
            sink.note(channel, &buffer.header, buffer.payload.records());
            any = true;
        }
    }
    Ok(any)
}

impl Tap {
    /// Begins to listen.
    ///
    /// # Errors
    /// [`RecordingError::Tap`].
    pub fn open(domain: &Domain, sink: RecordingSink) -> Result<Self, RecordingError> {
        let stop = Arc::new(AtomicBool::new(false));
        let (stopped, domain) = (Arc::clone(&stop), domain.clone());
        let (opened, listening) = mpsc::channel();
        let thread = std::thread::Builder::new()
            .name("tap".into())
            .spawn(move || {
                // Ports cannot leave the thread that made them.
                let mut ends = match iceoryx::listen(&domain) {
                    Ok(ends) => ends,
                    Err(e) => {
                        let _ = opened.send(Err(e));
                        return;
                    }
                };
                sink.tapped(true);
                let _ = opened.send(Ok(()));
                let mut buffers = KINDS.map(Message::empty);
                loop {
                    let last = stopped.load(Ordering::Acquire);
                    match drain(&mut *ends, &mut buffers, &sink) {
                        Ok(true) => sink.round(),
                        Ok(false) if last => return sink.tapped(false),
                        Ok(false) => {
                            sink.round();
                            nap(NAP);
                        }
                        Err(e) => {
                            sink.tapped(false);
                            return sink.fail(RecordingError::Tap(e.to_string()));
                        }
                    }
                }
            })
            .map_err(|e| RecordingError::Tap(e.to_string()))?;
        let tap = Self {
            stop,
            thread: Some(thread),
        };
        match listening.recv() {
            Ok(Ok(())) => Ok(tap),
            Ok(Err(e)) => Err(RecordingError::Tap(e.to_string())),
            Err(e) => Err(RecordingError::Tap(e.to_string())),
        }
    }
}

impl Drop for Tap {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
