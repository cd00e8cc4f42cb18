//! Turns: one party does one thing at a time.

use std::time::Duration;

use crate::core::Wait;
use crate::message::Payload;
use crate::message::control::Party;
use crate::transport::Transport;
use crate::transport::wait::{Awaited, Spin, wait};

/// The result of a turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Turn {
    /// Something was done, and there may be more to do.
    Went,
    /// There is nothing to do until a message arrives.
    Waits(Wait),
    /// The session of this party is over.
    Ended,
}

/// A party that takes turns.
pub trait Turns {
    /// Does one thing, or looks once for the message that it waits for.
    fn turn(&mut self, transport: &mut dyn Transport) -> Turn;

    /// Looks during a long wait for what nobody waits for: an abort, or the end of a process. Returns whether there was
    /// something.
    fn look_up(&mut self, transport: &mut dyn Transport) -> bool;

    /// The deadline of the present wait is over.
    fn expire(&mut self, waited: Duration);
}

/// Lets `party` take turns until its session is over, waiting as [`crate::transport::wait`] says.
pub fn drive(party: &mut dyn Turns, transport: &mut dyn Transport) {
    let mut spins = [Spin::default(); Party::ALL.len()];
    loop {
        match party.turn(transport) {
            Turn::Went => {}
            Turn::Waits(Wait { from, at_most, .. }) => {
                let spin = &mut spins[from as usize];
                let mut next = NextTurn {
                    party,
                    transport,
                    from,
                };
                if let Err(waited) = wait(&mut next, spin, at_most) {
                    party.expire(waited);
                }
            }
            Turn::Ended => return,
        }
    }
}

/// The next turn of a party, once there is something to do.
struct NextTurn<'a> {
    party: &'a mut dyn Turns,
    transport: &'a mut dyn Transport,
    /// Whose message is awaited.
    from: Party,
}

impl Awaited for NextTurn<'_> {
    type Found = ();

    fn look(&mut self) -> Option<()> {
        let turn = self.party.turn(self.transport);
        (!matches!(turn, Turn::Waits(_))).then_some(())
    }

    fn block(&mut self, at_most: Duration) {
        self.transport.sleep(self.from, at_most);
    }

    fn interruption(&mut self) -> Option<()> {
        self.party.look_up(self.transport).then_some(())
    }

    fn held(&mut self) -> bool {
        self.transport.held().is_some()
    }
}

/// Buffers for received messages, one for each kind, so that memory is reused.
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
