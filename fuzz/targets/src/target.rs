//! What a target is.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

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

impl Target {
    /// Runs it, and gives the bytes of memory that it took at a time where they are more than it may take.
    ///
    /// # Panics
    ///
    /// As it does.
    pub fn too_much(&self, input: &[u8]) -> Option<u64> {
        let mut came = Ok(());
        // Caught within, since the counter does not unwind.
        let taken = allocation_counter::measure(|| {
            came = catch_unwind(AssertUnwindSafe(|| (self.run)(input)));
        });
        if let Err(panic) = came {
            resume_unwind(panic);
        }
        let allowed = self.base + self.per_byte * input.len() as u64;
        (taken.bytes_max > allowed).then_some(taken.bytes_max)
    }
}
