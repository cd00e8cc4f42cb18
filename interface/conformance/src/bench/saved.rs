//! States that a solver has saved (clauses K-3, K-4): taken in pieces, handed to a fresh solver.

use interface::message::control::{Configure, Order, Ready};
use interface::message::wire::{StepHeader, flags};
use interface::message::{Kind, Message, Payload};

use super::run::records;
use super::session::Session;
use crate::verdict::{Unmet, broken};

/// Bytes of a piece, at most.
const PIECE: usize = 1 << 20;

impl Session<'_> {
    /// The state that was sent before the report that has come.
    pub fn saved(&mut self) -> Result<Vec<u8>, Unmet> {
        let mut state = Vec::new();
        loop {
            let Some(message) = self.take(Kind::Saved)? else {
                return Err(broken(
                    "a saved state before the report, with its end",
                    "none",
                ));
            };
            let (header, piece) = records!(message, Saved);
            if header.count != piece.len() as u64 {
                let got = format_args!("{} announced", header.count);
                return Err(broken(format_args!("{} bytes", piece.len()), got));
            }
            if header.flags & flags::LAST != 0 {
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

    /// Hands over a configuration with a state to restore, and waits for what the solver says to it.
    pub fn restore(&mut self, configure: &Configure, state: &[u8]) -> Result<Ready, Unmet> {
        self.order(&Order::Configure(Configure {
            restore: true,
            ..configure.clone()
        }))?;
        let hash = blake3::hash(state);
        let pieces = state.chunks(PIECE).map(|piece| (0, piece));
        for (flags, piece) in pieces.chain([(flags::LAST, &hash.as_bytes()[..])]) {
            let header = StepHeader {
                flags,
                ..StepHeader::default()
            };
            self.send(&Message::new(header, Payload::Restore(piece.to_vec())))?;
        }
        self.reply()
    }
}
