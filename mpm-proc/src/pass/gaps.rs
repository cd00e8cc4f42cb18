//! Where material touches a wall with friction.
//!
//! Mass reaches the nodes of a wall before its surface reaches the wall: with quadratic B-splines from 3/2 of a cell on.
//! Nodes are held only where the surface is at the wall. The measure is the mean distance from the wall of the mass at the
//! node of the wall. It grows with the distance of a flat surface, whatever the density, so the surface is at the wall where
//! the mean distance is that of points that fill the half space ([`touching`]). A single row of points, whose mass has that
//! mean distance before it has come so near, is held some tenths of a cell early.

use crate::kernel::lanes::{LANES, splat};
use crate::kernel::shape::Shape;
use crate::kernel::tiles::{MARGIN, first_node, pitch};
use crate::kernel::transfer::AffineState;
use crate::state::continuum::Continuum;
use crate::state::points::Cloud;
use crate::state::walls::{REACH, WallNodes};

/// A spacing in cells.
const SMALL: f64 = 1e-3;

/// Mean distance in cells of the mass at a node of a wall across `axis`, of rows of points `spacing` cells apart whose
/// boxes fill the half space beside it. The limit of small boxes, which is as good as reached at [`SMALL`], is the mean of `|y|`
/// over the function: 1/3 for hats, 13/32 and 7/15 for the quadratic and the cubic B-spline. Of boxes so large that the first
/// row gives the wall no mass it is the distance of that row.
pub fn touching<const W: usize, S: Shape<W>>(shape: &S, axis: usize, spacing: f64) -> f64 {
    let (offset, spacing) = (shape.offset()[axis], spacing.max(SMALL));
    let (mut mass, mut moment) = (0.0, 0.0);
    for row in 0..(W as f64 / spacing).ceil() as usize {
        let y = (row as f64 + 0.5) * spacing;
        let base = (y - offset).floor();
        let weights = shape.weights(axis, splat(y - base));
        if let Some(weight) = weights.get(-base as usize).filter(|_| base <= 0.0) {
            mass += weight.as_array()[0];
            moment += weight.as_array()[0] * y;
        }
    }
    if mass > 0.0 {
        moment / mass
    } else {
        0.5 * spacing
    }
}

/// Sums `m_p S_Ip (y_p - y_0)` at the nodes of the walls with friction: `y_p` is the distance from the wall, `y_0`
/// [`touching`].
pub fn measure_gaps<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
) {
    let (clouds, walls) = (&continuum.clouds, &mut continuum.grid.walls);
    for (axis, end) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        let mut sums = core::mem::take(&mut walls.apart[axis][end]);
        if !sums.is_empty() {
            sums.fill(0.0);
            for cloud in clouds {
                add_distances(cloud, walls, axis, end, &mut sums);
            }
        }
        walls.apart[axis][end] = sums;
    }
}

fn add_distances<const W: usize, S: Shape<W>, A: AffineState>(
    cloud: &Cloud<W, S, A>,
    walls: &WallNodes,
    axis: usize,
    end: usize,
    sums: &mut [f64],
) {
    let (along, wall) = (1 - axis, [0, walls.cells[axis]][end]);
    let inward = [1.0, -1.0][end];
    for tile in &cloud.tiles {
        let first = first_node(tile.at).map(|node| node - MARGIN as i64);
        if !(first[axis]..first[axis] + pitch(W) as i64).contains(&wall) {
            continue;
        }
        for b in 0..tile.blocks {
            let place = tile.frame.locate(&cloud.state.x[tile.first + b], pitch(W));
            let s = [0, 1].map(|a| cloud.shape.weights(a, place.d[a]));
            for k in 0..LANES.min(tile.points - b * LANES) {
                let within = [place.base(k) % pitch(W), place.base(k) / pitch(W)];
                let base = [0, 1].map(|a| first[a] + within[a] as i64);
                let Some(across) = s[axis].get((wall - base[axis]) as usize) else {
                    continue;
                };
                let d = place.d[axis].as_array()[k];
                let distance = inward * ((base[axis] - wall) as f64 + d);
                let moment = cloud.mass * across.as_array()[k] * (distance - cloud.touching[axis]);
                for (node, weight) in (base[along]..).zip(&s[along]) {
                    let mut at = [wall; 2];
                    at[along] = node;
                    let of = walls.original(at).map_or(at, |(of, ..)| of);
                    sums[(of[along] + REACH) as usize] += moment * weight.as_array()[k];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::shape::{CubicBspline, Linear, QuadraticBspline, Ugimp};

    #[test]
    fn mass_at_a_wall_is_as_far_as_its_function_is_wide() {
        let fine = 1e-3;
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-6, "{a} {b}");
        near(touching(&Linear, 0, fine), 1.0 / 3.0);
        near(touching(&QuadraticBspline, 1, fine), 13.0 / 32.0);
        near(touching(&CubicBspline, 0, fine), 7.0 / 15.0);
        let l: f64 = 0.3;
        let of_box = 1.0 / 3.0 + l * l / 3.0 - l.powi(3) / 12.0;
        near(touching(&Ugimp::new([0.1, l]), 1, fine), of_box);
        // Two rows in a cell: 1/4, 3/4 and 5/4 of a cell away.
        let weights = [11.0 / 16.0, 9.0 / 32.0, 1.0 / 32.0];
        let mean = 0.25 * weights[0] + 0.75 * weights[1] + 1.25 * weights[2];
        assert_eq!(touching(&QuadraticBspline, 0, 0.5), mean);
        // No finer than makes a difference, and coarser than the function is wide.
        let [tiny, wide] = [1e-12, 3.5].map(|spacing| touching(&QuadraticBspline, 0, spacing));
        near(tiny, 13.0 / 32.0);
        assert_eq!(wide, 1.75);
    }
}
