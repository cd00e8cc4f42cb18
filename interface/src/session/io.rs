//! What a party of a session does with its channels: it sends, and it waits for a message.
//!
//! A session is an `async` function that is polled by hand. It is pending in two places only: where it waits for a message
//! ([`Io::arrival`]), and after every message ([`Io::pause`]), so that whoever polls it decides what happens between two
//! messages.

use std::cell::{Cell, OnceCell, RefCell};
use std::future::poll_fn;
use std::task::Poll;
use std::time::Duration;

use super::error::SessionError;
use super::stopwatch::{Activity, Stopwatch};
use crate::message::control::Party;
use crate::message::wire::StepHeader;
use crate::message::{Channel, Message, Records};
use crate::recording::RecordingSink;
use crate::transport::{Ends, Transport, TransportError};

/// The party and the deadline of a wait.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wait {
    /// Whose message is awaited.
    pub from: Party,
    /// Deadline (clause S-11).
    pub at_most: Duration,
}

/// What the caller of [`Session::turn`](super::Session::turn) has found out about the present wait.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) enum Signal {
    /// Nothing.
    #[default]
    None,
    /// It has lasted for so long: look for what nobody waits for, an abort or the end of a process.
    LookUp(Duration),
    /// Its deadline is over, after this silence.
    Expired(Duration),
}

/// Where messages are recorded, and on which channels.
type Recording = (RecordingSink, fn(Channel) -> bool);

/// Notes a message if its channel is recorded. Most runs record nothing, so this is not in the way of their messages.
#[cold]
fn record((sink, notes): &Recording, channel: Channel, header: &StepHeader, records: Records<'_>) {
    if notes(channel) {
        sink.note(channel, header, records);
    }
}

/// A party's ends of the channels, and what it has in common with whoever polls its session.
pub(super) struct Io {
    transport: RefCell<Ends>,
    watch: RefCell<Stopwatch>,
    pub recording: OnceCell<Recording>,
    /// The wait in which the session is pending; `None` if it can go on.
    pub wait: Cell<Option<Wait>>,
    pub signal: Cell<Signal>,
    /// Whether the session is pending after every message.
    pub stepwise: Cell<bool>,
    /// Messages sent and received.
    pub messages: Cell<u64>,
    /// First step that is not done.
    pub step: Cell<u64>,
}

impl Io {
    pub fn new(transport: Ends, watch: Stopwatch) -> Self {
        Self {
            transport: RefCell::new(transport),
            watch: RefCell::new(watch),
            recording: OnceCell::new(),
            wait: Cell::new(None),
            signal: Cell::default(),
            stepwise: Cell::new(true),
            messages: Cell::new(0),
            step: Cell::new(0),
        }
    }

    /// Sends a message and wakes its receiver, at once; the future is the pause after it.
    pub fn send(
        &self,
        channel: Channel,
        header: StepHeader,
        records: Records<'_>,
    ) -> impl Future<Output = Result<(), SessionError>> {
        self.lap(Activity::Compute);
        if let Some(recording) = self.recording.get() {
            record(recording, channel, &header, records);
        }
        let sent = self.with(|transport| {
            transport.send(channel, &header, records)?;
            if channel.wakes() {
                transport.wake(channel.to());
            }
            Ok::<_, TransportError>(())
        });
        self.lap(Activity::Exchange);
        async {
            sent?;
            self.pause().await;
            Ok(())
        }
    }

    /// Takes the next message of `channel`; returns whether there is one.
    pub fn receive(&self, channel: Channel, into: &mut Message) -> Result<bool, SessionError> {
        let received = self.with(|transport| transport.receive(channel, into))?;
        if let (Some(recording), true) = (self.recording.get(), received) {
            record(recording, channel, &into.header, into.payload.records());
        }
        Ok(received)
    }

    /// Waits until `look` finds something or fails. It also learns what is known about the wait.
    pub async fn arrival<T>(
        &self,
        wait: Wait,
        mut look: impl FnMut(Signal) -> Result<Option<T>, SessionError>,
    ) -> Result<T, SessionError> {
        self.lap(Activity::Compute);
        let found = poll_fn(|_| match look(self.signal.take()) {
            Ok(Some(found)) => Poll::Ready(Ok(found)),
            Ok(None) => {
                self.wait.set(Some(wait));
                Poll::Pending
            }
            Err(error) => Poll::Ready(Err(error)),
        })
        .await?;
        self.lap(Activity::Wait);
        self.pause().await;
        Ok(found)
    }

    /// A message has been sent or received.
    async fn pause(&self) {
        self.messages.set(self.messages.get() + 1);
        let mut paused = !self.stepwise.get();
        poll_fn(|_| {
            if std::mem::replace(&mut paused, true) {
                Poll::Ready(())
            } else {
                Poll::Pending
            }
        })
        .await;
    }

    /// Does something with the transport.
    pub fn with<T>(&self, act: impl FnOnce(&mut dyn Transport) -> T) -> T {
        act(&mut **self.transport.borrow_mut())
    }

    /// Adds the time since the last lap to `activity`.
    pub fn lap(&self, activity: Activity) {
        self.watch.borrow_mut().lap(activity, self.step.get());
    }

    /// Notes in the timeline, if there is one, that this begins.
    pub fn mark(&self, what: &str) {
        if let Some(trace) = &mut self.watch().trace {
            trace.mark(what, self.step.get());
        }
    }

    /// The party's time so far.
    pub fn watch(&self) -> std::cell::RefMut<'_, Stopwatch> {
        self.watch.borrow_mut()
    }
}
