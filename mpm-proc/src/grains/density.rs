//! The gradient of a grain's density at the nodes, which tells the way out of it (Bardenhagen 2000 eq. 24).
//!
//! The paper maps masses to cell centres by quadratic B-splines `b` and takes the gradient of the bilinear function
//! through them at the nodes. Both together are one sum over points: along its own axis the difference of the two
//! splines beside the node, along the other their mean,
//!
//! ```text
//! d rho / dx (x_I) = 1/L^3 sum_p m_p (b(xi - 1/2) - b(xi + 1/2)) (b(eta - 1/2) + b(eta + 1/2)) / 2
//! ```
//!
//! with `xi`, `eta` the way from node to point in cells. It reaches two nodes to either side, whatever the shape function.

use super::contact::SharedNodes;
use crate::kernel::lanes::LANES;
use crate::kernel::point_tile::Tile;
use crate::kernel::shape::Shape;
use crate::kernel::tiles::TILE;
use crate::kernel::transfer::Transfer;
use crate::state::continuum::Continuum;

impl SharedNodes {
    /// Adds the gradients of grain `number` at the nodes that it shares with others.
    pub fn add_density_gradients<const W: usize, S: Shape<W>, T: Transfer>(
        &mut self,
        number: usize,
        continuum: &Continuum<W, S, T>,
    ) {
        let geometry = continuum.grid.geometry;
        for cloud in &continuum.clouds {
            // Only the direction counts, and that all grains measure alike: kg/m a cell.
            for tile in &cloud.tiles {
                if !tile.around.iter().any(|&t| self.is_shared(number, t)) {
                    continue;
                }
                for point in 0..tile.points {
                    let lane = (tile.first + point / LANES) * LANES + point % LANES;
                    let x = cloud.position(lane);
                    let at = [0, 1].map(|a| (x[a] - geometry.lower[a]) / geometry.cell);
                    self.add_point(number, tile, at, cloud.mass);
                }
            }
        }
        self.keep_along_walls(number, &continuum.grid.walls);
    }

    /// Adds the gradient of one point at `at`, in cells from the domain's corner.
    fn add_point(&mut self, number: usize, tile: &Tile, at: [f64; 2], mass: f64) {
        let first = at.map(|x| x.floor() as i64 - 1);
        let along = [0, 1].map(|a| kernel(at[a] - first[a] as f64));
        for j in 0..4 {
            for i in 0..4 {
                let node = [first[0] + i as i64, first[1] + j as i64];
                let Some((around, within)) = in_reach(tile, node) else {
                    continue;
                };
                let Some(gradient) = self.gradient(number, tile.around[around]) else {
                    continue;
                };
                let [(dx, sx), (dy, sy)] = [along[0][i], along[1][j]];
                gradient[within][0] += mass * dx * sy;
                gradient[within][1] += mass * sx * dy;
            }
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    /// The kernel is the paper's two steps in one: masses to cell centres, then the gradient of the bilinear function.
    #[test]
    fn one_sum_is_both_steps_of_the_paper() {
        for k in 0..50 {
            let at = [7.3 + 0.017 * f64::from(k), 4.9 - 0.013 * f64::from(k)];
            let centre = |i: i64, j: i64| {
                spline(at[0] - (i as f64 + 0.5)) * spline(at[1] - (j as f64 + 0.5))
            };
            let first = at.map(|x| x.floor() as i64 - 1);
            let along = [0, 1].map(|a| kernel(at[a] - first[a] as f64));
            let mut covered = 0.0;
            for j in 0..4 {
                for i in 0..4 {
                    let (x, y) = (first[0] + i as i64, first[1] + j as i64);
                    let right = centre(x, y - 1) + centre(x, y);
                    let left = centre(x - 1, y - 1) + centre(x - 1, y);
                    let gradient = along[0][i].0 * along[1][j].1;
                    assert!((gradient - 0.5 * (right - left)).abs() < 1e-15);
                    covered += along[0][i].1 * along[1][j].1;
                }
            }
            assert!((covered - 1.0).abs() < 1e-14, "nothing reaches further");
        }
    }
}
