//! Hears what passes between the two solvers.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::thread::JoinHandle;
use std::time::Duration;

use iceoryx2::prelude::Service;

use super::{RecordingError, Tape};
use crate::channel::{ChannelError, ENVELOPES, IMP_FORCES, IMP_SET, IMP_STATES, Inlet, Post};
use crate::control::Party;
use crate::domain::Domain;
use crate::wire::{EnvelopeVertex, ImpForce, ImpInfo, ImpState};

/// Sleep between two looks. A channel of a recorded run holds `channel::RECORDED_BUFFER` messages, many more than cross
/// in this time, so nobody waits for the tap; and nobody is kept from a processor by it.
const NAP: Duration = Duration::from_micros(500);

/// A second subscriber of every channel between the solvers. Dropping it takes what is left in them first.
pub(crate) struct Tap {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

struct Ends<S: Service> {
    set: Inlet<S, ImpInfo>,
    states: Inlet<S, ImpState>,
    forces: Inlet<S, ImpForce>,
    envelopes: Inlet<S, EnvelopeVertex>,
}

impl<S: Service + 'static> Ends<S> {
    fn open(domain: &Domain, tape: &Tape) -> Result<Self, ChannelError> {
        let post = Post::<S>::open(domain, Party::Coupler)?.recording(tape.clone());
        Ok(Self {
            set: post.inlet(&IMP_SET)?,
            states: post.inlet(&IMP_STATES)?,
            forces: post.inlet(&IMP_FORCES)?,
            envelopes: post.inlet(&ENVELOPES)?,
        })
    }

    /// Takes everything that is there; whether there was anything. Receiving is recording: [`Inlet::receive`] notes.
    fn drain(&self) -> Result<bool, ChannelError> {
        let mut any = false;
        // In the order of a step, so that the file has nearly the order of the run.
        while self.envelopes.receive(&mut Vec::new())?.is_some() {
            any = true;
        }
        while self.set.receive(&mut Vec::new())?.is_some() {
            any = true;
        }
        while self.states.receive(&mut Vec::new())?.is_some() {
            any = true;
        }
        while self.forces.receive(&mut Vec::new())?.is_some() {
            any = true;
        }
        Ok(any)
    }
}

impl Tap {
    /// Listens from now on.
    pub(crate) fn open<S: Service + 'static>(
        domain: &Domain,
        tape: Tape,
    ) -> Result<Self, RecordingError> {
        let stop = Arc::new(AtomicBool::new(false));
        let (stopped, domain) = (Arc::clone(&stop), domain.clone());
        let (opened, listening) = mpsc::channel();
        let thread = std::thread::Builder::new()
            .name("tap".into())
            .spawn(move || {
                // Ports stay in the thread that made them.
                let ends = match Ends::<S>::open(&domain, &tape) {
                    Ok(ends) => ends,
                    Err(e) => {
                        let _ = opened.send(Err(e));
                        return;
                    }
                };
                let _ = opened.send(Ok(()));
                loop {
                    let last = stopped.load(Ordering::Acquire);
                    match ends.drain() {
                        Ok(true) => {}
                        Ok(false) if last => return,
                        Ok(false) => std::thread::sleep(NAP),
                        Err(e) => return tape.fail(RecordingError::Tap(e.to_string())),
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
