//! The transfer of a saved state: pieces of bytes, and the hash of all of them at the end (clauses K-3, K-4).

use serde::{Deserialize, Serialize};

use super::error::SessionError;
use super::io::Io;
use crate::message::codec::decode_first;
use crate::message::wire::{StepHeader, flags};
use crate::message::{Channel, Kind, Records};

/// Largest number of bytes in a piece.
const PIECE: usize = 1 << 20;

/// The hash that ends a saved state.
fn hash(bytes: &[u8]) -> [u8; 32] {
    *blake3::hash(bytes).as_bytes()
}

/// The pieces of a state, each with the flags of its header; `end` is the state's [`hash`].
fn pieces<'a>(state: &'a [u8], end: &'a [u8; 32]) -> impl Iterator<Item = (&'a [u8], u64)> {
    let pieces = state.chunks(PIECE).map(|piece| (piece, 0));
    pieces.chain([(&end[..], flags::LAST)])
}

/// Sends a saved state from before `step`.
pub(super) async fn send(
    io: &Io,
    channel: Channel,
    step: u64,
    state: &[u8],
) -> Result<(), SessionError> {
    for (piece, flags) in pieces(state, &hash(state)) {
        let header = StepHeader {
            step,
            count: piece.len() as u64,
            flags,
            ..StepHeader::default()
        };
        let records = match channel.kind {
            Kind::Saved => Records::Saved(piece),
            _ => Records::Restore(piece),
        };
        io.send(channel, header, records).await?;
    }
    Ok(())
}

/// A state that is being received.
#[derive(Debug, Default)]
pub(super) struct Incoming {
    bytes: Vec<u8>,
}

impl Incoming {
    /// Takes a piece; returns the whole state if it was the last one.
    ///
    /// # Errors
    /// What is wrong with the piece.
    pub(super) fn take(
        &mut self,
        header: &StepHeader,
        piece: &[u8],
    ) -> Result<Option<Vec<u8>>, String> {
        if header.count != piece.len() as u64 {
            return Err(format!(
                "{} bytes announced, {} there",
                header.count,
                piece.len()
            ));
        }
        if header.flags & flags::LAST == 0 {
            if piece.is_empty() {
                return Err("an empty piece of a saved state".into());
            }
            self.bytes.extend_from_slice(piece);
            return Ok(None);
        }
        if *piece != hash(&self.bytes) {
            let bytes = self.bytes.len();
            return Err(format!(
                "the hash at the end is not that of the {bytes} bytes before it"
            ));
        }
        Ok(Some(core::mem::take(&mut self.bytes)))
    }
}

/// The session's own part of a saved state: the position at which the run continues.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Mark {
    pub step: u64,
    pub set: u64,
    pub imps: u64,
    pub items: u64,
    /// What the driver of the side has to remember.
    pub driver: Vec<u8>,
}

impl Mark {
    /// The mark at the beginning of a saved state, and the solver's own part, which follows it.
    pub fn read(saved: &[u8]) -> Option<(Self, &[u8])> {
        let (mark, used) = decode_first(saved).ok()?;
        Some((mark, &saved[used..]))
    }
}

/// The solver's own part of a saved state, which follows the session's.
pub fn solver_part(saved: &[u8]) -> &[u8] {
    Mark::read(saved).map_or(&[], |(_, solver)| solver)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn carry(bytes: &[u8]) -> Result<Vec<u8>, String> {
        let (end, mut into) = (hash(bytes), Incoming::default());
        let mut pieces = pieces(bytes, &end);
        while let Some((piece, flags)) = pieces.next() {
            let header = StepHeader {
                count: piece.len() as u64,
                flags,
                ..StepHeader::default()
            };
            if let Some(whole) = into.take(&header, piece)? {
                assert!(pieces.next().is_none(), "nothing follows the last piece");
                return Ok(whole);
            }
        }
        Err("there is no last piece".into())
    }

    #[test]
    fn a_state_of_any_length_arrives_whole() {
        for length in [0, 1, PIECE - 1, PIECE, PIECE + 1, 2 * PIECE, 2 * PIECE + 7] {
            let bytes: Vec<u8> = (0..length).map(|i| (i % 251) as u8).collect();
            assert_eq!(carry(&bytes).unwrap(), bytes, "{length}");
        }
    }
}
