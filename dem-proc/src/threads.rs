//! Threads inside the solver. An array is cut into chunks that depend on nothing but its length; each chunk is done by
//! one thread into a buffer of its own; the buffers are then read in the order of the chunks. So any number of threads
//! gives the same bits.

use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

/// Elements of a chunk: what is found in one stays in the first-level cache.
pub const CHUNK: usize = 256;

/// Below this many chunks a loop is done before other threads have woken up (a wake-up takes 5 to 20 us, a chunk
/// about 4 us).
const WORTH_SHARING: usize = 8;

/// How loops are run: plainly, or by a pool of this solver's own.
#[derive(Debug, Default)]
pub struct Threads(Option<ThreadPool>);

impl Threads {
    /// `count` threads; 1 is a plain loop.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn new(count: usize) -> Result<Self, String> {
        if count == 1 {
            return Ok(Self(None));
        }
        let pool = ThreadPoolBuilder::new()
            .num_threads(count)
            .thread_name(|i| format!("dem-{i}"))
            .build()
            .map_err(|e| e.to_string())?;
        Ok(Self(Some(pool)))
    }

    /// Calls `f` for every chunk of `kept`, with the index of its first element, the chunk, and a scratch of its own;
    /// then `take` for every scratch, in order. Scratches are kept between calls, so that nothing is allocated once
    /// they have grown.
    #[inline]
    pub fn chunks<S: Send + Default, B: Send>(
        &self,
        kept: &mut [B],
        scratches: &mut Vec<S>,
        f: impl Fn(usize, &mut [B], &mut S) + Sync + Send,
        mut take: impl FnMut(&S),
    ) {
        let count = kept.len().div_ceil(CHUNK);
        match &self.0 {
            Some(pool) if count >= WORTH_SHARING => {
                scratches.resize_with(scratches.len().max(count), S::default);
                let both = kept.par_chunks_mut(CHUNK).zip(&mut scratches[..count]);
                pool.install(|| {
                    both.enumerate()
                        .for_each(|(i, (kept, scratch))| f(i * CHUNK, kept, scratch));
                });
                for scratch in &scratches[..count] {
                    take(scratch);
                }
            }
            _ => {
                scratches.resize_with(scratches.len().max(1), S::default);
                for (i, kept) in kept.chunks_mut(CHUNK).enumerate() {
                    f(i * CHUNK, kept, &mut scratches[0]);
                    take(&scratches[0]);
                }
            }
        }
    }
}
