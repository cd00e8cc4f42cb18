//! The part of a run that one of its solvers saw, read from the run's recording to be played to that solver again.

use std::cell::RefCell;
use std::path::Path;
use std::rc::Rc;

use super::rerun::Reference;
use super::{Playback, RecordingError};
use crate::message::control::Party;
use crate::message::wire::{Grant, StepHeader};
use crate::message::{Channel, Kind, Payload, Records};

/// What one solver was sent, and what it answered. Copies are of the same script: a message is taken once.
#[derive(Debug, Clone)]
pub struct Script(Rc<RefCell<State>>);

#[derive(Debug)]
struct State {
    solver: Party,
    reference: Reference,
    failure: Option<RecordingError>,
}

impl Script {
    /// The part of `solver` in the recording at `path`.
    ///
    /// # Errors
    /// [`RecordingError`].
    pub fn open(path: &Path, solver: Party) -> Result<Self, RecordingError> {
        let state = State {
            solver,
            reference: Reference::of(solver, Playback::open(path)?),
            failure: None,
        };
        Ok(Self(Rc::new(RefCell::new(state))))
    }

    /// Whose part it is.
    pub fn solver(&self) -> Party {
        self.0.borrow().solver
    }

    /// The next grant; `None` at the end of the recording.
    ///
    /// # Errors
    /// [`RecordingError`].
    pub fn grant(&self) -> Result<Option<Grant>, RecordingError> {
        let mut state = self.0.borrow_mut();
        let channel = Channel::of(state.solver, Kind::Grant);
        let Some(message) = state.reference.take(channel)? else {
            return Ok(None);
        };
        match message.records::<Grant>().as_deref() {
            Some([grant]) => Ok(Some(*grant)),
            _ => Err(state.differs(channel, message.header.step)),
        }
    }

    /// Why the script cannot be played on: the solver has answered otherwise, or the recording cannot be read.
    pub fn failure(&self) -> Option<RecordingError> {
        self.0.borrow().failure.clone()
    }

    /// The header of the next message of a channel, which stays the next.
    pub(crate) fn next(&self, channel: Channel) -> Option<StepHeader> {
        let mut state = self.0.borrow_mut();
        if state.failure.is_some() {
            return None;
        }
        match state.reference.peek(channel) {
            Ok(message) => message.map(|message| message.header),
            Err(error) => {
                state.failure = Some(error);
                None
            }
        }
    }

    /// The next message of a channel, which belongs to a step that the recording has.
    pub(crate) fn take(&self, channel: Channel) -> Option<(StepHeader, Payload)> {
        let mut state = self.0.borrow_mut();
        let failure = match state.reference.take(channel) {
            Ok(Some(message)) => match Payload::read(channel.kind, &message.payload) {
                Some(payload) => return Some((message.header, payload)),
                None => state.differs(channel, message.header.step),
            },
            Ok(None) => state.differs(channel, 0),
            Err(error) => error,
        };
        state.failure.get_or_insert(failure);
        None
    }

    /// Compares an answer of the solver with the recorded one.
    pub(crate) fn compare(&self, channel: Channel, header: &StepHeader, records: Records<'_>) {
        let mut payload = Vec::new();
        records.write(&mut payload);
        let mut state = self.0.borrow_mut();
        let failure = match state.reference.compare(channel, header, &payload) {
            Ok(Some(true)) => return,
            // What a solver says of itself is compared with nothing; more of it is for the session to judge.
            Ok(None) if channel.kind == Kind::Notice => return,
            Ok(_) => state.differs(channel, header.step),
            Err(error) => error,
        };
        state.failure.get_or_insert(failure);
    }
}

impl State {
    fn differs(&self, channel: Channel, step: u64) -> RecordingError {
        RecordingError::Differs {
            path: self.reference.path().to_path_buf(),
            channel: channel.name(),
            step,
        }
    }
}
