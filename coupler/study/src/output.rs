//! Files that a study writes.

use std::path::Path;

use coupler::record::fail;
use interface::files;

use crate::StudyError;

/// Writes a file.
pub(crate) fn write(path: &Path, bytes: impl AsRef<[u8]>) -> Result<(), StudyError> {
    Ok(files::write_named(path, bytes).map_err(fail("write", path))?)
}

/// Writes rows of the same length as CSV.
pub(crate) fn write_table(path: &Path, rows: &[Vec<String>]) -> Result<(), StudyError> {
    let mut table = csv::Writer::from_writer(Vec::new());
    for row in rows {
        let written = table.write_record(row);
        written.expect("rows of one length into memory");
    }
    write(path, table.into_inner().expect("memory takes everything"))
}

/// A number in a table; nothing where there is none.
pub(crate) fn number(number: Option<f64>) -> String {
    number.map_or_else(String::new, |n| n.to_string())
}
