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

use super::nodes::SharedNodes;
use crate::kernel::lanes::LANES;
use crate::kernel::shape::Shape;
use crate::kernel::tiles::TILE;
use crate::kernel::transfer::AffineState;
use crate::state::continuum::Continuum;
use crate::state::nodes::{NodeAt, bits};

impl SharedNodes {
    /// Adds the gradients of layer `number` at the nodes where others have mass too.
    pub fn add_density_gradients<const W: usize, S: Shape<W>, A: AffineState>(
        &mut self,
        number: usize,
        continuum: &Continuum<W, S, A>,
    ) {
        let (geometry, images) = (continuum.grid.geometry, &continuum.grid.images);
        self.count(number, images);
        for cloud in &continuum.clouds {
            for tile in &cloud.tiles {
                if tile.around.iter().all(|&around| self.counted(around) == 0) {
                    continue;
                }
                let first = tile.at.map(|t| (i64::from(t) - 1) * TILE as i64);
                let mut sums = [[[0.0; 2]; SIDE]; SIDE];
                for point in 0..tile.points {
                    let lane = (tile.first + point / LANES) * LANES + point % LANES;
                    let x = cloud.position(lane);
                    let at = [0, 1].map(|a| (x[a] - geometry.lower[a]) / geometry.cell);
                    add_point(&mut sums, first, at);
                }
                for (k, &around) in tile.around.iter().enumerate() {
                    for i in bits(self.counted(around)) {
                        let sum = sums[k / 3 * TILE + i / TILE][k % 3 * TILE + i % TILE];
                        let node = NodeAt {
                            tile: around,
                            node: i as u32,
                        };
                        let at = images.at(node).map_or(node, |image| image.of);
                        let (tile, node) = at.split();
                        let Some(shared) = self.shared(number, tile as u32) else {
                            continue;
                        };
                        // Only the direction matters, and that all layers use the same unit: kg/m for each cell.
                        for (gradient, sum) in shared.gradient[node].iter_mut().zip(sum) {
                            *gradient += cloud.mass * sum;
                        }
                    }
                }
            }
        }
        self.keep_along_walls(number, &continuum.grid.walls);
    }
}

/// Nodes along the side of the 3 x 3 node tiles around a tile of points.
const SIDE: usize = 3 * TILE;

/// Adds what a point at `at`, in cells from the domain's corner, adds to the nodes from node `first` on.
#[inline]
fn add_point(sums: &mut [[[f64; 2]; SIDE]; SIDE], first: [i64; 2], at: [f64; 2]) {
    let cell = at.map(f64::floor);
    let [(dx, mx), (dy, my)] = [0, 1].map(|a| kernel(at[a] - cell[a]));
    // Points are sorted before they leave the nodes around their tile.
    let [x, y] = [0, 1].map(|a| (cell[a] as i64 - 1 - first[a]) as usize);
    for (j, row) in sums.iter_mut().skip(y).take(4).enumerate() {
        for (i, sum) in row.iter_mut().skip(x).take(4).enumerate() {
            sum[0] += dx[i] * my[j];
            sum[1] += mx[i] * dy[j];
        }
    }
}

/// For the four nodes around a point, which is `f` of a cell beyond the second: difference and mean of the splines beside each.
#[inline]
fn kernel(f: f64) -> ([f64; 4], [f64; 4]) {
    let a = 0.5 * (1.0 - f) * (1.0 - f);
    let b = 0.75 - (f - 0.5) * (f - 0.5);
    let c = 0.5 * f * f;
    (
        [a, b - a, c - b, -c],
        [0.5 * a, 0.5 * (a + b), 0.5 * (b + c), 0.5 * c],
    )
}
