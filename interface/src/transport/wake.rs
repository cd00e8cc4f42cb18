//! Wake-ups between the parties of a run: one counter for each ordered pair of parties, in a file that all of them map.
//!
//! Whoever has sent a message adds one to its counter and, if the receiver is blocked, wakes it through the counter's
//! futex. Whoever blocks names the count at which it last looked for messages, and the system does not let it block if
//! the counter has moved since. So a wake-up cannot be lost: a message that was not there at the last look was sent
//! after it, and its count too (clause B-1). iceoryx2 0.10 has events for this, which can be lost even with one notifier
//! and one listener (docs/decisions/0006-waiting.md).

#![allow(
    clippy::disallowed_methods,
    reason = "the file of wake-ups in the private directory of a run"
)]

use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::ptr::NonNull;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;

use rustix::fs::OFlags;
use rustix::mm::{MapFlags, ProtFlags, mmap, munmap};
use rustix::thread::futex::{self, Flags};
use rustix::time::Timespec;

use crate::message::control::Party;
use crate::transport::names::WAKES;

/// Parties.
const PARTIES: usize = Party::ALL.len();
/// What a pair of parties has in the file: a line of the processor's cache of its own.
#[repr(C, align(64))]
struct Pair {
    /// How many messages were sent, modulo 2^32.
    count: AtomicU32,
    /// Whether the receiver is blocked, or about to.
    blocked: AtomicU32,
    reserved: [AtomicU32; 14],
}

/// All pairs of a run: those of messages from one party are next to one another.
type Pairs = [Pair; PARTIES * PARTIES];

/// Bytes of the file.
const SIZE: usize = size_of::<Pairs>();

const _: () = assert!(SIZE == 64 * 9);

/// The counters of a run, mapped by one of its parties.
pub struct Wakes {
    party: Party,
    pairs: NonNull<Pairs>,
    /// The counts of messages to this party at its last looks.
    seen: [u32; PARTIES],
}

impl Wakes {
    /// Makes the file in the directory of a run.
    ///
    /// # Errors
    /// The system's.
    pub fn create(directory: &Path) -> io::Result<()> {
        let mut options = OpenOptions::new();
        let options = options.create_new(true).write(true).mode(0o600);
        // Written and not only made longer: memory that is not there would end a process at its first access.
        let mut file = options.open(directory.join(WAKES))?;
        file.write_all(&[0; SIZE])
    }

    /// The counters of the run in this directory, for `party`.
    ///
    /// # Errors
    /// The system's, or that the file has another size.
    pub fn open(directory: &Path, party: Party) -> io::Result<Self> {
        let mut options = OpenOptions::new();
        let options = options.read(true).write(true);
        let options = options.custom_flags(OFlags::NOFOLLOW.bits().cast_signed());
        let file = options.open(directory.join(WAKES))?;
        let pairs = map(&file)?;
        Ok(Self {
            party,
            pairs,
            seen: [0; PARTIES],
        })
    }

    fn pair(&self, from: Party, to: Party) -> &Pair {
        // SAFETY: the memory stays mapped for as long as `self` lives, is aligned to pages, has the size of the array,
        // and any bits of it are valid atomic integers. Others change it by atomic operations only.
        #[expect(unsafe_code)]
        let pairs = unsafe { self.pairs.as_ref() };
        &pairs[PARTIES * from as usize + to as usize]
    }

    /// Wakes `to` after a message has been sent to it.
    pub fn wake(&self, to: Party) {
        let pair = self.pair(self.party, to);
        // In this order, and in one order for all parties: a receiver that blocks sets its flag, and the system reads the
        // count after that. So either the flag is seen here, or the new count there.
        pair.count.fetch_add(1, Ordering::SeqCst);
        if pair.blocked.load(Ordering::SeqCst) != 0
            && let Err(e) = futex::wake(&pair.count, Flags::empty(), 1)
        {
            tracing::trace!("the {to} cannot be woken: {e}");
        }
    }

