//! Rows of a tile's window, for four points at once.
//!
//! A vector field over the window is stored node by node, `x y x y ...`; a load of four numbers takes two nodes of one
//! point, and a transpose of four such loads gives the four points' numbers side by side. A row of three nodes is read
//! and written as one of four: what lies beyond is not used, or gets a zero added.
//!
//! A window stands in an array that is a little longer than it: any index of 7 bits ([`crate::kernel::lanes::indices`]) plus the
//! reach of a shape function stays inside, which the compiler can see, so that no access needs a check.

use core::ops::Range;

use wide::f64x2;

use super::point_tile::Tile;
use super::tiles::{MARGIN, NODES, Place, TILE, pitch, runs};
use crate::kernel::lanes::{INDEX_LIMIT, LANES, Lanes, ZERO, splat};

/// Nodes beyond its base node that a point may touch, counted along the rows of the window.
const REACH: usize = 3 * pitch(4) + 4;

/// Numbers aligned to cache lines, so that no node lies across two of them.
#[derive(Debug, Clone)]
#[repr(align(64))]
pub struct Aligned<const N: usize>(pub [f64; N]);

/// A vector field over the window of a tile, two numbers a node.
pub type VectorWindow = Aligned<{ 2 * (INDEX_LIMIT + REACH) }>;

/// Mass and momentum over the window of a tile, four numbers a node: `m, p_x, p_y` and nothing.
pub type NodalWindow = Aligned<{ 4 * (INDEX_LIMIT + REACH) }>;

/// Zero everywhere.
pub const NO_VECTORS: VectorWindow = Aligned([0.0; 2 * (INDEX_LIMIT + REACH)]);

/// Zero everywhere.
pub const NO_MOMENTUM: NodalWindow = Aligned([0.0; 4 * (INDEX_LIMIT + REACH)]);

// The last base node of a window, of the widest shape function.
const _: () = assert!((TILE + 2 * MARGIN - 1) * (pitch(4) + 1) < INDEX_LIMIT);

/// Sets the nodes of a tile's window that its points reach to zero, `N` numbers each. The others are never read.
#[inline(always)]
pub fn clear<const W: usize, const N: usize>(window: &mut [f64], tile: &Tile) {
    window[tile.reached::<W, N>()].fill(0.0);
}

#[inline(always)]
fn load(window: &VectorWindow, at: usize) -> Lanes {
    let four: [f64; LANES] = window.0[at..at + LANES].try_into().expect("four numbers");
    Lanes::new(four)
}

/// Adds four numbers to those from `at` on.
#[inline(always)]
pub fn add_numbers(window: &mut NodalWindow, at: usize, numbers: Lanes) {
    let to = &mut window.0[at..at + LANES];
    let old: [f64; LANES] = (&*to).try_into().expect("four numbers");
    to.copy_from_slice((Lanes::new(old) + numbers).as_array());
}

/// Adds `a b` to the four numbers from `at` on.
#[inline(always)]
pub fn add_product(window: &mut NodalWindow, at: usize, a: Lanes, b: Lanes) {
    let to = &mut window.0[at..at + LANES];
    let old: [f64; LANES] = (&*to).try_into().expect("four numbers");
    to.copy_from_slice(a.mul_add(b, Lanes::new(old)).as_array());
}

/// The vectors at the nodes of row `j` that each of four points touches.
#[inline(always)]
pub fn gather_row<const W: usize>(
    window: &VectorWindow,
    place: &Place,
    j: usize,
) -> [[Lanes; 2]; W] {
    let mut row = [[ZERO; 2]; W];
    if place.shared {
        let at = 2 * (place.base(0) + j * pitch(W));
        for i in 0..W {
            row[i] = [window.0[at + 2 * i], window.0[at + 2 * i + 1]].map(splat);
        }
        return row;
    }
    let mut i = 0;
    while i < W {
        let at = 2 * (j * pitch(W) + i);
        let [x, y, next_x, next_y] = Lanes::transpose([
            load(window, 2 * place.base(0) + at),
            load(window, 2 * place.base(1) + at),
            load(window, 2 * place.base(2) + at),
            load(window, 2 * place.base(3) + at),
        ]);
        row[i] = [x, y];
        if i + 1 < W {
            row[i + 1] = [next_x, next_y];
        }
        i += 2;
    }
    row
}

