//! The transfer of a saved state: pieces of bytes, and the hash of all of them at the end (clauses K-3, K-4).

use crate::message::wire::{StepHeader, flags};

/// Largest number of bytes in a piece.
pub const PIECE: usize = 1 << 20;

/// The hash that ends a saved state.
fn hash(bytes: &[u8]) -> [u8; 32] {
    *blake3::hash(bytes).as_bytes()
}

/// A state that is being sent.
#[derive(Debug, Default)]
pub(crate) struct Outgoing {
    bytes: Vec<u8>,
    /// Where the piece that is being sent begins.
    from: usize,
    last: [u8; 32],
    ended: bool,
}

impl Outgoing {
    /// Begins to send `bytes`.
    pub(crate) fn new(bytes: Vec<u8>) -> Self {
        Self {
            last: hash(&bytes),
            bytes,
            from: 0,
            ended: false,
        }
    }

    /// The piece to be sent, and the flags of its header.
    pub(crate) fn piece(&self) -> (&[u8], u64) {
        if self.from < self.bytes.len() {
            let to = self.bytes.len().min(self.from + PIECE);
            (&self.bytes[self.from..to], 0)
        } else {
            (&self.last, flags::LAST)
        }
    }

    /// The piece has been sent; returns whether there is another one.
    pub(crate) fn sent(&mut self) -> bool {
        self.ended = self.from >= self.bytes.len();
        self.from += PIECE;
        if self.ended {
            self.bytes = Vec::new();
        }
        !self.ended
    }
}

/// A state that is being received.
#[derive(Debug, Default)]
pub(crate) struct Incoming {
    bytes: Vec<u8>,
}

impl Incoming {
    /// Takes a piece; returns the whole state if it was the last one.
    ///
    /// # Errors
    /// What is wrong with the piece.
    pub(crate) fn take(
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

/// The machine's own part of a saved state: the position at which the run continues.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Mark {
    pub step: u64,
    pub set: u64,
    pub imps: u64,
    pub items: u64,
    pub carried: [f64; 2],
}

impl Mark {
    pub const BYTES: usize = 48;

    pub fn bytes(self) -> Vec<u8> {
        let [a, b] = self.carried.map(f64::to_bits);
        let numbers = [self.step, self.set, self.imps, self.items, a, b];
        numbers.iter().flat_map(|n| n.to_le_bytes()).collect()
    }

    pub fn read(bytes: &[u8]) -> Option<Self> {
        let number = |k: usize| {
            let bytes = bytes.get(8 * k..8 * k + 8)?;
            Some(u64::from_le_bytes(bytes.try_into().ok()?))
        };
        Some(Self {
            step: number(0)?,
            set: number(1)?,
            imps: number(2)?,
            items: number(3)?,
            carried: [f64::from_bits(number(4)?), f64::from_bits(number(5)?)],
        })
    }
}

/// The solver's own part of a saved state, which follows the machine's.
pub fn solver_part(saved: &[u8]) -> &[u8] {
    saved.get(Mark::BYTES..).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn carry(bytes: Vec<u8>, change: impl Fn(usize, &mut Vec<u8>)) -> Result<Vec<u8>, String> {
        let (mut out, mut into) = (Outgoing::new(bytes), Incoming::default());
        for k in 0.. {
            let (piece, flags) = out.piece();
            let mut piece = piece.to_vec();
            change(k, &mut piece);
            let header = StepHeader {
                count: piece.len() as u64,
                flags,
                ..StepHeader::default()
            };
            if let Some(whole) = into.take(&header, &piece)? {
                assert!(!out.sent(), "nothing follows the last piece");
                return Ok(whole);
            }
            assert!(out.sent());
        }
        unreachable!()
    }

    #[test]
    fn a_state_of_any_length_arrives_whole() {
        for length in [0, 1, PIECE - 1, PIECE, PIECE + 1, 2 * PIECE, 2 * PIECE + 7] {
            let bytes: Vec<u8> = (0..length).map(|i| (i % 251) as u8).collect();
            assert_eq!(carry(bytes.clone(), |_, _| {}).unwrap(), bytes, "{length}");
        }
    }

    #[test]
    fn a_damaged_state_is_refused() {
        let bytes = vec![7; PIECE + 5];
        for k in 0..3 {
            let damaged = carry(bytes.clone(), |n, piece| {
                if n == k {
                    piece[0] ^= 1;
                }
            });
            assert!(damaged.unwrap_err().contains("hash"), "piece {k}");
        }
    }
}
