//! Rows of a tile's window, for four points at once.
//!
//! A vector field over the window is stored node by node, `x y x y ...`; a load of four numbers takes two nodes of one
//! point, and a transpose of four such loads gives the four points' numbers side by side. A row of three nodes is read
//! and written as one of four: what lies beyond gets a zero added, and the window is padded for the last row.

use crate::lanes::{LANES, Lanes, ZERO};
use crate::tiles::{Place, WINDOW_MAX, pitch};

/// Numbers that follow a window, so that its last row can be taken as if it had an even number of nodes.
const PADDING: usize = 4;

/// Numbers in the window of a vector field, with its padding.
pub const fn vector_stride(w: usize) -> usize {
    2 * pitch(w) * pitch(w) + PADDING
}

/// Numbers in the window of mass and momentum, four a node: `m, p_x, p_y` and nothing.
pub const fn nodal_stride(w: usize) -> usize {
    4 * pitch(w) * pitch(w)
}

/// A vector field over the window of a tile.
pub type VectorWindow = [f64; 2 * WINDOW_MAX + PADDING];

/// Zero everywhere.
pub const ZERO_WINDOW: VectorWindow = [0.0; 2 * WINDOW_MAX + PADDING];

#[inline(always)]
fn load(window: &[f64], at: usize) -> Lanes {
    let four: [f64; LANES] = window[at..at + LANES].try_into().expect("four numbers");
    Lanes::new(four)
}

/// Adds four numbers from `at` on.
#[inline(always)]
pub fn add(window: &mut [f64], at: usize, value: Lanes) {
    let sum = load(window, at) + value;
    window[at..at + LANES].copy_from_slice(sum.as_array());
}

/// The vectors at the nodes of row `j` that each of four points touches.
#[inline(always)]
pub fn gather_row<const W: usize>(window: &[f64], place: &Place, j: usize) -> [[Lanes; 2]; W] {
    let mut row = [[ZERO; 2]; W];
    let mut i = 0;
    while i < W {
        let at = 2 * (j * pitch(W) + i);
        let [x, y, next_x, next_y] = Lanes::transpose([
            load(window, 2 * place.base[0] + at),
            load(window, 2 * place.base[1] + at),
            load(window, 2 * place.base[2] + at),
            load(window, 2 * place.base[3] + at),
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
#[inline(always)]
pub fn scatter_row<const W: usize>(
    window: &mut [f64],
    place: &Place,
    j: usize,
    row: &[[Lanes; 2]; W],
) {
    let mut i = 0;
    while i < W {
        let at = 2 * (j * pitch(W) + i);
        let [x, y] = row[i];
        let [next_x, next_y] = if i + 1 < W { row[i + 1] } else { [ZERO; 2] };
        let by_point = Lanes::transpose([x, y, next_x, next_y]);
        for k in 0..LANES {
            add(window, 2 * place.base[k] + at, by_point[k]);
        }
        i += 2;
    }
}