    /// Blocks until `from` has sent something since the last call, for `at_most` at most. Returns how many messages it was.
    /// The caller has looked for messages since the last call.
    pub fn block(&mut self, from: Party, at_most: Duration) -> u64 {
        let seen = self.seen[from as usize];
        let pair = self.pair(from, self.party);
        let mut count = pair.count.load(Ordering::SeqCst);
        if count == seen && !at_most.is_zero() {
            pair.blocked.store(1, Ordering::SeqCst);
            let limit = Timespec {
                tv_sec: at_most.as_secs().cast_signed(),
                tv_nsec: at_most.subsec_nanos().into(),
            };
            // It ends with a wake-up, at the limit, at a signal, or at once if the count has moved: the caller looks then.
            let _ = futex::wait(&pair.count, Flags::empty(), seen, Some(&limit));
            pair.blocked.store(0, Ordering::SeqCst);
            count = pair.count.load(Ordering::SeqCst);
        }
        self.seen[from as usize] = count;
        count.wrapping_sub(seen).into()
    }
}

impl Drop for Wakes {
    fn drop(&mut self) {
        // SAFETY: this is the mapping that `map` made, and nobody has a reference into it any more.
        #[expect(unsafe_code)]
        let unmapped = unsafe { munmap(self.pairs.as_ptr().cast(), SIZE) };
        if let Err(e) = unmapped {
            tracing::debug!("the file of wake-ups stays mapped: {e}");
        }
    }
}

fn map(file: &File) -> io::Result<NonNull<Pairs>> {
    // A page beyond the end of the file would end this process at the first access.
    let there = file.metadata()?;
    if !there.is_file() || there.len() != SIZE as u64 {
        let why = format!("the run's file `{WAKES}` does not have {SIZE} bytes");
        return Err(io::Error::new(io::ErrorKind::InvalidData, why));
    }
    // SAFETY: a new mapping at an address that the system chooses, of a file that has these bytes.
    #[expect(unsafe_code)]
    let mapped = unsafe {
        mmap(
            std::ptr::null_mut(),
            SIZE,
            ProtFlags::READ | ProtFlags::WRITE,
            MapFlags::SHARED,
            file,
            0,
        )?
    };
    NonNull::new(mapped.cast()).ok_or_else(|| io::Error::other("mapped at zero"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Instant;

    const LONG: Duration = Duration::from_mins(1);

    fn ends() -> (tempfile::TempDir, Wakes, Wakes) {
        let directory = tempfile::tempdir().unwrap();
        Wakes::create(directory.path()).unwrap();
        let [mpm, dem] =
            [Party::Mpm, Party::Dem].map(|party| Wakes::open(directory.path(), party).unwrap());
        (directory, mpm, dem)
    }

    #[test]
    fn a_wake_up_before_the_block_ends_it_at_once() {
        let (_directory, mpm, mut dem) = ends();
        mpm.wake(Party::Dem);
        mpm.wake(Party::Dem);
        assert_eq!(dem.block(Party::Mpm, LONG), 2);
        assert_eq!(dem.block(Party::Mpm, Duration::ZERO), 0);
    }

    #[test]
    fn nobody_else_is_woken() {
        let (_directory, mut mpm, dem) = ends();
        mpm.wake(Party::Coupler);
        dem.wake(Party::Coupler);
        let short = Duration::from_millis(5);
        let start = Instant::now();
        assert_eq!(mpm.block(Party::Dem, short), 0);
        assert!(start.elapsed() >= short);
    }

    /// Two parties answer one another 20,000 times and block each time, on a processor of their own or on one: a single
    /// wake-up that is lost costs a minute.
    #[test]
    fn no_wake_up_is_lost() {
        let (directory, mut mpm, _) = ends();
        let rounds = 20_000;
        let start = Instant::now();
        std::thread::scope(|scope| {
            scope.spawn(|| {
                let mut dem = Wakes::open(directory.path(), Party::Dem).unwrap();
                let mut heard = 0;
                while heard < rounds {
                    let times = dem.block(Party::Mpm, LONG);
                    (0..times).for_each(|_| dem.wake(Party::Mpm));
                    heard += times;
                }
            });
            for _ in 0..rounds {
                mpm.wake(Party::Dem);
                while mpm.block(Party::Dem, LONG) == 0 {}
            }
        });
        assert!(start.elapsed() < LONG);
    }

    #[test]
    fn a_file_of_another_size_is_refused() {
        let directory = tempfile::tempdir().unwrap();
        std::fs::write(directory.path().join(WAKES), "short").unwrap();
        let refused = Wakes::open(directory.path(), Party::Dem).err().unwrap();
        assert!(refused.to_string().contains("does not have 576 bytes"));
    }
}
