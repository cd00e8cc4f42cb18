//! States that a solver has saved (clauses K-3, K-4): taken in pieces, handed to a fresh solver.

use interface::control::{Configure, Order};
use interface::stage::{Kind, Message, Payload};
use interface::step::Clock;
use interface::wire::{ImpInfo, StepHeader, flags};

use super::flow::Flow;
use super::lockstep::Play;
use super::timeline::Timeline;
use super::{Bench, Budget, Reply, Session};
use crate::verdict::{Unmet, broken};

/// Bytes of a piece, at most.
const PIECE: usize = 1 << 20;

/// Where a run stood when its state was saved, as far as the kit knows.
#[derive(Debug, Clone)]
pub struct Stand {
    clock: Clock,
    epoch: u64,
    generation: u64,
    set: Vec<ImpInfo>,
}

impl Stand {
    fn timeline(&self) -> Timeline {
        Timeline {
            clock: self.clock,
            epoch: self.epoch,
        }
    }
}

impl Session<'_> {
    /// The state that was sent before the report that has come.
    ///
    /// # Errors
    /// [`Unmet::Broken`] when it is not there, or not as K-3 says.
    pub fn saved(&mut self) -> Result<Vec<u8>, Unmet> {
        let mut state = Vec::new();
        loop {
            let Some(message) = self.take(Kind::Saved)? else {
                return Err(broken(
                    "a saved state before the report, with its end",
                    "none",
                ));
            };
            let Payload::Saved(piece) = message.payload else {
                unreachable!("only pieces come on their channel");
            };
            if message.header.count != piece.len() as u64 {
                let got = format_args!("{} announced", message.header.count);
                return Err(broken(format_args!("{} bytes", piece.len()), got));
            }
            if message.header.flags & flags::LAST != 0 {
                let hash = blake3::hash(&state);
                if piece != hash.as_bytes() {
                    return Err(broken("the hash of all bytes before", "another"));
                }
                return Ok(state);
            }
            if piece.is_empty() || piece.len() > PIECE {
                let expected = "a piece of 1 byte to 1 MiB";
                return Err(broken(expected, format_args!("{} bytes", piece.len())));
            }
            state.extend(piece);
        }
    }

    /// Hands over a configuration with a state to restore, whose hash `spoil` may change, and waits for what the solver
    /// says to it.
    ///
    /// # Errors
    /// [`Unmet::Broken`].
    pub fn restore(
        &mut self,
        configure: &Configure,
        state: &[u8],
        spoil: impl FnOnce(&mut [u8; 32]),
    ) -> Result<Reply, Unmet> {
        self.order(&Order::Configure(Configure {
            restore: true,
            ..configure.clone()
        }))?;
        for piece in state.chunks(PIECE) {
            let header = StepHeader::default();
            self.send(&Message::new(header, Payload::Restore(piece.to_vec())))?;
        }
        let mut hash = *blake3::hash(state).as_bytes();
        spoil(&mut hash);
        let header = StepHeader {
            flags: flags::LAST,
            ..StepHeader::default()
        };
        self.send(&Message::new(header, Payload::Restore(hash.to_vec())))?;
        self.reply()
    }
}

impl<'b> Play<'b> {
    /// Where the run stands.
    pub fn stand(&self) -> Stand {
        let (generation, set) = self.imps();
        Stand {
            clock: self.timeline().clock,
            epoch: self.timeline().epoch,
            generation,
            set: set.to_vec(),
        }
    }

    /// The run goes on in a fresh solver, which is ready.
    pub fn resumed(session: Session<'b>, window: u64, stand: &Stand) -> Self {
        let mut play = Self::new(session, window);
        play.go_on(stand.timeline(), stand.generation, stand.set.clone());
        play
    }
}

impl Flow<'_> {
    /// Where the run stands.
    pub fn stand(&self) -> Stand {
        Stand {
            clock: self.timeline().clock,
            epoch: self.timeline().epoch,
            generation: self.generation(),
            set: self.set.clone(),
        }
    }
}

impl Bench {
    /// A run of a continuum that goes on in a fresh solver.
    ///
    /// # Errors
    /// [`Unmet`].
    pub fn flow_resumed(
        &self,
        order: &Configure,
        state: &[u8],
        stand: &Stand,
    ) -> Result<Flow<'_>, Unmet> {
        let mut session = self.session()?;
        session.hello()?;
        match session.restore(order, state, |_| {})? {
            Reply::Ready(ready) => {
                let mut flow = Flow::new(session, ready, self.window, true);
                flow.budget = Budget::ALL;
                flow.go_on(stand.timeline(), stand.generation, stand.set.clone());
                Ok(flow)
            }
            Reply::Refused(refusal) => Err(broken("Ready after the restored state", refusal)),
        }
    }
}
