//! The list of the files that Tandem has written into a run directory. Its names are whole even if the process is
//! killed.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, Write};
use std::path::Path;

use interface::files::{self, How};

use crate::error::{RunDirError, fail};

/// The names of all files that Tandem has written, one a line.
pub(super) const WRITTEN: &str = ".tandem.files";

/// The list of files that were written.
#[derive(Debug)]
pub(super) struct Written {
    pub names: BTreeSet<String>,
    list: File,
    /// Length in bytes of the whole names in the list.
    bytes: u64,
}

impl Written {
    /// The list of the folder `place` of the directory, with the names that it has already. The file is replaced as a
    /// whole.
    pub fn open(dir: &Path, place: &Path, names: BTreeSet<String>) -> Result<Self, RunDirError> {
        let name = place.join(WRITTEN);
        let mut text = String::new();
        for name in &names {
            let _ = writeln!(text, "{name}");
        }
        let open = || {
            files::replace(dir, &name, text.as_bytes(), false)?;
            files::open(dir, &name, How::Append)
        };
        let list = open().map_err(fail("write", &dir.join(&name)))?;
        Ok(Self {
            names,
            list,
            bytes: text.len() as u64,
        })
    }

    /// Adds a name, before the file is written. A name that is written only in part, because the disk is full, is
    /// removed again.
    pub fn add(&mut self, name: &str) -> io::Result<()> {
        if self.names.contains(name) {
            return Ok(());
        }
        let line = format!("{name}\n");
        if let Err(error) = self.list.write_all(line.as_bytes()) {
            let _ = self.list.set_len(self.bytes);
            return Err(error);
        }
        self.bytes += line.len() as u64;
        self.names.insert(name.to_owned());
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn a_name_that_could_not_be_written_is_not_taken_for_written() {
        let dir = tempfile::tempdir().unwrap();
        let mut written =
            Written::open(dir.path(), Path::new(""), BTreeSet::from(["a".to_owned()])).unwrap();
        written.add("b").unwrap();
        let text = || fs::read_to_string(dir.path().join(WRITTEN)).unwrap();
        assert_eq!(text(), "a\nb\n");
        // A list that cannot be written.
        written.list = File::open(dir.path().join(WRITTEN)).unwrap();
        written.add("c").unwrap_err();
        assert!(!written.names.contains("c"));
        assert_eq!(text(), "a\nb\n");
        assert!(!dir.path().join(".tandem.files.part").exists());
    }
}
