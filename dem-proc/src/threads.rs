//! Threads inside the solver. An array is divided into parts; one thread processes each part and writes to its own
//! place. Sums over parts are taken in the order of the parts, which depend only on lengths. So any number of threads
//! gives the same bits.

use std::hint::spin_loop;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::{ThreadPool, ThreadPoolBuilder};

/// Elements of a chunk: its results stay in the first-level cache.
pub const CHUNK: usize = 256;

/// With fewer chunks than this, a loop ends before other threads have woken up: a wake-up takes 5 to 20 us, a chunk
/// about 4 us.
const WORTH_SHARING: usize = 8;

/// Number of turns (some 50 us in all) in which a thread waits for the others before it sleeps.
const SPINS: usize = 2000;

/// How loops are run: by the calling thread alone, or together with a thread pool of this solver.
#[derive(Debug, Default)]
pub struct Threads(Option<ThreadPool>);

impl Threads {
    /// `count` threads, including the caller's; 1 is a plain loop.
    ///
    /// # Errors
    /// The error message of the operating system.
    pub fn new(count: usize) -> Result<Self, String> {
        if count == 1 {
            return Ok(Self(None));
        }
        let pool = ThreadPoolBuilder::new()
            .num_threads(count - 1)
            .thread_name(|i| format!("dem-{}", i + 1))
            .build()
            .map_err(|e| e.to_string())?;
        Ok(Self(Some(pool)))
    }

    /// Whether a loop over `len` elements is worth sharing.
    pub fn shares(&self, len: usize) -> bool {
        self.0.is_some() && len.div_ceil(CHUNK) >= WORTH_SHARING
    }

    /// Length of the parts of a shared loop over `len` elements without a sum: a few parts for each thread, so that a
    /// thread that starts late does less.
    pub fn part(&self, len: usize) -> usize {
        match &self.0 {
            Some(pool) if self.shares(len) => len.div_ceil(4 * (pool.current_num_threads() + 1)),
            _ => len.max(1),
        }
    }

    /// Calls `f` for every task. Each thread takes the next task when it is free.
    #[inline]
    pub fn each<T>(&self, tasks: impl ExactSizeIterator<Item = T> + Send, f: impl Fn(T) + Sync) {
        match &self.0 {
            Some(pool) if tasks.len() > 1 => share(pool, tasks, &f),
            _ => tasks.for_each(f),
        }
    }

    /// Calls `f` for every chunk of `kept`, with the index of its first element, the chunk, and a scratch buffer of its
    /// own. Then calls `take` for every scratch buffer, in order. The buffers are kept between calls, so that nothing
    /// is allocated once they have grown.
    #[inline]
    pub fn chunks<S: Send + Default, B: Send>(
        &self,
        kept: &mut [B],
        scratches: &mut Vec<S>,
        f: impl Fn(usize, &mut [B], &mut S) + Sync + Send,
        mut take: impl FnMut(&S),
    ) {
        let count = kept.len().div_ceil(CHUNK);
        if self.shares(kept.len()) {
            scratches.resize_with(scratches.len().max(count), S::default);
            let both = kept.chunks_mut(CHUNK).zip(&mut scratches[..count]);
            self.each(both.enumerate(), |(i, (kept, scratch))| {
                f(i * CHUNK, kept, scratch);
            });
            for scratch in &scratches[..count] {
                take(scratch);
            }
        } else {
            scratches.resize_with(scratches.len().max(1), S::default);
            for (i, kept) in kept.chunks_mut(CHUNK).enumerate() {
                f(i * CHUNK, kept, &mut scratches[0]);
                take(&scratches[0]);
            }
        }
    }
}

/// The calling thread works too. Otherwise it would sleep, and to wake it costs as much as a small loop.
fn share<T>(pool: &ThreadPool, tasks: impl Iterator<Item = T> + Send, f: &(impl Fn(T) + Sync)) {
    let tasks = Mutex::new(tasks);
    let work = || {
        loop {
            // The lock is released before the task is done.
            let task = tasks.lock().expect("no task is made in a panic").next();
            let Some(task) = task else { return };
            f(task);
        }
    };
    let others = pool.current_num_threads();
    let working = AtomicUsize::new(others);
    pool.in_place_scope(|scope| {
        for _ in 0..others {
            scope.spawn(|_| {
                work();
                working.fetch_sub(1, Ordering::Release);
            });
        }
        work();
        let mut turns = 0;
        while working.load(Ordering::Acquire) > 0 && turns < SPINS {
            spin_loop();
            turns += 1;
        }
    });
}
