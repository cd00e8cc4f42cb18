//! Points to grid: mass and momentum (Jiang 2020 eqs. 18, 19, 30).

use super::gaps::measure_gaps;
use super::holds::hold_before;
use super::images::spread_before;
use super::node_momentum::{divide_mapped, sum_momentum};
use super::spin::spin;
use crate::kernel::lanes::{LANES, Lanes, ZERO, splat};
use crate::kernel::point_tile::Which;
use crate::kernel::shape::Shape;
use crate::kernel::threads::{PerTile, over_tiles};
use crate::kernel::tiles::{Place, pitch};
use crate::kernel::transfer::AffineState;
use crate::kernel::window::{NodalWindow, add_numbers, add_product, clear};
use crate::state::continuum::Continuum;
use crate::state::points::Cloud;
use mechanics::threads::Threads;

/// Maps mass and momentum of all points to the nodes, and divides them: velocities of the nodes before the kick.
pub fn points_to_grid<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
) {
    measure_gaps(continuum);
    let threads = &continuum.threads;
    let pic_fraction = continuum.transfer.pic_fraction;
    let (clouds, grid) = (&mut continuum.clouds, &mut continuum.grid);
    let cell = grid.geometry.cell;
    Cloud::each(threads, clouds, |threads, cloud| {
        map_cloud(threads, cloud, Which::All, cell);
    });
    sum_momentum(grid, threads, clouds, pic_fraction);
    hold_before(continuum, pic_fraction);
    let grid = &mut continuum.grid;
    spread_before(&grid.images, &mut grid.tiles, pic_fraction);
}

/// Maps the velocities of the points in `which` tiles to [`crate::state::grid::Grid::mapped`]. The velocities with
/// which the nodes move do not change.
pub fn map_velocities<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
    which: Which,
) {
    let threads = &continuum.threads;
    let (clouds, grid) = (&mut continuum.clouds, &mut continuum.grid);
    let cell = grid.geometry.cell;
    Cloud::each(threads, clouds, |threads, cloud| {
        map_cloud(threads, cloud, which, cell);
    });
    divide_mapped(grid, threads, clouds);
}

/// Sums mass and momentum of a cloud's points into the windows of their tiles, of `which`; with the group's spin at the nodes
/// where it is kept.
fn map_cloud<const W: usize, S: Shape<W>, A: AffineState>(
    threads: &Threads,
    cloud: &mut Cloud<W, S, A>,
    which: Which,
    cell: f64,
) {
    if cloud.spin.is_some() {
        let turn = spin(cloud);
        cloud.spin = Some(turn);
        // The change of velocity from one node to the next along x, and along y.
        let [none, over_cell] = [ZERO, splat(turn * cell)];
        let slopes = [[none, over_cell], [-over_cell, none]];
        fill_windows::<W, true, S, A>(threads, cloud, which, slopes);
    } else {
        fill_windows::<W, false, S, A>(threads, cloud, which, [[ZERO; 2]; 2]);
    }
}

/// Sums mass and momentum of a cloud's points into the windows of their tiles, of `which`. Points have affine parts of their
/// own, or all have those `of_group` if `SPIN`.
fn fill_windows<const W: usize, const SPIN: bool, S: Shape<W>, A: AffineState>(
    threads: &Threads,
    cloud: &mut Cloud<W, S, A>,
    which: Which,
    of_group: [[Lanes; 2]; 2],
) {
    let (shape, x, motion, mass) = (cloud.shape, &cloud.state.x, &cloud.state.motion, cloud.mass);
    let share = PerTile(&mut cloud.mass_momentum[..]);
    over_tiles(threads, &cloud.tiles, share, || (), &|tile, window, ()| {
        if !which.has(tile) {
            return;
        }
        let nodes = &mut window.0[0];
        clear::<W, 4>(&mut nodes.0, tile);
        for b in 0..tile.blocks {
            let block = tile.first + b;
            let place = tile.frame.locate(&x[block], pitch(W));
            let s = [shape.weights(0, place.d[0]), shape.weights(1, place.d[1])];
            let mass = splat(mass) * tile.live(b);
            let v = motion[block].v;
            if SPIN {
                add_momentum::<W, true>(nodes, &place, &s, (v, of_group), mass);
            } else if A::PRESENT {
                let slopes = motion[block].affine.slopes();
                add_momentum::<W, true>(nodes, &place, &s, (v, slopes), mass);
            } else {
                add_momentum::<W, false>(nodes, &place, &s, (v, of_group), mass);
            }
        }
    });
}

/// `m_I += m_p S_Ip`, `p_I += m_p S_Ip (v_p + B_p D_p^-1 (x_I - x_p))` for four points, the second part if `AFFINE`: their
/// velocities, and its change from one node to the next along x and along y.
#[inline(always)]
fn add_momentum<const W: usize, const AFFINE: bool>(
    nodes: &mut NodalWindow,
    place: &Place,
    s: &[[Lanes; W]; 2],
    (velocity, [along, across]): ([Lanes; 2], [[Lanes; 2]; 2]),
    mass: Lanes,
) {
    // (m, p_x, p_y, 0) of each point at its base node, and the change by one node along x and along y.
    let mut v = velocity;
    let mut change = [[ZERO; LANES]; 2];
    if AFFINE {
        for a in 0..2 {
            v[a] -= along[a] * place.d[0] + across[a] * place.d[1];
        }
        change = [
            Lanes::transpose([ZERO, mass * along[0], mass * along[1], ZERO]),
            Lanes::transpose([ZERO, mass * across[0], mass * across[1], ZERO]),
        ];
    }
    let at_base = Lanes::transpose([mass, mass * v[0], mass * v[1], ZERO]);
    // Point by point from here, a node's four numbers in one register.
    let [mut sx, mut sy] = [[[0.0; LANES]; W]; 2];
    for i in 0..W {
        sx[i] = s[0][i].to_array();
        sy[i] = s[1][i].to_array();
    }
    if place.shared {
        // What the four add to a node is summed before it goes there.
        let mut rows = at_base;
        for j in 0..W {
            let (mut value, mut step) = ([ZERO; LANES], [ZERO; LANES]);
            for k in 0..LANES {
                let weight = splat(sy[j][k]);
                value[k] = weight * rows[k];
                if AFFINE {
                    step[k] = weight * change[0][k];
                    rows[k] += change[1][k];
                }
            }
            for i in 0..W {
                let mut sum = splat(sx[i][0]) * value[0];
                for k in 1..LANES {
                    sum = splat(sx[i][k]).mul_add(value[k], sum);
                }
                add_numbers(nodes, 4 * (place.base(0) + j * pitch(W) + i), sum);
                if AFFINE {
                    for k in 0..LANES {
                        value[k] += step[k];
                    }
                }
            }
        }
        return;
    }
    for k in 0..LANES {
        let mut row = at_base[k];
        for j in 0..W {
            let weight = splat(sy[j][k]);
            let mut value = weight * row;
            let step = weight * change[0][k];
            for i in 0..W {
                let at = 4 * (place.base(k) + j * pitch(W) + i);
                add_product(nodes, at, splat(sx[i][k]), value);
                if AFFINE {
                    value += step;
                }
            }
            if AFFINE {
                row += change[1][k];
            }
        }
    }
}
