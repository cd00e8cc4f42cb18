//! Which loops the threads share, and how lists are cut into chunks. Chunks depend only on lengths, and their results are
//! taken in their order, so any number of threads gives the same bits.

use std::ops::Range;
use std::sync::Mutex;

use mechanics::threads::Threads;

/// Elements of a chunk: its results stay in the first-level cache.
pub const CHUNK: usize = 256;

/// Length of the parts of a loop over `len` bodies: a few parts for each thread, so that a thread that starts late does less.
pub fn part(threads: &Threads, len: usize) -> usize {
    threads.part(len, 4, CHUNK)
}

/// Calls `act` for the parts of a search for the neighbours of `len` elements, with a place for the results of each.
pub fn search<S: Default + Send>(
    threads: &Threads,
    len: usize,
    places: &mut Vec<S>,
    act: impl Fn(Range<usize>, &mut S) + Sync,
) {
    // Many parts: those where bodies lie close take several times as long.
    let part = threads.part(len, 32, 16);
    places.resize_with(len.div_ceil(part), S::default);
    threads.each(places.iter_mut().enumerate(), |(i, place)| {
        act(i * part..len.min((i + 1) * part), place);
    });
}

/// Calls `act` for every chunk, with its number and a place for its results, and then `take` for the places, in order. Nobody
/// needs the results later: alone, the calling thread has one place for all chunks, which stays in its cache.
#[inline]
pub fn chunks<C: Send, S: Send + Sync + Default>(
    threads: &Threads,
    chunks: impl ExactSizeIterator<Item = C> + Send,
    places: &mut Vec<S>,
    act: impl Fn(usize, C, &mut S) + Sync,
    mut take: impl FnMut(&S) + Send,
) {
    let wanted = if threads.count() > 1 { chunks.len() } else { 1 };
    places.resize_with(places.len().max(wanted), S::default);
    let chunks = chunks.enumerate();
    if threads.count() > 1 {
        let chunks = chunks.zip(places);
        threads.in_order(chunks, |(i, chunk), place| act(i, chunk, place), take);
    } else {
        for (i, chunk) in chunks {
            act(i, chunk, &mut places[0]);
            take(&places[0]);
        }
    }
}

/// Working memory that outlives a loop: a thread takes one for a task and gives it back, so that there are no more of
/// them than threads, and none is made anew in a step.
#[derive(Debug, Default)]
pub struct Spare<T>(Mutex<Vec<T>>);

impl<T: Default> Spare<T> {
    /// Working memory with what is left from another task.
    pub fn take(&self) -> T {
        self.lock().pop().unwrap_or_default()
    }

    /// Keeps it for another task.
    pub fn give_back(&self, memory: T) {
        self.lock().push(memory);
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Vec<T>> {
        self.0.lock().expect("nobody panics while he holds it")
    }
}
