//! The raw ends of a run, to test a solver.
//!
//! A [`RawRun`] creates every channel of a run for one solver and holds all other ends: the coupler's and the peer's. The
//! solver is a process, which joins the run, or it gets its ends in this thread ([`RawRun::in_thread`]). A raw run sends and
//! receives [`Message`]s as they are: any header, any records, any bytes, in any order. Nothing is checked here, on purpose.
//! Solvers and the coupler use [`crate::session`].

use std::time::Duration;

use std::cell::RefCell;

use crate::message::control::Party;
pub use crate::message::{Channel, Kind, Message, Payload};
use crate::transport::Transport;
pub use crate::transport::TransportError as ChannelError;
use crate::transport::direct::Direct;
use crate::transport::domain::{Domain, OwnedDomain};
use crate::transport::iceoryx::{Created, create, join};

/// Longest wait of a send to a full channel. It is short, so that the kit soon notices that a solver takes nothing.
const SEND_TIMEOUT: Duration = Duration::from_secs(1);

/// The other ends of one solver's run: the coupler's and the peer's. When it is dropped, the run ends as if the coupler
/// had died.
pub struct RawRun {
    solver: Party,
    coupler: RefCell<Box<dyn Transport>>,
    peer: RefCell<Box<dyn Transport>>,
    // The last field, so that the ports are dropped before the directory is removed.
    channels: Channels,
}

/// Where the channels are.
enum Channels {
    /// In shared memory.
    Shared(Created, OwnedDomain),
    /// In one thread.
    Thread(Direct),
}

impl RawRun {
    /// Creates every channel that `solver` may open, including those of a coupled run. The names are those with which it
    /// joins.
    ///
    /// # Errors
    /// [`ChannelError`].
    pub fn open(solver: Party) -> Result<(Self, Domain), ChannelError> {
        let domain = OwnedDomain::create()?;
        let names = domain.domain();
        let created = create(names, &[Party::Mpm, Party::Dem], false)?;
        let coupler = join(names, Party::Coupler, &[solver], SEND_TIMEOUT)?;
        let other = solver.other_solver().expect("a solver is under test");
        let mut peer = join(names, other, &[], SEND_TIMEOUT)?;
        peer.open(&Channel::before_ready(other, true))?;
        let names = names.clone();
        let run = Self {
            solver,
            coupler: RefCell::new(coupler),
            peer: RefCell::new(peer),
            channels: Channels::Shared(created, domain),
        };
        Ok((run, names))
    }

    /// The same without shared memory, and the ends of a `solver` that takes turns with this run in one thread.
    pub fn in_thread(solver: Party) -> (Self, Box<dyn Transport>) {
        let ends = Direct::new();
        let other = solver.other_solver().expect("a solver is under test");
        let run = Self {
            solver,
            coupler: RefCell::new(Box::new(ends.clone())),
            peer: RefCell::new(Box::new(ends.of(other))),
            channels: Channels::Thread(ends.clone()),
        };
        (run, Box::new(ends.of(solver)))
    }

    /// From now on the solver sees the coupler as gone, although the channels still exist.
    pub fn release(&self) {
        match &self.channels {
            Channels::Shared(_, domain) => domain.release(),
            Channels::Thread(ends) => ends.release(),
        }
    }

    fn channel(&self, kind: Kind) -> Channel {
        Channel::of(self.solver, kind)
    }

    fn ends(&self, channel: Channel) -> &RefCell<Box<dyn Transport>> {
        if channel.is_between_solvers() {
            &self.peer
        } else {
            &self.coupler
        }
    }

    /// Sends a message as it is, and wakes nobody.
    ///
    /// # Errors
    /// [`ChannelError::Full`] if the solver takes nothing.
    pub fn send_silently(&self, message: &Message) -> Result<(), ChannelError> {
        let channel = self.channel(message.kind());
        let mut ends = self.ends(channel).borrow_mut();
        ends.send_silently(channel, message)
    }

    /// Sends a message as it is, and wakes its receiver as B-2 says.
    ///
    /// # Errors
    /// [`ChannelError::Full`] if the solver takes nothing.
    pub fn send(&self, message: &Message) -> Result<(), ChannelError> {
        let channel = self.channel(message.kind());
        let mut ends = self.ends(channel).borrow_mut();
        ends.send_and_wake(channel, message)
    }

    /// The next message of this kind, if there is one.
    ///
    /// # Errors
    /// [`ChannelError`].
    pub fn receive(&self, kind: Kind) -> Result<Option<Message>, ChannelError> {
        let channel = self.channel(kind);
        self.ends(channel).borrow_mut().take(channel)
    }

    /// Blocks until the sender of this kind wakes this end, for `nap` at most; returns how often it has since the last call.
    pub fn sleep(&self, kind: Kind, nap: Duration) -> u64 {
        let channel = self.channel(kind);
        let mut ends = self.ends(channel).borrow_mut();
        ends.sleep(channel.from(), nap)
    }

    /// Channels that the solver has not opened at its end.
    pub fn unopened(&self) -> Vec<&str> {
        match &self.channels {
            Channels::Shared(created, _) => created.unopened(self.solver),
            Channels::Thread(ends) => ends.unopened(self.solver),
        }
    }
}
