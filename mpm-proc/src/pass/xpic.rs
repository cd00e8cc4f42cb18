//! The filter of XPIC(m) (Hammerquist and Nairn 2017): velocities of points less the part that the grid cannot
//! represent.
//!
//! ```text
//! v_p <- v_p - (1 - S S+)^m v_p,    S+ = M^-1 S^T M_p
//! ```
//!
//! then the increment of the grid, as in FLIP. With m = 1 this is PIC; the larger m, the less is filtered out. With a
//! rate, only a share of it is removed in each step ([`crate::kernel::transfer`]).

use crate::kernel::lanes::{Lanes, ZERO, splat};
use crate::kernel::point_tile::Which;
use crate::kernel::shape::Shape;
use crate::kernel::threads::{PerBlock, over_tiles};
use crate::kernel::tiles::pitch;
use crate::kernel::transfer::AffineState;
use crate::kernel::window::fill_window;
use crate::kernel::window::{NO_VECTORS, gather_row};
use crate::pass::points_to_grid::map_velocities;
use crate::state::continuum::Continuum;
use crate::state::nodes::ALL_NODES;
use crate::state::points::Cloud;

/// Filters the velocities of the points, if the transfer does. Walls constrain the velocities that the grid represents;
/// their change in the last round is an impulse on the points.
pub fn filter_velocities<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
) {
    let Some(filter) = continuum.transfer.filter else {
        return;
    };
    continuum.grid.make_room_for_mapped();
    continuum
        .grid
        .mapped
        .iter_mut()
        .for_each(|tile| tile.wanted = ALL_NODES);
    over_velocities(continuum, |v, aside| *aside = *v);
    for _ in 0..filter.order {
        map_velocities(continuum, Which::All);
        subtract(continuum);
    }
    let removed = splat(filter.share);
    over_velocities(continuum, |v, aside| {
        *v = [0, 1].map(|a| v[a].mul_neg_add(removed, aside[a]));
    });
    for tile in &continuum.grid.mapped {
        continuum.state.totals.applied_impulse += tile.wall.impulse.map(|p| filter.share * p);
    }
}

/// Calls `act` with the velocities of every block, and with those set aside.
fn over_velocities<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
    act: impl Fn(&mut [Lanes; 2], &mut [Lanes; 2]) + Sync,
) {
    let threads = &continuum.threads;
    let clouds = &mut continuum.clouds;
    Cloud::each(threads, clouds, |threads, cloud| {
        cloud.aside.resize(cloud.state.motion.len(), [ZERO; 2]);
        let share = (
            PerBlock(&mut cloud.state.motion[..]),
            PerBlock(&mut cloud.aside[..]),
        );
        over_tiles(threads, &cloud.tiles, share, || (), &|_, part, ()| {
            let (motion, aside) = part;
            for (motion, aside) in motion.0.iter_mut().zip(aside.0.iter_mut()) {
                act(&mut motion.v, aside);
            }
        });
    });
}

/// `v_p -= sum_I S_Ip v_I`, of what the grid has seen.
fn subtract<const W: usize, S: Shape<W>, A: AffineState>(continuum: &mut Continuum<W, S, A>) {
    let threads = &continuum.threads;
    let (clouds, grid) = (&mut continuum.clouds, &continuum.grid);
    Cloud::each(threads, clouds, |threads, cloud| {
        let (shape, x) = (cloud.shape, &cloud.state.x);
        let share = PerBlock(&mut cloud.state.motion[..]);
        over_tiles(
            threads,
            &cloud.tiles,
            share,
            || NO_VECTORS,
            &|tile, motion, window| {
                fill_window::<W, _>(window, &grid.tiles, tile, |t| {
                    &grid.mapped[t.index].velocity
                });
                for (x, motion) in x[tile.first..].iter().zip(motion.0.iter_mut()) {
                    let place = tile.frame.locate(x, pitch(W));
                    let s = [shape.weights(0, place.d[0]), shape.weights(1, place.d[1])];
                    for j in 0..W {
                        let row = gather_row::<W>(window, &place, j);
                        for i in 0..W {
                            let weight = s[0][i] * s[1][j];
                            for a in 0..2 {
                                motion.v[a] -= weight * row[i][a];
                            }
                        }
                    }
                }
            },
        );
    });
}
