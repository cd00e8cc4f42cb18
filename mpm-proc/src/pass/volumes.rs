//! Makes the volumes of points consistent with one another and with the available space, for materials that need it.
//!
//! The volume of a point follows the divergence of the velocity at that point only. There are more volumes of points
//! than velocities of nodes, so most of the noise in the volumes causes no force and is never corrected. And in
//! continued shear the sum of the volumes drifts away from the space that the points occupy, because each is strained
//! at its position and not over its box (Brackbill 1988 has the first, Steffen, Kirby and Berzins 2008 the second as an
//! error of quadrature). For grains without tension this is worse: a point with too much volume is open and carries no
//! stress, so that others carry all.
//!
//! Therefore two corrections are added to the strain of every step, as the averaged dilation of F-bar methods (for
//! material points: Mast, Mackenzie-Helnwein, Arduino, Miller and Shin 2012): at the rate `r` of the material the
//! difference of `ln J` to its mean over the nodes,
//!
//! ```text
//! J_I = sum_p V_p S_Ip / sum_p V_p0 S_Ip,   J_p -> sum_I S_Ip J_I,
//! ```
//!
//! which keeps the sum of the volumes, and at a hundredth of it the difference to what there is room for, `J_I A_I /
//! sum_p V_p S_Ip` of the room `A_I` of the node, where points fill more than four fifths of it. Below that there is a
//! surface, whose place no node knows. What nodes beyond a wall have of the points counts for those as far within, also at walls
//! that are no mirrors: lattices fill the room of both together exactly, that of a part of a node's function only nearly. That the
//! density should be that of the grid is Baumgarten and Kamrin's (2023), who move points for it. Rates, as in
//! [`crate::kernel::transfer`], so that steps of any length do the same in a second.

use super::images::spread_values;
use super::node_momentum::sum_numbers;
use crate::kernel::lanes::{Lanes, ZERO, splat};
use crate::kernel::shape::Shape;
use crate::kernel::threads::{PerTile, over_tiles};
use crate::kernel::tiles::{NODES, Place, first_node, node, pitch};
use crate::kernel::transfer::{AffineState, share};
use crate::kernel::window::{VectorWindow, clear, gather_row, scatter_row};
use crate::state::continuum::Continuum;
use crate::state::grid::Grid;
use crate::state::points::Cloud;

/// Rate of the second mixture over that of the first.
const ROOM: f64 = 0.01;
/// Share of a node's room above which points fill it.
const FILLED: f64 = 0.8;

/// The shares of an interval of `dt` (s) at this rate (1/s): of the mean volume, and of the room.
pub fn shares(rate: f64, dt: f64) -> [f64; 2] {
    [rate, ROOM * rate].map(|rate| share(rate, dt))
}

/// Sets [`crate::state::grid::Grid::sums`] to the mean volume over the initial one and the volume for which there is space, if a
/// material needs them. It uses the windows of the internal forces, which are summed afterwards.
pub fn map_volumes<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
) {
    if continuum
        .clouds
        .iter()
        .all(|c| c.material.sharing_rate() <= 0.0)
    {
        return;
    }
    let threads = &continuum.threads;
    let (clouds, grid) = (&mut continuum.clouds, &mut continuum.grid);
    Cloud::each(threads, clouds, |threads, cloud| {
        if cloud.material.sharing_rate() <= 0.0 {
            return;
        }
        let (shape, x, volume) = (cloud.shape, &cloud.state.x, cloud.volume);
        let points = &cloud.state.stresses.points;
        let share = PerTile(&mut cloud.force[..]);
        over_tiles(threads, &cloud.tiles, share, || (), &|tile, window, ()| {
            let window = &mut window.0[0];
            clear::<W, 2>(&mut window.0, tile);
            for b in 0..tile.blocks {
                let block = tile.first + b;
                let place = tile.frame.locate(&x[block], pitch(W));
                let initial = splat(volume) * tile.live(b);
                add_volumes(
                    window,
                    &place,
                    &shape,
                    [initial, initial * points[block].volume],
                );
            }
        });
    });
    sum_numbers(grid, threads, clouds, |cloud| {
        cloud.material.sharing_rate() > 0.0
    });
    let mut sums = core::mem::take(&mut grid.sums);
    for [(tile, n), (of, m)] in beyond_walls(grid) {
        let own = sums[tile][n];
        for k in 0..2 {
            sums[of][m][k] += own[k];
        }
    }
    for (nodes, tile) in sums.iter_mut().zip(&grid.tiles) {
        let origin = first_node(tile.at);
        for (n, sums) in nodes.iter_mut().enumerate() {
            let [initial, now] = *sums;
            let room = grid.walls.room(node(origin, n)) * grid.geometry.cell.powi(2);
            let mean = if initial > 0.0 { now / initial } else { 1.0 };
            let fits = if now > FILLED * room {
                room / initial
            } else {
                mean
            };
            *sums = [mean, fits];
        }
    }
    for [(tile, n), (of, m)] in beyond_walls(grid) {
        sums[tile][n] = sums[of][m];
    }
    spread_values(&grid.images, &mut sums);
    grid.sums = sums;
}

/// The nodes beyond walls that hold points and are no mirrors, each with the one as far within: their tiles and numbers there.
fn beyond_walls(grid: &Grid) -> impl Iterator<Item = [(usize, usize); 2]> {
    let tiles = grid.tiles.iter().enumerate();
    tiles.flat_map(move |(number, tile)| {
        let walled = (0..NODES).filter(|n| tile.walled >> n & 1 == 1);
        walled.filter_map(move |n| {
            let at = node(first_node(tile.at), n);
            let of = Some(grid.walls.within(at)).filter(|of| *of != at);
            let (holder, m) = grid.holder(of?)?;
            Some([(number, n), (holder as usize, m)])
        })
    })
}

/// Adds two numbers of each of four points to the nodes, by their weights.
#[inline(always)]
fn add_volumes<const W: usize, S: Shape<W>>(
    window: &mut VectorWindow,
    place: &Place,
    shape: &S,
    numbers: [Lanes; 2],
) {
    let s = [shape.weights(0, place.d[0]), shape.weights(1, place.d[1])];
    for j in 0..W {
        let across = numbers.map(|n| s[1][j] * n);
        let mut row = [[ZERO; 2]; W];
        for i in 0..W {
            row[i] = across.map(|n| s[0][i] * n);
        }
        scatter_row(window, place, j, &row);
    }
}

/// The change of `ln J` of four points with this volume over the initial one, by the `ratio` at the nodes.
#[inline(always)]
pub fn swelling<const W: usize>(
    ratio: &VectorWindow,
    place: &Place,
    s: &[[Lanes; W]; 2],
    volume: Lanes,
    [of_mean, of_room]: [f64; 2],
) -> Lanes {
    let (mut mean, mut fits) = (ZERO, ZERO);
    for j in 0..W {
        for (i, node) in gather_row::<W>(ratio, place, j).iter().enumerate() {
            let weight = s[0][i] * s[1][j];
            mean = weight.mul_add(node[0], mean);
            fits = weight.mul_add(node[1], fits);
        }
    }
    splat(of_room).mul_add((fits / mean).ln(), splat(of_mean) * (mean / volume).ln())
}
