//! Held points: their nodes get the impulses that keep them in place ([`crate::state::holds`]).

use interface::impulse::at;

use super::images::spread_vectors;
use crate::kernel::lanes::LANES;
use crate::kernel::point_tile::owner;
use crate::kernel::shape::Shape;
use crate::kernel::tiles::{NODES, first_node, node, pitch};
use crate::kernel::transfer::AffineState;
use crate::state::continuum::Continuum;
use crate::state::grid::Grid;
use crate::state::holds::{Hold, Holds, Row, Weight};
use crate::state::nodes::{NodeAt, NodeTile};
use crate::state::points::Cloud;

/// Finds the nodes of the held points, and constrains the velocities before the kick. The points feel the share
/// `pic_fraction` of the change.
pub fn hold_before<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
    pic_fraction: f64,
) {
    if continuum.holds.is_empty() {
        return;
    }
    find_rows(continuum);
    continuum.holds.impulse = [0.0; 3];
    for hold in &mut continuum.holds.all {
        hold.impulse = [0.0; 2];
    }
    hold_nodes(continuum, pic_fraction, |tile| &mut tile.before);
}

/// Constrains the velocities after the kick, before images follow.
pub fn hold_after<const W: usize, S: Shape<W>, A: AffineState>(continuum: &mut Continuum<W, S, A>) {
    if !continuum.holds.is_empty() {
        hold_nodes(continuum, 1.0, |tile| &mut tile.after);
    }
}

/// Finds the rows of the held points, unless these stay where they were, and the nodes' part in them.
fn find_rows<const W: usize, S: Shape<W>, A: AffineState>(continuum: &mut Continuum<W, S, A>) {
    let Continuum {
        clouds,
        grid,
        holds,
        ..
    } = continuum;
    let moved = {
        let places = holds.all.iter().flat_map(|hold| {
            let cloud = &clouds[hold.points.cloud as usize];
            hold.points.lanes(cloud).map(|lane| cloud.position(lane))
        });
        let (allocation, found) = &holds.found_for;
        let stay = grid.allocations == *allocation && places.clone().eq(found.iter().copied());
        (!stay).then(|| places.collect())
    };
    let new = moved.is_some();
    if let Some(places) = moved {
        holds.found_for = (grid.allocations, places);
        collect_rows(clouds, grid, holds);
    }
    let (tiles, walls) = (&grid.tiles, &grid.walls);
    holds.prepare(new, &|at| {
        let (tile, n) = at.split();
        let tile = &tiles[tile];
        let free = walls.free(node(first_node(tile.at), n));
        free.map(|free| free * tile.per_mass[n])
    });
}

/// Computes the weights of the held points at their present positions.
fn collect_rows<const W: usize, S: Shape<W>, A: AffineState>(
    clouds: &[Cloud<W, S, A>],
    grid: &Grid,
    holds: &mut Holds,
) {
    holds.rows.clear();
    holds.weights.clear();
    for number in 0..holds.all.len() {
        let (earlier, hold) = holds.all.split_at(number);
        let hold = &hold[0];
        let cloud = &clouds[hold.points.cloud as usize];
        for lane in hold.points.lanes(cloud) {
            let local = cloud.state.ids[lane / LANES][lane % LANES];
            let held = |a: usize| {
                let again = |h: &Hold| h.along[a] && h.points.has(hold.points.cloud, local);
                hold.along[a] && !earlier.iter().any(again)
            };
            let along = [0, 1].map(|a| f64::from(u8::from(held(a))));
            let tile = cloud.tile_of_lane(lane);
            let place = tile.frame.locate(&cloud.state.x[lane / LANES], pitch(W));
            let k = lane % LANES;
            let s = [0, 1].map(|a| cloud.shape.weights(a, place.d[a]).map(|w| w.as_array()[k]));
            let base = place.column_row(k, W);
            let first = holds.weights.len() as u32;
            for j in 0..W {
                for i in 0..W {
                    let (tile, node) = owner::<W>(tile, [base[0] + i, base[1] + j]);
                    let at = NodeAt { tile, node };
                    let image = grid.image(at);
                    let sign = image.map_or([1.0; 2], |image| image.sign);
                    holds.weights.push(Weight {
                        node: 0,
                        at: image.map_or(at, |image| image.of),
                        along: sign.map(|sign| sign * s[0][i] * s[1][j]),
                    });
                }
            }
            holds.rows.push(Row {
                hold: number as u32,
                along,
                first,
                count: (W * W) as u32,
            });
        }
    }
}

/// Constrains the velocities in [`crate::state::grid::Grid::mapped`], with which points move; no momentum changes by it.
pub fn hold_mapped<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
) {
    let (holds, grid) = (&mut continuum.holds, &mut continuum.grid);
    if holds.is_empty() {
        return;
    }
    for a in 0..2 {
        project(holds, a, &mut grid.mapped, |tile| &mut tile.velocity);
    }
    spread_vectors(&grid.images, &mut grid.mapped, 1.0);
}

/// Brings the velocities of the held points to zero by the smallest change of the nodal velocities. The points feel the
/// share `share` of it.
fn hold_nodes<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
    share: f64,
    velocities: impl Fn(&mut NodeTile) -> &mut [[f64; 2]; NODES],
) {
    let (holds, grid) = (&mut continuum.holds, &mut continuum.grid);
    let (tiles, geometry) = (&mut grid.tiles, grid.geometry);
    for a in 0..2 {
        project(holds, a, tiles, &velocities);
        let mut impulses = core::mem::take(&mut holds.axes[a].velocity);
        for (held, gain) in holds.nodes.iter().zip(&mut impulses) {
            let (tile, n) = held.at.split();
            *gain *= share * tiles[tile].mass[n];
            let mut impulse = [0.0; 2];
            impulse[a] = *gain;
            let place = geometry.place(node(first_node(tiles[tile].at), n));
            holds.impulse[2] += at(place, impulse)[2];
        }
        holds.impulse[a] += impulses.iter().sum::<f64>();
        holds.share(a, &impulses);
        holds.axes[a].velocity = impulses;
    }
}

/// Changes the nodal velocities along one axis so that the held points have none; the changes are left in
/// [`crate::state::holds::Axis::velocity`].
fn project<T>(
    holds: &mut Holds,
    a: usize,
    tiles: &mut [T],
    velocities: impl Fn(&mut T) -> &mut [[f64; 2]; NODES],
) {
    holds.axes[a].velocity.clear();
    for held in &holds.nodes {
        let (tile, n) = held.at.split();
        let v = velocities(&mut tiles[tile])[n][a];
        holds.axes[a].velocity.push(v);
    }
    holds.project(a);
    for (held, gain) in holds.nodes.iter().zip(&holds.axes[a].velocity) {
        let (tile, n) = held.at.split();
        velocities(&mut tiles[tile])[n][a] += gain;
    }
}
