//! Which loops the threads share, and how lists are cut into chunks. Chunks depend only on lengths, and their results are
//! taken in their order, so any number of threads gives the same bits.

use std::ops::Range;
use std::sync::Mutex;

use mechanics::threads::Threads as Pool;

/// Elements of a chunk: its results stay in the first-level cache.
pub const CHUNK: usize = 256;

/// How loops are run.
#[derive(Debug, Clone, Default)]
pub struct Threads(Pool);

impl Threads {
    /// `count` threads, including the caller's.
    ///
    /// # Errors
    /// The error message of the operating system.
    pub fn new(count: usize) -> Result<Self, String> {
        Pool::new(count, "dem").map(Self)
    }

    /// Runs a part of a step, the `first` or a later one.
    pub fn in_step<R>(&self, first: bool, act: impl FnOnce() -> R) -> R {
        self.0.in_step(first, act)
    }

    /// Length of the parts of a loop over `len` elements: a few parts for each thread, so that a thread that starts late
    /// does less.
    pub fn part(&self, len: usize) -> usize {
        part_of(&self.0, len, (4, CHUNK))
    }

    /// Calls `act` for every task of a loop.
    #[inline]
    pub fn each<T: Send>(&self, tasks: impl Iterator<Item = T> + Send, act: impl Fn(T) + Sync) {
        self.0.each(tasks, act);
    }

    /// Calls `act` for the parts of a search for the neighbours of `len` elements, with a place for the results of each.
    pub fn search<S: Default + Send>(
        &self,
        len: usize,
        places: &mut Vec<S>,
        act: impl Fn(Range<usize>, &mut S) + Sync,
    ) {
        // Many parts: those where bodies lie close take several times as long.
        let part = part_of(&self.0, len, (32, 16));
        places.resize_with(len.div_ceil(part), S::default);
        self.0.each(places.iter_mut().enumerate(), |(i, place)| {
            act(i * part..len.min((i + 1) * part), place);
        });
    }

    /// Calls `act` for every chunk of `kept`, with its number and a place for its results, and then `take` for the
    /// places, in order.
    #[inline]
    pub fn chunks<B: Send, S: Send + Sync>(
        &self,
        kept: &mut [B],
        places: &mut [S],
        act: impl Fn(usize, &mut [B], &mut S) + Sync,
        take: impl FnMut(&S) + Send,
    ) {
        let chunks = kept.chunks_mut(CHUNK).enumerate().zip(places);
        self.0
            .in_order(chunks, |(i, kept), place| act(i, kept, place), take);
    }

    /// The same for results that nobody needs later: alone, the calling thread has one place for all chunks, which
    /// stays in its cache.
    #[inline]
    pub fn chunks_in_passing<B: Send, S: Send + Sync + Default>(
        &self,
        kept: &mut [B],
        places: &mut Vec<S>,
        act: impl Fn(usize, &mut [B], &mut S) + Sync,
        mut take: impl FnMut(&S) + Send,
    ) {
        if self.0.count() > 1 {
            let count = kept.len().div_ceil(CHUNK);
            places.resize_with(places.len().max(count), S::default);
            self.chunks(kept, &mut places[..count], act, take);
        } else {
            places.resize_with(places.len().max(1), S::default);
            for (i, kept) in kept.chunks_mut(CHUNK).enumerate() {
                act(i, kept, &mut places[0]);
                take(&places[0]);
            }
        }
    }
}

/// Length of the parts of a loop over `len` elements: so many parts for each thread, of a multiple of so many elements.
fn part_of(pool: &Pool, len: usize, (parts, multiple): (usize, usize)) -> usize {
    match pool.count() {
        1 => len.max(1),
        threads => (len.div_ceil(parts * threads).max(1)).next_multiple_of(multiple),
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
