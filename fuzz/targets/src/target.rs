//! What a target is.

use crate::change::Changer;

/// Something that reads bytes.
#[derive(Debug, Clone, Copy)]
pub struct Target {
    /// Its name.
    pub name: &'static str,
    /// Reads them. Whatever they are, it comes back.
    pub run: fn(&[u8]),
    /// Inputs that are right, or nearly so.
    pub seeds: fn() -> Vec<Vec<u8>>,
    /// Changes an input; the seeds are at hand.
    pub change: fn(&mut Changer, &mut Vec<u8>, &[Vec<u8>]),
    /// Bytes of memory that an input may take at a time, however short it is.
    pub base: u64,
    /// And for each of its bytes.
    pub per_byte: u64,
}
