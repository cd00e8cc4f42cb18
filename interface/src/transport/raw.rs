//! The raw ends of a run, to test a solver.
//!
//! A [`RawRun`] creates every channel of a run for one solver and holds all other ends: the coupler's and the peer's.
//! It sends and receives [`Message`]s as they are: any header, any records, any bytes, in any order. Nothing is checked
//! here, on purpose. Solvers and the coupler use [`crate::session`].

use std::time::Duration;

use std::cell::RefCell;

use crate::message::control::Party;
pub use crate::message::{Channel, Kind, Message, Payload};
use crate::transport::Transport;
pub use crate::transport::TransportError as ChannelError;
use crate::transport::domain::{Domain, OwnedDomain};
pub use crate::transport::iceoryx::Medium;
use crate::transport::iceoryx::{Created, create, join};

/// Longest wait of a send to a full channel. It is short so that the kit soon sees that a solver takes nothing.
const SEND_TIMEOUT: Duration = Duration::from_secs(1);

/// The other ends of one solver's run: the coupler's and the peer's. Dropping it ends the run as a coupler's death does.
pub struct RawRun {
    solver: Party,
    coupler: RefCell<Box<dyn Transport>>,
    peer: RefCell<Box<dyn Transport>>,
    created: Created,
    // Last, so that the ports are gone before the directory is.
    domain: OwnedDomain,
}

impl RawRun {
    /// Creates every channel that `solver` may open, those of a coupled run included.
    ///
    /// # Errors
    /// [`ChannelError`].
    pub fn open(medium: Medium, solver: Party) -> Result<Self, ChannelError> {
        let domain = OwnedDomain::create()?;
        let names = domain.domain();
        let created = create(medium, names, &[Party::Mpm, Party::Dem], false)?;
        let coupler = join(medium, names, Party::Coupler, &[solver], SEND_TIMEOUT)?;
        let other = if solver == Party::Mpm {
            Party::Dem
        } else {
            Party::Mpm
        };
        let mut peer = join(medium, names, other, &[], SEND_TIMEOUT)?;
        peer.open_measurement()?;
        peer.open_exchange()?;
        Ok(Self {
            solver,
            coupler: RefCell::new(coupler),
            peer: RefCell::new(peer),
            created,
            domain,
        })
    }

    /// The run's names, by which the solver joins.
    pub fn domain(&self) -> &Domain {
        self.domain.domain()
    }

    /// To the solver the coupler is gone from now on, though the channels are still there.
    pub fn release(&self) {
        self.domain.release();
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

    /// Sends a message as it is, without a bell.
    ///
    /// # Errors
    /// [`ChannelError::Full`] when the solver takes nothing.
    pub fn send_silently(&self, message: &Message) -> Result<(), ChannelError> {
        let channel = self.channel(message.kind());
        let mut ends = self.ends(channel).borrow_mut();
        ends.send_silently(channel, message)
    }

    /// Sends a message as it is, with the bell of B-2.
    ///
    /// # Errors
    /// [`ChannelError::Full`] when the solver takes nothing.
    pub fn send(&self, message: &Message) -> Result<(), ChannelError> {
        let channel = self.channel(message.kind());
        let mut ends = self.ends(channel).borrow_mut();
        ends.send_and_ring(channel, message)
    }

    /// The next message of this kind, if there is one.
    ///
    /// # Errors
    /// [`ChannelError`].
    pub fn receive(&self, kind: Kind) -> Result<Option<Message>, ChannelError> {
        let channel = self.channel(kind);
        self.ends(channel).borrow_mut().take(channel)
    }

    /// Sleeps until the bell that goes with this kind rings, for `nap` at most; returns how often it rang.
    pub fn sleep(&self, kind: Kind, nap: Duration) -> u64 {
        let channel = self.channel(kind);
        let mut ends = self.ends(channel).borrow_mut();
        ends.sleep(channel.from(), nap)
    }

    /// Channels and bells that the solver has not opened at its end.
    pub fn unopened(&self) -> Vec<&str> {
        self.created.unopened(self.solver)
    }
}
