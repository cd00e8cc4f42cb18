//! The seal of what a table has at a checkpoint, by which a change before it is found when the run goes on.

use std::io::{self, ErrorKind, Read as _};
use std::path::Path;

use interface::files::{self, How};
use serde::{Deserialize, Serialize};

/// The content of a table, as it was written.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Sealed {
    /// Its length in bytes.
    pub bytes: u64,
    /// BLAKE3 of these, in hexadecimal digits.
    hash: String,
}

/// Seals a table while it is written.
#[derive(Debug, Default)]
pub struct Seal {
    bytes: u64,
    hasher: blake3::Hasher,
}

impl Seal {
    /// Takes what is added to the table.
    pub fn take(&mut self, added: &[u8]) {
        self.hasher.update(added);
        self.bytes += added.len() as u64;
    }

    /// What was taken so far.
    pub fn sealed(&self) -> Sealed {
        Sealed {
            bytes: self.bytes,
            hash: self.hasher.finalize().to_string(),
        }
    }
}

impl Sealed {
    /// Compares the beginning of the table `name` of a run directory with what was written; returns its seal.
    ///
    /// # Errors
    /// It cannot be read, is shorter, or differs.
    pub fn compare(&self, dir: &Path, name: &str) -> io::Result<Seal> {
        let mut file = files::open(dir, name, How::Read)?.take(self.bytes);
        let (mut seal, mut piece) = (Seal::default(), vec![0; 64 << 10]);
        loop {
            match file.read(&mut piece)? {
                0 => break,
                read => seal.take(&piece[..read]),
            }
        }
        let (found, bytes) = (seal.bytes, self.bytes);
        let what = if found < bytes {
            format!("it has {found} bytes, and had {bytes} at the checkpoint")
        } else if bytes > 0 && seal.sealed() != *self {
            format!("its first {bytes} bytes, which it had at the checkpoint, were changed")
        } else {
            return Ok(seal);
        };
        Err(io::Error::new(ErrorKind::InvalidData, what))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn a_changed_byte_before_the_checkpoint_is_found_and_none_behind_it() {
        let dir = tempfile::tempdir().unwrap();
        let table: Vec<u8> = (0..200_017).map(|k| (k % 251) as u8).collect();
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
        for at in [0, 1000, table.len() - 1] {
            let mut changed = longer.clone();
            changed[at] ^= 1;
            let message = compare(&changed).unwrap_err();
            assert!(message.contains("were changed"), "{at}: {message}");
        }
        let message = compare(&table[..table.len() - 1]).unwrap_err();
        assert!(message.contains("bytes, and had"), "{message}");
        let none = Sealed::default();
        assert!(none.compare(dir.path(), "t").is_ok());
    }
}
