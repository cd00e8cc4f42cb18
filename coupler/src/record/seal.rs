//! Marks of what a table has at a checkpoint, by which a change before it is found when the run goes on.

use std::io::{self, ErrorKind, Read as _};
use std::path::Path;

use interface::files::{self, How};
use serde::{Deserialize, Serialize};

/// Bytes of a piece, each of which has a mark.
const PIECE: usize = 64 << 10;

/// The content of a table, as it was written.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub(crate) struct Sealed {
    /// Its length in bytes.
    pub bytes: u64,
    /// First 8 bytes of the BLAKE3 hash of each piece, the last of which may be shorter.
    marks: Vec<[u8; 8]>,
}

/// Marks a table while it is written.
#[derive(Debug, Default)]
pub(crate) struct Seal {
    bytes: u64,
    whole: Vec<[u8; 8]>,
    /// The piece that is not whole yet.
    rest: blake3::Hasher,
}

fn mark(piece: &blake3::Hasher) -> [u8; 8] {
    let hash = piece.finalize();
    hash.as_bytes()[..8].try_into().expect("8 of 32 bytes")
}

impl Seal {
    /// Takes what is added to the table.
    pub fn take(&mut self, mut added: &[u8]) {
        while !added.is_empty() {
            let room = PIECE - (self.bytes % PIECE as u64) as usize;
            let (now, later) = added.split_at(room.min(added.len()));
            self.rest.update(now);
            self.bytes += now.len() as u64;
            if now.len() == room {
                self.whole.push(mark(&self.rest));
                self.rest.reset();
            }
            added = later;
        }
    }

    /// The marks of what was taken so far.
    pub fn sealed(&self) -> Sealed {
        let mut marks = self.whole.clone();
        if !self.bytes.is_multiple_of(PIECE as u64) {
            marks.push(mark(&self.rest));
        }
        Sealed {
            bytes: self.bytes,
            marks,
        }
    }
}

impl Sealed {
    /// Compares the beginning of the table `name` of a run directory with what was written; returns its seal.
    ///
    /// # Errors
    /// It cannot be read, is shorter, or differs; the message says where.
    pub fn compare(&self, dir: &Path, name: &str) -> io::Result<Seal> {
        let mut file = files::open(dir, name, How::Read)?.take(self.bytes);
        let (mut seal, mut piece) = (Seal::default(), Vec::with_capacity(PIECE));
        loop {
            piece.clear();
            if file.by_ref().take(PIECE as u64).read_to_end(&mut piece)? == 0 {
                break;
            }
            seal.take(&piece);
        }
        if seal.bytes < self.bytes {
            let what = format!(
                "it has {} bytes, and had {} at the checkpoint",
                seal.bytes, self.bytes
            );
            return Err(io::Error::new(ErrorKind::InvalidData, what));
        }
        let found = seal.sealed().marks;
        let pairs = found.iter().zip(&self.marks);
        match pairs
            .enumerate()
            .find(|(_, (found, written))| found != written)
        {
            None => Ok(seal),
            Some((piece, _)) => {
                let from = (piece * PIECE) as u64;
                let to = self.bytes.min(from + PIECE as u64);
                let what = format!("it was changed between byte {from} and byte {to}");
                Err(io::Error::new(ErrorKind::InvalidData, what))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn a_changed_byte_before_the_checkpoint_is_found_and_none_behind_it() {
        let dir = tempfile::tempdir().unwrap();
        let table: Vec<u8> = (0..3 * PIECE + 17).map(|k| (k % 251) as u8).collect();
        let mut seal = Seal::default();
        for part in table.chunks(1000) {
            seal.take(part);
        }
        let sealed = seal.sealed();
        let compare = |bytes: &[u8]| {
            fs::write(dir.path().join("t"), bytes).unwrap();
            let compared = sealed.compare(dir.path(), "t");
            compared
                .map(|seal| seal.sealed())
                .map_err(|e| e.to_string())
        };
        assert_eq!(compare(&table), Ok(sealed.clone()));
        let longer = [&table[..], b"rows of later"].concat();
        assert_eq!(compare(&longer), Ok(sealed.clone()));
        for at in [0, PIECE - 1, PIECE, 3 * PIECE, 3 * PIECE + 16] {
            let mut changed = longer.clone();
            changed[at] ^= 1;
            let from = at / PIECE * PIECE;
            let words = format!("it was changed between byte {from} and byte ");
            let told = compare(&changed).unwrap_err();
            assert!(told.starts_with(&words), "{at}: {told}");
        }
        let told = compare(&table[..table.len() - 1]).unwrap_err();
        assert!(told.contains("bytes, and had"), "{told}");
        let none = Seal::default().sealed();
        assert!(none.compare(dir.path(), "t").is_ok());
    }
}
