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
//! function.
//!
//! A node beyond a periodic wall is an image ([`crate::state::images`]): its contributions go to its original, which
//! has the contacts.

use super::nodes::SharedNodes;
use crate::kernel::lanes::LANES;
use crate::kernel::point_tile::Tile;
use crate::kernel::shape::Shape;
use crate::kernel::tiles::TILE;
use crate::kernel::transfer::AffineState;
use crate::state::continuum::Continuum;
use crate::state::grid::Grid;
use crate::state::images::Images;
use crate::state::nodes::{NodeAt, bits};

impl SharedNodes {
    /// Adds the gradients of layer `number` at the nodes where others have mass too.
    pub fn add_density_gradients<const W: usize, S: Shape<W>, A: AffineState>(
        &mut self,
        number: usize,
        continuum: &Continuum<W, S, A>,
    ) {
        let geometry = continuum.grid.geometry;
        self.count(number, &continuum.grid.images);
        for cloud in &continuum.clouds {
            // Only the direction matters, and that all layers use the same unit: kg/m for each cell.
            for tile in &cloud.tiles {
                let near = Near::new(self, tile, &continuum.grid);
                if near.is_empty() {
                    continue;
                }
                for point in 0..tile.points {
                    let lane = (tile.first + point / LANES) * LANES + point % LANES;
                    let x = cloud.position(lane);
                    let at = [0, 1].map(|a| (x[a] - geometry.lower[a]) / geometry.cell);
                    self.add_point(number, &near, at, cloud.mass);
                }
            }
        }
        self.keep_along_walls(number, &continuum.grid.walls);
    }

    /// Adds the gradient of one point at `at`, in cells from the domain's corner.
    fn add_point(&mut self, number: usize, near: &Near, at: [f64; 2], mass: f64) {
        let first = at.map(|x| x.floor() as i64 - 1);
        let met = near.met_from(first);
        if met == 0 {
            return;
        }
        let along = [0, 1].map(|a| kernel(at[a] - first[a] as f64));
        for k in bits(met) {
            let (i, j) = (k % 4, k / 4);
            let node = [first[0] + i as i64, first[1] + j as i64];
            let Some((holder, within)) = near.holder(node) else {
                continue;
            };
            let Some(shared) = self.shared(number, holder) else {
                continue;
            };
            let gradient = &mut shared.gradient[within];
            let [(dx, sx), (dy, sy)] = [along[0][i], along[1][j]];
            gradient[0] += mass * dx * sy;
            gradient[1] += mass * sx * dy;
        }
    }
}

/// The nodes around a tile of points.
struct Near<'a> {
    tile: &'a Tile,
    /// The first of the 3 x 3 node tiles' nodes.
    first: [i64; 2],
    /// The nodes that count, row by row: those where others have mass too, and their images.
    met: [u32; 3 * TILE],
    /// The layer's images, where some of the nodes are.
    images: Option<&'a Images>,
}

impl<'a> Near<'a> {
    fn new(shared: &SharedNodes, tile: &'a Tile, grid: &'a Grid) -> Self {
        let around = tile.around.iter();
        let mut around = around.filter_map(|&t| grid.tiles.get(t as usize));
        let imaged = around.any(|t| t.imaged);
        let mut met = [0; 3 * TILE];
        for (k, &around) in tile.around.iter().enumerate() {
            let of_tile = shared.counted(around);
            for row in 0..TILE {
                let of_row = (of_tile >> (row * TILE)) as u32 & 0xff;
                met[k / 3 * TILE + row] |= of_row << (k % 3 * TILE);
            }
        }
        Self {
            tile,
            first: tile.at.map(|t| (i64::from(t) - 1) * TILE as i64),
            met,
            images: imaged.then_some(&grid.images),
        }
    }

    fn is_empty(&self) -> bool {
        self.met == [0; 3 * TILE]
    }

    /// Which of the 4 x 4 nodes from `first` on count, row by row, a bit for each.
    fn met_from(&self, first: [i64; 2]) -> u64 {
        let [x, y] = [0, 1].map(|a| first[a] - self.first[a]);
        let mut met = 0;
        for j in 0..4 {
            let row = usize::try_from(y + j).ok();
            let of_row = row.and_then(|row| self.met.get(row)).copied();
            let of_row = u64::from(of_row.unwrap_or(0)) << 4; // nodes before the first tile count for nothing
            met |= (of_row >> (x + 4).clamp(0, 31) & 0xf) << (4 * j);
        }
        met
    }

    /// The node tile that holds a node, or the original of an image, and its number in the tile. `None` if the layer
    /// has no such tile and thus no mass at the node.
    fn holder(&self, node: [i64; 2]) -> Option<(u32, usize)> {
        let (around, within) = in_reach(self.tile, node)?;
        let at = NodeAt {
            tile: self.tile.around[around],
            node: within as u32,
        };
        let image = self.images.and_then(|images| images.at(at));
        let at = image.map_or(at, |image| image.of);
        Some((at.tile, at.node as usize))
    }
}

/// For the four nodes from a point's first on, `d` cells before it: difference and mean of the splines beside each.
fn kernel(d: f64) -> [(f64, f64); 4] {
    core::array::from_fn(|i| {
        let way = d - i as f64;
        let (after, before) = (spline(way - 0.5), spline(way + 0.5));
        (after - before, 0.5 * (after + before))
    })
}

/// The quadratic B-spline (Jiang 2020 A4, docs/physics.md section 1).
fn spline(d: f64) -> f64 {
    let d = d.abs();
    if d < 0.5 {
        0.75 - d * d
    } else if d < 1.5 {
        0.5 * (1.5 - d) * (1.5 - d)
    } else {
        0.0
    }
}

/// Which of the 3 x 3 node tiles around `tile` a node lies in, and its number there.
fn in_reach(tile: &Tile, node: [i64; 2]) -> Option<(usize, usize)> {
    let size = TILE as i64;
    let from = [0, 1].map(|a| node[a] - (i64::from(tile.at[a]) - 1) * size);
    if from.iter().any(|f| !(0..3 * size).contains(f)) {
        return None;
    }
    let [x, y] = from.map(|f| f as usize);
    Some((y / TILE * 3 + x / TILE, y % TILE * TILE + x % TILE))
}
