//! Threads inside the solver. Work is split over the elements of an array that each thread fills alone; sums over
//! that array are made afterwards in the order of the data. So any number of threads gives the same bits.

use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

/// Below this many elements a loop is done before other threads have woken up (a wake-up takes 5 to 20 us, an element
/// about 20 ns).
const WORTH_SHARING: usize = 2048;

/// Elements that a thread takes at a time.
const SHARE: usize = 512;

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

    /// Computes `f(k)` for every element of `kept`, keeps its second part there, and hands the first to `take` in the
    /// order of `k`: at once in a plain loop, by way of `buffer` when other threads help.
    pub fn each<A: Send + Default, B: Send>(
        &self,
        kept: &mut [B],
        buffer: &mut Vec<A>,
        f: impl Fn(usize) -> (A, B) + Sync + Send,
        mut take: impl FnMut(usize, A),
    ) {
        match &self.0 {
            Some(pool) if kept.len() >= WORTH_SHARING => {
                buffer.resize_with(kept.len(), A::default);
                pool.install(|| {
                    let both = buffer.par_iter_mut().zip(kept.par_iter_mut()).enumerate();
                    both.with_min_len(SHARE)
                        .for_each(|(k, (a, b))| (*a, *b) = f(k));
                });
                for (k, a) in buffer.iter_mut().enumerate() {
                    take(k, std::mem::take(a));
                }
            }
            _ => {
                for (k, kept) in kept.iter_mut().enumerate() {
                    let (a, b) = f(k);
                    *kept = b;
                    take(k, a);
                }
            }
        }
    }
}
