//! Tiles: squares of 8 x 8 nodes into which the grid is divided, so that only its occupied part is allocated.
//!
//! A point belongs to the tile of its base node ([`crate::kernel::shape`]). Its tile sees, besides its own 8 x 8 nodes, a
//! *window* of [`pitch`] x [`pitch`] nodes: one more on the low side and `W` more on the high side. That is where the
//! points of the tile reach, and still reach when each has moved by up to one cell since they were last sorted.

use core::ops::Range;

use crate::kernel::lanes::{INDEX_LIMIT, LANES, Lanes, ZERO, indices, splat};

/// Nodes along the side of a tile.
pub const TILE: usize = 8;

/// Nodes of a tile.
pub const NODES: usize = TILE * TILE;

/// Cells by which a point may be off its tile's own base nodes.
pub const MARGIN: usize = 1;

/// Nodes along the side of the window of a tile, for shape functions that touch `w` nodes along each axis.
pub const fn pitch(w: usize) -> usize {
    TILE + 2 * MARGIN + w - 1
}

/// A run of nodes along one axis: where it begins in the window, in the tile that owns it, and how long it is.
#[derive(Debug, Clone, Copy)]
pub struct Run {
    /// First index in the window.
    pub window: usize,
    /// First index in the tile that owns the nodes.
    pub own: usize,
    /// Nodes.
    pub length: usize,
}

impl Run {
    /// Which of its nodes lie in a `span` of the window: numbers in the run.
    pub fn part(&self, span: &Range<usize>) -> Range<usize> {
        let clip = |at: usize| at.clamp(self.window, self.window + self.length) - self.window;
        clip(span.start)..clip(span.end)
    }
}

/// The three runs of a window along one axis: in the tile before, in the tile itself, in the tile after.
pub const fn runs(w: usize) -> [Run; 3] {
    [
        Run {
            window: 0,
            own: TILE - MARGIN,
            length: MARGIN,
        },
        Run {
            window: MARGIN,
            own: 0,
            length: TILE,
        },
        Run {
            window: MARGIN + TILE,
            own: 0,
            length: MARGIN + w - 1,
        },
    ]
}

/// The first node of a tile.
pub fn first_node(at: [i32; 2]) -> [i64; 2] {
    at.map(|t| i64::from(t) * TILE as i64)
}

/// Node `i` of the tile that begins at `origin`.
#[inline]
pub fn node(origin: [i64; 2], i: usize) -> [i64; 2] {
    [origin[0] + (i % TILE) as i64, origin[1] + (i / TILE) as i64]
}

/// The regular grid that the tiles are cut from.
#[derive(Debug, Clone, Copy)]
pub struct Geometry {
    /// Lower left corner of the domain in m: node (0, 0).
    pub lower: [f64; 2],
    /// Upper right corner in m.
    pub upper: [f64; 2],
    /// Cells of the domain along x and y.
    pub cells: [i64; 2],
    /// Grid spacing `L` in m.
    pub cell: f64,
    /// Whether what leaves along x and y enters at the other end.
    pub periodic: [bool; 2],
}

impl Geometry {
    /// The position of a point at `x` (m), moved back into the domain if it has crossed periodic walls.
    pub fn entered(&self, x: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|a| {
            let (lower, upper) = (self.lower[a], self.upper[a]);
            if self.periodic[a] && !(lower..=upper).contains(&x[a]) {
                let size = upper - lower;
                x[a] - size * ((x[a] - lower) / size).floor()
            } else {
                x[a]
            }
        })
    }

    /// Position of a node in m.
    pub fn place(&self, node: [i64; 2]) -> [f64; 2] {
        [0, 1].map(|a| self.lower[a] + node[a] as f64 * self.cell)
    }

    /// The tile of the base node of a point at `x` (m), for a shape function with this offset, and the base node's
    /// number in the tile.
    pub fn tile_of(&self, x: [f64; 2], offset: [f64; 2]) -> ([i32; 2], usize) {
        let base = [0, 1].map(|a| ((x[a] - self.lower[a]) / self.cell - offset[a]).floor() as i64);
        let tile = base.map(|b| b.div_euclid(TILE as i64) as i32);
        let within = base.map(|b| b.rem_euclid(TILE as i64) as usize);
        (tile, within[1] * TILE + within[0])
    }

    /// How to find points in the window of tile `at`.
    pub fn frame(&self, at: [i32; 2], offset: [f64; 2]) -> Frame {
        let origin = [0, 1].map(|a| {
            let first = f64::from(at[a]) * TILE as f64 - MARGIN as f64;
            self.lower[a] / self.cell + first + offset[a]
        });
        Frame {
            per_cell: splat(1.0 / self.cell),
            origin: origin.map(splat),
            offset: offset.map(splat),
        }
    }
}

/// Position of the window of a tile.
#[derive(Debug, Clone, Copy)]
pub struct Frame {
    /// `1/L` in 1/m.
    per_cell: Lanes,
    /// First node of the window plus the shape's offset, in cells from the origin of coordinates.
    origin: [Lanes; 2],
    /// Offset of the shape function.
    offset: [Lanes; 2],
}

/// Four points in a window.
#[derive(Debug, Clone, Copy)]
pub struct Place {
    /// Number of the base node in the window, row by row ([`Self::base`]).
    base: [usize; LANES],
    /// Distance from the base node in cells.
    pub d: [Lanes; 2],
    /// Whether all four have the same base node, as is likely after sorting. Then their contributions to a node are
    /// summed first.
    pub shared: bool,
}

impl Place {
    /// At the first node.
    pub const NOWHERE: Self = Self {
        base: [0; LANES],
        d: [ZERO; 2],
        shared: true,
    };

    /// Number of the base node of point `k` in the window. The mask changes nothing: it tells the compiler the range, which it
    /// does not know of a place that it has kept in memory.
    #[inline(always)]
    pub fn base(&self, k: usize) -> usize {
        self.base[k] & (INDEX_LIMIT - 1)
    }

    /// Column and row of the base node of point `k` in the window of shape functions that touch `w` nodes.
    pub fn column_row(&self, k: usize, w: usize) -> [usize; 2] {
        [self.base(k) % pitch(w), self.base(k) / pitch(w)]
    }
}

impl Frame {
    /// Finds four points in the window whose rows have `pitch` nodes.
    ///
    /// Points are sorted before they can leave the window, so the clamp never acts; it makes the index safe.
    #[inline(always)]
    pub fn locate(&self, x: &[Lanes; 2], pitch: usize) -> Place {
        let last = splat((TILE + 2 * MARGIN - 1) as f64);
        let along = |axis: usize| {
            let s = x[axis].mul_sub(self.per_cell, self.origin[axis]);
            let base = s.floor().fast_max(splat(0.0)).fast_min(last);
            (base, s - base + self.offset[axis])
        };
        let ((base_x, dx), (base_y, dy)) = (along(0), along(1));
        let base = indices(base_y.mul_add(splat(pitch as f64), base_x));
        Place {
            base,
            d: [dx, dy],
            shared: (base[0] ^ base[1]) | (base[0] ^ base[2]) | (base[0] ^ base[3]) == 0,
        }
    }
}
