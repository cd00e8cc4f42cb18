//! The tile of a cloud: where its blocks of points lie in the cloud, and where its window lies on the grid.

use core::ops::Range;

use serde::{Deserialize, Serialize};

use super::lanes::{LANES, Lanes, first, splat};
use super::tiles::{Frame, MARGIN, Run, TILE, pitch, runs};

/// No node tile.
pub const NO_TILE: u32 = u32::MAX;

/// The points of a tile when they were sorted.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct SortedTile {
    /// Column and row in the grid of tiles.
    pub at: [i32; 2],
    /// How many points.
    pub points: u32,
    /// The first and the last of the tile's own columns, and of its rows, with base nodes of them.
    pub bases: [[u8; 2]; 2],
}

/// A tile of a cloud: a run of blocks whose points lie in it.
#[derive(Debug, Clone)]
pub struct Tile {
    /// Column and row in the grid of tiles.
    pub at: [i32; 2],
    /// Number in the list of the cloud's tiles.
    pub index: usize,
    /// First block.
    pub first: usize,
    /// Blocks.
    pub blocks: usize,
    /// Points; the last block may have fewer than four.
    pub points: usize,
    /// Position of its window.
    pub frame: Frame,
    /// The node tiles that own the window: the 3 x 3 around it, row by row from below; [`NO_TILE`] where its points do not reach.
    pub around: [u32; 9],
    /// The first and the last of its columns, and of its rows, with base nodes of points when these were sorted.
    bases: [[u8; 2]; 2],
    /// Whether its points see nodes near those on which bodies press in this step ([`crate::pass::drift`]).
    pub near_load: bool,
}

/// The tiles on which a pass works.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Which {
    /// All.
    All,
    /// Those near a load, [`Tile::near_load`].
    NearLoad,
    /// The others.
    Elsewhere,
}

impl Which {
    /// Whether a tile is among them.
    pub fn has(self, tile: &Tile) -> bool {
        match self {
            Self::All => true,
            Self::NearLoad => tile.near_load,
            Self::Elsewhere => !tile.near_load,
        }
    }
}

impl Tile {
    /// A sorted tile with blocks from `first` on, number `index` of its cloud. The caller fills in [`Self::around`].
    pub fn new(sorted: &SortedTile, index: usize, first: usize, frame: Frame) -> Self {
        let points = sorted.points as usize;
        Self {
            at: sorted.at,
            index,
            first,
            blocks: points.div_ceil(LANES),
            points,
            frame,
            around: [NO_TILE; 9],
            bases: sorted.bases,
            near_load: false,
        }
    }

    /// The nodes of the window along an axis that its points reach until they are sorted again, with a shape function that
    /// touches `w` nodes.
    pub fn span(&self, w: usize, axis: usize) -> Range<usize> {
        let [first, last] = self.bases[axis].map(usize::from);
        first..last + 2 * MARGIN + w
    }

    /// The numbers in a window, `N` a node, of the rows of nodes that its points reach.
    #[inline(always)]
    pub fn reached<const W: usize, const N: usize>(&self) -> Range<usize> {
        let rows = self.span(W, 1);
        N * pitch(W) * rows.start..N * pitch(W) * rows.end
    }

    /// One in the lanes of block `block` of the tile that have a point, zero in the others.
    #[inline(always)]
    pub fn live(&self, block: usize) -> Lanes {
        if block + 1 < self.blocks {
            splat(1.0)
        } else {
            first(self.points - block * LANES)
        }
    }
}

/// For each node of a window along an axis, the run that it lies in, and its number in the tile that owns it.
const fn owners(w: usize) -> [[usize; 2]; pitch(4)] {
    let mut owners = [[0; 2]; pitch(4)];
    let mut run = 0;
    while run < 3 {
        let Run {
            window,
            own,
            length,
        } = runs(w)[run];
        let mut i = 0;
        while i < length {
            owners[window + i] = [run, own + i];
            i += 1;
        }
        run += 1;
    }
    owners
}

/// The node tile, and the node in it, of a node of a point tile's window.
#[inline(always)]
pub fn owner<const W: usize>(tile: &Tile, [i, j]: [usize; 2]) -> (u32, u32) {
    let owners = const { owners(W) };
    let ([run_x, x], [run_y, y]) = (owners[i], owners[j]);
    (tile.around[run_y * 3 + run_x], (y * TILE + x) as u32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::tiles::Geometry;

    /// Every base node and those on either side of it, where its point may be before the next sort, with all `w` nodes from there.
    #[test]
    fn a_window_has_the_nodes_that_points_may_reach() {
        let grid = Geometry {
            lower: [0.0; 2],
            upper: [64.0; 2],
            cells: [64; 2],
            cell: 1.0,
            periodic: [false; 2],
        };
        for (first, last, w) in (0..TILE).flat_map(|first| {
            let lasts = first..TILE;
            lasts.flat_map(move |last| (2..=4).map(move |w| (first, last, w)))
        }) {
            let sorted = SortedTile {
                at: [3, 3],
                points: 1,
                bases: [[0, 7], [first as u8, last as u8]],
            };
            let tile = Tile::new(&sorted, 0, 0, grid.frame(sorted.at, [0.5; 2]));
            let reached = |node: i64| (first as i64 - 1..=(last + w) as i64).contains(&node);
            let span = tile.span(w, 1);
            for (number, run) in runs(w).iter().enumerate() {
                for i in 0..run.length {
                    // Counted from the first node of the tile.
                    let node = (TILE * number + run.own + i) as i64 - TILE as i64;
                    let within = run.part(&span).contains(&i);
                    assert_eq!(within, reached(node), "{first} {last} {w}: {node}");
                }
            }
        }
    }
}
