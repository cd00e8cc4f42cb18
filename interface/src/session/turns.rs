//! Turns: one party does one thing at a time.

use std::time::{Duration, Instant};

use crate::core::Wait;
use crate::message::Payload;
use crate::transport::Transport;
use crate::transport::wait::{NAP, POLL};

/// What came of a turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Turn {
    /// Something was done; there is more.
    Went,
    /// There is nothing to do until something comes.
    Waits(Wait),
    /// The session of this party is over.
    Ended,
}

/// A party that takes turns.
pub trait Turns {
    /// Does one thing, or looks once for what it waits for.
    fn turn(&mut self, transport: &mut dyn Transport) -> Turn;

    /// Looks, during a long wait, for what nobody waits for: an abort, a death. Whether there was something.
    fn look_up(&mut self, transport: &mut dyn Transport) -> bool;

    /// The time of the present wait is over.
    fn expire(&mut self, waited: Duration);
}

/// Lets `party` take turns until its session is over, waiting as [`crate::transport::wait`] says.
pub fn drive(party: &mut dyn Turns, transport: &mut dyn Transport) {
    loop {
        match party.turn(transport) {
            Turn::Went => {}
            Turn::Waits(wait) => block(party, transport, &wait),
            Turn::Ended => return,
        }
    }
}

/// Waits until there is something to do.
fn block(party: &mut dyn Turns, transport: &mut dyn Transport, wait: &Wait) {
    let start = Instant::now();
    loop {
        let window = Instant::now();
        // The last look is one after the whole of it: B-4 rests on that.
        loop {
            std::thread::yield_now();
            let looks = window.elapsed();
            if !matches!(party.turn(transport), Turn::Waits(_)) {
                return;
            }
            if looks >= POLL {
                break;
            }
        }
        let waited = start.elapsed();
        if waited >= wait.at_most {
            return party.expire(waited);
        }
        transport.sleep(wait.from, NAP.min(wait.at_most.saturating_sub(waited)));
        if !matches!(party.turn(transport), Turn::Waits(_)) || party.look_up(transport) {
            return;
        }
    }
}

/// Where messages are copied to: one buffer for each kind, so that memory is used again.
pub(crate) struct Inbox([Payload; crate::message::Kind::ALL.len()]);

impl Inbox {
    pub(crate) fn new() -> Self {
        Self(crate::message::Kind::ALL.map(Payload::empty))
    }

    /// The buffer for messages of this kind.
    pub(crate) fn of(&mut self, kind: crate::message::Kind) -> &mut Payload {
        &mut self.0[kind as usize]
    }
}
