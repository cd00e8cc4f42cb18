//! The seal of what a table has at a checkpoint, by which a change before it is found when the run goes on.

use std::io::{self, ErrorKind, Read as _};
use std::path::Path;

use blake3::Hasher;
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

impl Sealed {
    /// Of a table whose bytes so far this has taken.
    pub(super) fn of(table: &Hasher) -> Self {
        Self {
            bytes: table.count(),
            hash: table.finalize().to_string(),
        }
    }

    /// Compares the beginning of the table `name` of a run directory with what was written; returns what has taken it.
    ///
    /// # Errors
    /// It cannot be read, is shorter, or differs.
    pub fn compare(&self, dir: &Path, name: &str) -> io::Result<Hasher> {
        let file = files::open(dir, name, How::Read)?.take(self.bytes);
        let mut table = Hasher::new();
        table.update_reader(file)?;
        let (found, bytes) = (table.count(), self.bytes);
        let what = if found < bytes {
            format!("it has {found} bytes, and had {bytes} at the checkpoint")
        } else if bytes > 0 && Self::of(&table) != *self {
            format!("its first {bytes} bytes, which it had at the checkpoint, were changed")
        } else {
            return Ok(table);
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
        let mut written = Hasher::new();
        for part in table.chunks(1000) {
            written.update(part);
        }
        let sealed = Sealed::of(&written);
        let compare = |bytes: &[u8]| {
            fs::write(dir.path().join("t"), bytes).unwrap();
            let compared = sealed.compare(dir.path(), "t");
            compared
                .map(|table| Sealed::of(&table))
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
