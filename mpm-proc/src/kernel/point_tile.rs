//! The tile of a cloud: where its blocks of points lie in the cloud, and where its window lies on the grid.

use super::lanes::{LANES, Lanes, first, splat};
use super::tiles::{Frame, TILE, pitch, runs};

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
    /// The node tiles that own the window: the 3 x 3 around it, row by row from below.
    pub around: [u32; 9],
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
    /// Tile `at` of the grid with `points` points from block `first` on, number `index` of its cloud. The caller fills in
    /// [`Self::around`].
    pub fn new(at: [i32; 2], index: usize, first: usize, points: usize, frame: Frame) -> Self {
        Self {
            at,
            index,
            first,
            blocks: points.div_ceil(LANES),
            points,
            frame,
            around: [0; 9],
            near_load: false,
        }
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

/// The node tile, and the node in it, of node `index` of a point tile's window.
pub fn owner<const W: usize>(tile: &Tile, index: usize) -> (usize, usize) {
    let along = |i: usize| {
        let run = if i < runs(W)[1].window {
            0
        } else {
            1 + usize::from(i >= runs(W)[2].window)
        };
        (run, runs(W)[run].own + i - runs(W)[run].window)
    };
    let ((run_x, x), (run_y, y)) = (along(index % pitch(W)), along(index / pitch(W)));
    (tile.around[run_y * 3 + run_x] as usize, y * TILE + x)
}
