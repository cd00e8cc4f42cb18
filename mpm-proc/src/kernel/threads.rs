//! Threads: tiles are distributed by halving the list, so that no two threads ever hold the same data, and no sum
//! depends on the order of threads.

use std::sync::Arc;

use crate::kernel::point_tile::Tile;

/// The threads of a solver; one thread means plain loops in the caller's own.
#[derive(Debug, Clone, Default)]
pub struct Threads {
    pool: Option<Arc<rayon::ThreadPool>>,
}

impl Threads {
    /// `count` threads.
    ///
    /// # Errors
    /// The message of the operating system if it has no threads to give.
    pub fn new(count: usize) -> Result<Self, String> {
        if count <= 1 {
            return Ok(Self::default());
        }
        rayon::ThreadPoolBuilder::new()
            .num_threads(count)
            .thread_name(|i| format!("mpm-{i}"))
            .build()
            .map(|pool| Self {
                pool: Some(Arc::new(pool)),
            })
            .map_err(|e| e.to_string())
    }

    /// Does `work` within the pool.
    pub fn run<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        match &self.pool {
            None => work(),
            Some(pool) => pool.install(work),
        }
    }

    /// Longest list of tiles, out of `count`, that one thread keeps to itself.
    pub fn grain(&self, count: usize) -> usize {
        match &self.pool {
            None => usize::MAX,
            // A few pieces for each thread, so that others can take work from a slow thread.
            Some(pool) => (count / (8 * pool.current_num_threads())).max(1),
        }
    }
}

/// Data that a list of tiles can be divided with: each half of the list takes its own part.
pub trait Share: Send + Sized {
    /// The parts of the first `tiles` tiles, which hold the first `blocks` blocks, and of the others.
    fn divide(self, tiles: usize, blocks: usize) -> (Self, Self);
}

/// One item for each block of four points.
pub struct PerBlock<'a, T>(pub &'a mut [T]);

impl<T: Send> Share for PerBlock<'_, T> {
    fn divide(self, _tiles: usize, blocks: usize) -> (Self, Self) {
        let (a, b) = self.0.split_at_mut(blocks);
        (Self(a), Self(b))
    }
}

/// `stride` items for each tile.
pub struct PerTile<'a, T> {
    /// The items.
    pub items: &'a mut [T],
    /// How many belong to one tile.
    pub stride: usize,
}

impl<'a, T> PerTile<'a, T> {
    /// One item for each tile.
    pub fn one(items: &'a mut [T]) -> Self {
        Self { items, stride: 1 }
    }
}

impl<T: Send> Share for PerTile<'_, T> {
    fn divide(self, tiles: usize, _blocks: usize) -> (Self, Self) {
        let (a, b) = self.items.split_at_mut(tiles * self.stride);
        let part = |items| Self {
            items,
            stride: self.stride,
        };
        (part(a), part(b))
    }
}

impl<A: Share, B: Share> Share for (A, B) {
    fn divide(self, tiles: usize, blocks: usize) -> (Self, Self) {
        let (a, c) = self.0.divide(tiles, blocks);
        let (b, d) = self.1.divide(tiles, blocks);
        ((a, b), (c, d))
    }
}

impl<A: Share, B: Share, C: Share> Share for (A, B, C) {
    fn divide(self, tiles: usize, blocks: usize) -> (Self, Self) {
        let (a, d) = self.0.divide(tiles, blocks);
        let (b, e) = self.1.divide(tiles, blocks);
        let (c, f) = self.2.divide(tiles, blocks);
        ((a, b, c), (d, e, f))
    }
}

/// Calls `work` with every tile, its part of `share`, and working memory that each thread makes for itself; lists longer
/// than `grain` are halved between threads.
pub fn over_tiles<D: Share, M, F: Fn(&Tile, D, &mut M) + Sync>(
    grain: usize,
    tiles: &[Tile],
    share: D,
    memory: fn() -> M,
    work: &F,
) {
    if tiles.len() > grain {
        let middle = tiles.len() / 2;
        let (left, right) = tiles.split_at(middle);
        let (a, b) = share.divide(middle, right[0].first - left[0].first);
        rayon::join(
            || over_tiles(grain, left, a, memory, work),
            || over_tiles(grain, right, b, memory, work),
        );
    } else {
        let mut memory = memory();
        let mut rest = share;
        for tile in tiles {
            let part;
            (part, rest) = rest.divide(1, tile.blocks);
            work(tile, part, &mut memory);
        }
    }
}

/// Calls `work` with every item; lists longer than `grain` are halved between threads.
pub fn over_items<T: Send, F: Fn(&mut T) + Sync>(grain: usize, items: &mut [T], work: &F) {
    if items.len() > grain {
        let (a, b) = items.split_at_mut(items.len() / 2);
        rayon::join(|| over_items(grain, a, work), || over_items(grain, b, work));
    } else {
        items.iter_mut().for_each(work);
    }
}