/// Adds vectors to the nodes of row `j` that each of four points touches, point by point.
///
/// One node at a time, although two would fit into a register: the sum of one point is what the next one adds to, and
/// the processor hands a stored value on to a load only if that load lies within a single store.
#[inline(always)]
pub fn scatter_row<const W: usize>(
    window: &mut VectorWindow,
    place: &Place,
    j: usize,
    row: &[[Lanes; 2]; W],
) {
    if place.shared {
        let at = 2 * (place.base(0) + j * pitch(W));
        let mut i = 0;
        while i < W {
            let next = if i + 1 < W { row[i + 1] } else { [ZERO; 2] };
            let [a, b, c, d] = Lanes::transpose([row[i][0], row[i][1], next[0], next[1]]);
            let [x, y, next_x, next_y] = ((a + b) + (c + d)).to_array();
            add_vector(window, at + 2 * i, [x, y]);
            if i + 1 < W {
                add_vector(window, at + 2 * i + 2, [next_x, next_y]);
            }
            i += 2;
        }
        return;
    }
    for (i, [x, y]) in row.iter().enumerate() {
        let (x, y) = (x.to_array(), y.to_array());
        for k in 0..LANES {
            let at = 2 * (place.base(k) + j * pitch(W) + i);
            add_vector(window, at, [x[k], y[k]]);
        }
    }
}

/// Adds a vector to the node whose numbers begin at `at`.
#[inline(always)]
fn add_vector(window: &mut VectorWindow, at: usize, vector: [f64; 2]) {
    let to = &mut window.0[at..at + 2];
    let old: [f64; 2] = (&*to).try_into().expect("two numbers");
    to.copy_from_slice((f64x2::new(old) + f64x2::new(vector)).as_array());
}

/// Adds the part of a window that lies in a node tile, its run number `run` along x and y ([`runs`]) and of that the rows
/// `rows`; `N` numbers of it belong to one node.
#[inline(always)]
pub fn add_window<const W: usize, const N: usize>(
    sum: &mut [[f64; N]; NODES],
    window: &[f64],
    (run, rows): ([u8; 2], [u8; 2]),
) {
    let y = runs(W)[usize::from(run[1])];
    for row in usize::from(rows[0])..usize::from(rows[1]) {
        let from = &window[N * (y.window + row) * pitch(W)..][..N * pitch(W)];
        let to = sum[(y.own + row) * TILE..][..TILE].as_flattened_mut();
        // Lengths known to the compiler: a few vector additions each, no loops.
        match run[0] {
            0 => add::<N>(&mut to[N * (TILE - MARGIN)..], &from[..N * MARGIN]),
            1 => add::<N>(to, &from[N * MARGIN..][..N * TILE]),
            _ => add::<N>(to, &from[N * (MARGIN + TILE)..]),
        }
    }
}

/// Adds the numbers of nodes, `N` each, to those of the first ones of `to`; one node at a time, as [`scatter_row`] does.
#[inline(always)]
fn add<const N: usize>(to: &mut [f64], from: &[f64]) {
    for (to, from) in to.chunks_exact_mut(N).zip(from.chunks_exact(N)) {
        if let (Ok(old), Ok(more)) = ((&*to).try_into(), from.try_into()) {
            to.copy_from_slice((Lanes::new(old) + Lanes::new(more)).as_array());
        } else {
            let [old, more] = [&*to, from].map(|two| f64x2::new([two[0], two[1]]));
            to.copy_from_slice((old + more).as_array());
        }
    }
}

/// Copies a vector `field` of the node tiles `nodes` into the rows of a point tile's window that its points reach.
#[inline(always)]
pub fn fill_window<'a, const W: usize, N>(
    window: &mut VectorWindow,
    nodes: &'a [N],
    tile: &Tile,
    field: impl Fn(&'a N) -> &'a [[f64; 2]; NODES],
) {
    let mut around = [&[[0.0; 2]; NODES]; 9];
    for (of, t) in around.iter_mut().zip(tile.around) {
        if let Some(node_tile) = nodes.get(t as usize) {
            *of = field(node_tile);
        }
    }
    copy_window::<W>(window, &around, &tile.span(W, 1));
}

/// Copies `rows` of a vector field of the nine node tiles around a point tile. Not inlined: the copies are many instructions, and every
/// loop over points has several windows.
#[inline(never)]
fn copy_window<const W: usize>(
    window: &mut VectorWindow,
    around: &[&[[f64; 2]; NODES]; 9],
    rows: &Range<usize>,
) {
    for run in 0..3 {
        let y = runs(W)[run];
        let [left, own, right] = [0, 1, 2].map(|x| around[3 * run + x].as_flattened());
        for row in y.part(rows) {
            let to = &mut window.0[2 * (y.window + row) * pitch(W)..][..2 * pitch(W)];
            let from = 2 * (y.own + row) * TILE;
            copy::<{ 2 * MARGIN }>(to, left, from + 2 * (TILE - MARGIN));
            copy::<{ 2 * TILE }>(&mut to[2 * MARGIN..], own, from);
            for i in 0..W {
                copy::<2>(&mut to[2 * (MARGIN + TILE + i)..], right, from + 2 * i);
            }
        }
    }
}

#[inline(always)]
fn copy<const N: usize>(to: &mut [f64], from: &[f64], at: usize) {
    to[..N].copy_from_slice(&from[at..at + N]);
}
