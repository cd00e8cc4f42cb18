//! Points to grid: mass and momentum (Jiang 2020 eqs. 18, 19, 30).

use super::holds::hold_before;
use super::images::spread_before;
use super::node_momentum::{divide_mapped, sum_momentum};
use super::spin::spin;
use super::stress::BATCH;
use crate::kernel::lanes::{LANES, Lanes, ZERO, splat};
use crate::kernel::point_tile::{Tile, Which};
use crate::kernel::shape::Shape;
use crate::kernel::threads::{PerTile, over_tiles};
use crate::kernel::tiles::{Place, pitch};
use crate::kernel::transfer::{AffineState, Slopes};
use crate::kernel::window::{NodalWindow, add_numbers, add_product, clear};
use crate::state::continuum::Continuum;
use crate::state::points::{Cloud, Motion};
use mechanics::threads::Threads;

/// Sums mass and momentum of all points at the nodes, where the sweep before has not, and divides them: velocities of the nodes
/// before the kick.
pub fn points_to_grid<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
) {
    let threads = &continuum.threads;
    let pic_fraction = continuum.transfer.pic_fraction();
    let (clouds, grid) = (&mut continuum.clouds, &mut continuum.grid);
    for cloud in &mut *clouds {
        map_cloud(threads, cloud, Which::All, grid.geometry.cell);
    }
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
    for cloud in &mut *clouds {
        map_cloud(threads, cloud, which, grid.geometry.cell);
    }
    divide_mapped(grid, threads, clouds);
}

/// Sums mass and momentum of a cloud's points into the windows of their tiles, of `which`, where the sweep before has not; with
/// the group's spin at the nodes where it is kept.
fn map_cloud<const W: usize, S: Shape<W>, A: AffineState>(
    threads: &Threads,
    cloud: &mut Cloud<W, S, A>,
    which: Which,
    cell: f64,
) {
    if cloud.spin.is_some() {
        cloud.spin = Some(spin(cloud));
    }
    // The change of velocity from one node to the next along x, and along y.
    let of_group = cloud.spin.map(|turn| {
        let [none, over_cell] = [ZERO, splat(turn * cell)];
        [[none, over_cell], [-over_cell, none]]
    });
    let (shape, x, motion, mass) = (cloud.shape, &cloud.state.x, &cloud.state.motion, cloud.mass);
    let share = PerTile::one(&mut cloud.mass_momentum[..]);
    let spins = of_group.is_some();
    let memory = || [Place::NOWHERE; BATCH];
    over_tiles(
        threads,
        &cloud.tiles,
        share,
        memory,
        &|tile, window, places| {
            let window = &mut window.items[0];
            if !which.has(tile) || window.current {
                return;
            }
            clear::<W, 4>(&mut window.nodes.0);
            for first in (0..tile.blocks).step_by(BATCH) {
                let batch = first..tile.blocks.min(first + BATCH);
                let (x, motion) = (&x[tile.first..], &motion[tile.first..]);
                map_blocks(
                    (tile, first),
                    shape,
                    (&x[batch.clone()], &motion[batch]),
                    (mass, of_group),
                    places,
                    &mut window.nodes,
                );
            }
            window.current = !spins;
        },
    );
}

/// Finds the `places` of blocks of a tile from number `first` on, and adds their mass and momentum to its window: eqs. 18, 19 and 30. Points
/// have affine parts of their own, or all have those `of_group`.
pub fn map_blocks<const W: usize, S: Shape<W>, A: AffineState>(
    (tile, first): (&Tile, usize),
    shape: S,
    (x, motion): (&[[Lanes; 2]], &[Motion<A>]),
    (mass, of_group): (f64, Option<Slopes>),
    places: &mut [Place],
    nodes: &mut NodalWindow,
) {
    let blocks = x.iter().zip(motion).zip(places);
    for (b, ((x, motion), place)) in blocks.enumerate() {
        *place = tile.frame.locate(x, pitch(W));
        let s = [shape.weights(0, place.d[0]), shape.weights(1, place.d[1])];
        let mass = splat(mass) * tile.live(first + b);
        if let Some(slopes) = of_group {
            add_momentum::<W, true>(nodes, place, &s, (motion.v, slopes), mass);
        } else if A::PRESENT {
            add_momentum::<W, true>(nodes, place, &s, (motion.v, motion.affine.slopes()), mass);
        } else {
            add_momentum::<W, false>(nodes, place, &s, (motion.v, [[ZERO; 2]; 2]), mass);
        }
    }
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
    let mut v = velocity;
    if AFFINE {
        for a in 0..2 {
            v[a] -= along[a] * place.d[0] + across[a] * place.d[1];
        }
    }
    // Point by point from here, a node's four numbers in one register. Either way turns them for itself, and neither has a
    // loop over the four points that is kept: so they stay in registers.
    let turned = || Turned::new(mass, v, [along, across]);
    let [mut sx, mut sy] = [[[0.0; LANES]; W]; 2];
    for i in 0..W {
        sx[i] = s[0][i].to_array();
        sy[i] = s[1][i].to_array();
    }
    if place.shared() {
        // What the four add to a node is summed before it goes there.
        let points = turned();
        let mut sums = [[ZERO; W]; W];
        for k in 0..LANES {
            let mut row = points.at_base[k];
            for j in 0..W {
                let weight = splat(sy[j][k]);
                let mut value = weight * row;
                let step = weight * points.along[k];
                for i in 0..W {
                    let weight = splat(sx[i][k]);
                    sums[j][i] = if k == 0 {
                        weight * value
                    } else {
                        weight.mul_add(value, sums[j][i])
                    };
                    if AFFINE {
                        value += step;
                    }
                }
                if AFFINE {
                    row += points.across[k];
                }
            }
        }
        for j in 0..W {
            for i in 0..W {
                add_numbers(nodes, 4 * (place.base(0) + j * pitch(W) + i), sums[j][i]);
            }
        }
        return;
    }
    let points = turned();
    let mut add = |k: usize| {
        let mut row = points.at_base[k];
        for j in 0..W {
            let weight = splat(sy[j][k]);
            let mut value = weight * row;
            let step = weight * points.along[k];
            for i in 0..W {
                let at = 4 * (place.base(k) + j * pitch(W) + i);
                add_product(nodes, at, splat(sx[i][k]), value);
                if AFFINE {
                    value += step;
                }
            }
            if AFFINE {
                row += points.across[k];
            }
        }
    };
    add(0);
    add(1);
    add(2);
    add(3);
}

/// `(p_x, p_y, m)` of four points, one after the other.
struct Turned {
    /// At their base nodes.
    at_base: [Lanes; LANES],
    /// Its change from one node to the next along x.
    along: [Lanes; LANES],
    /// Along y.
    across: [Lanes; LANES],
}

impl Turned {
    #[inline(always)]
    fn new(mass: Lanes, v: [Lanes; 2], [along, across]: Slopes) -> Self {
        let at_base = Lanes::transpose([mass * v[0], mass * v[1], mass, mass]);
        let change = [along[0], along[1], across[0], across[1]].map(|c| mass * c);
        let change = Lanes::transpose(change);
        let (mut of_x, mut of_y) = (change, change);
        for k in 0..LANES {
            let [xx, xy, yx, yy] = change[k].to_array();
            of_x[k] = Lanes::new([xx, xy, 0.0, 0.0]);
            of_y[k] = Lanes::new([yx, yy, 0.0, 0.0]);
        }
        Self {
            at_base,
            along: of_x,
            across: of_y,
        }
    }
}
