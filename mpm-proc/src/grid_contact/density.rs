//! The gradient of a layer's density at the nodes, from which its outward normal follows (Bardenhagen 2000 eq. 24).
//!
//! The paper maps masses to cell centres by quadratic B-splines `b` and takes the gradient of the bilinear function
//! through them at the nodes. Both together are one sum over points: along its own axis the difference of the two
//! splines beside the node, along the other their mean,
//!
//! ```text
//! d rho / dx (x_I) = 1/L^3 sum_p m_p (b(xi - 1/2) - b(xi + 1/2)) (b(eta - 1/2) + b(eta + 1/2)) / 2
//! ```
//!
//! with `xi`, `eta` the vector from node to point in cells. It reaches two nodes to either side, for every shape
//! function. For the four nodes around a point that is `f` of a cell beyond the second of them, the splines between the nodes are
//! `(1 - f)^2/2`, `3/4 - (f - 1/2)^2` and `f^2/2` (Jiang 2020 A4, docs/physics.md section 1).
//!
//! A node beyond a periodic wall is an image ([`crate::state::images`]): its contributions go to its original, which
//! has the contacts.

use wide::f64x2;

use super::nodes::LayerNodes;
use crate::kernel::lanes::{LANES, Lanes, indices, splat};
use crate::kernel::point_tile::{NO_TILE, Tile};
use crate::kernel::shape::Shape;
use crate::kernel::tiles::{MARGIN, NODES, TILE};
use crate::kernel::transfer::AffineState;
use crate::state::continuum::Continuum;
use crate::state::grid::Grid;
use crate::state::nodes::{NodeAt, bits};

impl LayerNodes {
    /// Adds the gradients of the density of a layer at the nodes where others have mass too.
    pub fn add_density_gradients<const W: usize, S: Shape<W>, A: AffineState>(
        &mut self,
        layer: &Continuum<W, S, A>,
    ) {
        let (geometry, images) = (layer.grid.geometry, &layer.grid.images);
        let per_cell = splat(1.0 / geometry.cell);
        for cloud in &layer.clouds {
            for tile in &cloud.tiles {
                let around = around(&layer.grid, tile);
                if around.iter().all(|&around| self.counted(around) == 0) {
                    continue;
                }
                let mut sums = [[[0.0; 2]; WIDTH]; WIDTH];
                let origin = [0, 1].map(|a| {
                    let second = f64::from(tile.at[a]) * TILE as f64 + 1.0 - FIRST as f64;
                    splat(geometry.lower[a] / geometry.cell + second)
                });
                for block in 0..tile.blocks {
                    let x = cloud.state.x[tile.first + block];
                    let at = [0, 1].map(|a| x[a].mul_sub(per_cell, origin[a]));
                    add_points(&mut sums, at, tile.live(block));
                }
                for (k, around) in around.into_iter().enumerate() {
                    let first = [k % 3, k / 3].map(|run| run * TILE + FIRST);
                    for i in bits(self.counted(around) & WITHIN[k]) {
                        let node = NodeAt {
                            tile: around,
                            node: i as u32,
                        };
                        let at = images.at(node).map_or(node, |image| image.of);
                        let (of, n) = at.split();
                        let Some(gradients) = self.gradients(of) else {
                            continue;
                        };
                        let [x, y] = [first[0] + i % TILE - TILE, first[1] + i / TILE - TILE];
                        // Only the direction matters, and that all layers use the same unit: kg/m for each cell.
                        for (gradient, sum) in gradients[n].iter_mut().zip(sums[y][x]) {
                            *gradient += cloud.mass * sum;
                        }
                    }
                }
            }
        }
    }
}

/// The numbers of the 3 x 3 node tiles around a tile. It does not know those that only the density of its points reaches, beyond
/// their shape function.
fn around(grid: &Grid, tile: &Tile) -> [u32; 9] {
    let first = tile.at.map(|i| i64::from(i - 1) * TILE as i64);
    std::array::from_fn(|k| match tile.around[k] {
        NO_TILE => {
            let [x, y] = [k % 3, k / 3].map(|run| (run * TILE) as i64);
            let holder = grid.holder([first[0] + x, first[1] + y]);
            holder.map_or(NO_TILE, |(tile, _)| tile)
        }
        known => known,
    })
}

/// Nodes that a point reaches along an axis.
const REACH: usize = 4;

/// Nodes before those of a tile that its points reach.
const FIRST: usize = MARGIN + 1;

/// Nodes along an axis that the points of a tile reach.
const WIDTH: usize = FIRST + TILE + MARGIN + REACH - 1;

/// The nodes of the 3 x 3 tiles around a tile that its points reach, a bit for each.
const WITHIN: [u64; 9] = within();

const fn within() -> [u64; 9] {
    let mut within = [0; 9];
    let mut i = 0;
    while i < 9 * NODES {
        let (k, node) = (i / NODES, i % NODES);
        let x = k % 3 * TILE + node % TILE + FIRST;
        let y = k / 3 * TILE + node / TILE + FIRST;
        if x >= TILE && x < TILE + WIDTH && y >= TILE && y < TILE + WIDTH {
            within[k] |= 1 << node;
        }
        i += 1;
    }
    within
}

/// Adds what four points add that are `at`, in cells from the second of these nodes, in the lanes that are `live`. One node at a
/// time ([`crate::kernel::window::scatter_row`]).
#[inline(always)]
fn add_points(sums: &mut [[[f64; 2]; WIDTH]; WIDTH], at: [Lanes; 2], live: Lanes) {
    let cell = at.map(Lanes::floor);
    let [x, y] = cell.map(indices);
    let ([dx, mx], [dy, my]) = (kernel(at[0] - cell[0]), kernel(at[1] - cell[1]));
    let [dx, mx] = [dx, mx].map(|of| of.map(|s| (s * live).to_array()));
    let [dy, my] = [dy, my].map(|of| of.map(Lanes::to_array));
    for k in 0..LANES {
        for (j, row) in sums[y[k]..][..REACH].iter_mut().enumerate() {
            let across = f64x2::new([my[j][k], dy[j][k]]);
            for (i, node) in row[x[k]..][..REACH].iter_mut().enumerate() {
                let along = f64x2::new([dx[i][k], mx[i][k]]);
                *node = along.mul_add(across, f64x2::new(*node)).to_array();
            }
        }
    }
}

/// For the four nodes around a point, which is `f` of a cell beyond the second: difference and mean of the splines beside each.
#[inline(always)]
fn kernel(f: Lanes) -> [[Lanes; REACH]; 2] {
    let [half, g] = [splat(0.5), splat(1.0) - f];
    let a = half * g * g;
    let b = splat(0.75) - (f - half) * (f - half);
    let c = half * f * f;
    [
        [a, b - a, c - b, -c],
        [half * a, half * (a + b), half * (b + c), half * c],
    ]
}
