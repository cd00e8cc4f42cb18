//! Loops over tiles that threads share: each tile has its own data, so that no two threads ever hold the same, and no sum
//! depends on the order of threads.

use std::slice::Chunks;

use mechanics::threads::Threads;

use crate::kernel::point_tile::Tile;

/// Into how many parts for each thread a list is divided.
pub const PARTS: usize = 8;

/// Data that a list of tiles can be divided with: each part of the list takes its own.
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

/// `count` items for each block of four points.
pub struct RowsPerBlock<'a, T> {
    /// The items.
    pub items: &'a mut [T],
    /// How many belong to one block.
    pub count: usize,
}

impl<T: Send> Share for RowsPerBlock<'_, T> {
    fn divide(self, _tiles: usize, blocks: usize) -> (Self, Self) {
        let (a, b) = self.items.split_at_mut(blocks * self.count);
        let part = |items| Self {
            items,
            count: self.count,
        };
        (part(a), part(b))
    }
}

/// One item for each tile.
pub struct PerTile<'a, T>(pub &'a mut [T]);

impl<T: Send> Share for PerTile<'_, T> {
    fn divide(self, tiles: usize, _blocks: usize) -> (Self, Self) {
        let (a, b) = self.0.split_at_mut(tiles);
        (Self(a), Self(b))
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

/// Calls `work` with every tile, its part of `share`, and working memory that is made for each part of the list.
pub fn over_tiles<D: Share, M, F: Fn(&Tile, D, &mut M) + Sync>(
    threads: &Threads,
    tiles: &[Tile],
    share: D,
    memory: fn() -> M,
    work: &F,
) {
    let parts = Parts {
        tiles: tiles.chunks(threads.part(tiles.len(), PARTS, 1)),
        rest: Some(share),
    };
    threads.each(parts, |(tiles, share): (&[Tile], D)| {
        let mut memory = memory();
        let mut rest = share;
        for tile in tiles {
            let part;
            (part, rest) = rest.divide(1, tile.blocks);
            work(tile, part, &mut memory);
        }
    });
}

/// The parts of a list of tiles, each with what it shares.
struct Parts<'a, D> {
    tiles: Chunks<'a, Tile>,
    rest: Option<D>,
}

impl<'a, D: Share> Iterator for Parts<'a, D> {
    type Item = (&'a [Tile], D);

    fn next(&mut self) -> Option<Self::Item> {
        let tiles = self.tiles.next()?;
        let mut blocks = 0;
        for tile in tiles {
            blocks += tile.blocks;
        }
        let (own, rest) = self.rest.take()?.divide(tiles.len(), blocks);
        self.rest = Some(rest);
        Some((tiles, own))
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        self.tiles.size_hint()
    }
}

/// Calls `work` with every item, a group or layer of so many tiles, and with the threads that share its tiles: all of them, or
/// where no item has much of the tiles, one for each item.
pub fn over_groups<T: Send>(
    threads: &Threads,
    items: &mut [T],
    tiles: impl Fn(&T) -> usize,
    work: &(impl Fn(&Threads, &mut T) + Sync),
) {
    let (mut all, mut largest) = (0, 0);
    for item in &*items {
        all += tiles(item);
        largest = largest.max(tiles(item));
    }
    if threads.count() > 1 && 2 * threads.count() * largest <= all {
        over_items(threads, items, &|item| work(&Threads::alone(), item));
    } else {
        for item in items {
            work(threads, item);
        }
    }
}

/// Calls `work` with every item.
pub fn over_items<T: Send, F: Fn(&mut T) + Sync>(threads: &Threads, items: &mut [T], work: &F) {
    let part = threads.part(items.len(), PARTS, 1);
    threads.each(items.chunks_mut(part), |items| {
        for item in items {
            work(item);
        }
    });
}
