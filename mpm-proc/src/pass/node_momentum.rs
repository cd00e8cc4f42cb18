//! Mass, momentum and velocity of the nodes (Jiang 2020 eqs. 18 to 20): the windows of the clouds are summed, the momentum
//! is divided by the mass, and the walls are obeyed.

use super::columns::{act_before, act_mapped};
use super::images::{gather_momentum, gather_sums, gather_vectors, spread_vectors};
use crate::kernel::shape::Shape;
use crate::kernel::threads::{PARTS, over_items};
use crate::kernel::tiles::{Geometry, NODES, first_node, node};
use crate::kernel::transfer::AffineState;
use crate::kernel::window::add_window;
use crate::state::grid::Grid;
use crate::state::nodes::{MappedTile, NodeTile, WallContribution, bits};
use crate::state::points::Cloud;
use crate::state::walls::WallNodes;
use mechanics::threads::Threads;

/// Below this mass (kg/m) a node counts as empty. Far below any mass that a shape function can give while its
/// quotients keep their digits.
const EMPTY: f64 = 1e-250;

/// Sums mass and momentum over the clouds' windows, in their order, and applies the walls (eqs. 18 to 20). Images
/// follow after all constraints on their originals ([`super::images::spread_before`]).
///
/// `pic_fraction` is the share of the momentum removed here that the points will feel.
pub fn sum_momentum<const W: usize, S: Shape<W>, A: AffineState>(
    grid: &mut Grid,
    threads: &Threads,
    clouds: &[Cloud<W, S, A>],
    pic_fraction: f64,
) {
    let (walls, overlaps, geometry) = (&grid.walls, &grid.overlaps, grid.geometry);
    over_items(threads, &mut grid.tiles, &|tile: &mut NodeTile| {
        let mut sum = [[0.0; 4]; NODES];
        for o in tile.overlapping(overlaps) {
            let window = &clouds[o.cloud as usize].mass_momentum[o.tile as usize];
            add_window::<W, 4>(&mut sum, &window.0, o.part());
        }
        tile.wall = WallContribution::default();
        tile.friction.clear();
        tile.damping.clear();
        for (i, sum) in sum.iter().enumerate() {
            tile.mass[i] = sum[0];
            tile.before[i] = [sum[1], sum[2]];
        }
        if !tile.imaged {
            tile.divide_momentum(walls, &geometry, pic_fraction);
        }
    });
    if !grid.images.is_empty() {
        gather_momentum(&mut grid.images, &mut grid.tiles);
        over_items(threads, &mut grid.tiles, &|tile: &mut NodeTile| {
            if tile.imaged {
                tile.divide_momentum(walls, &geometry, pic_fraction);
            }
        });
    }
    act_before(grid, pic_fraction);
}

/// Sums two numbers of the points at the nodes into [`Grid::sums`], from the windows of the internal forces of those clouds that
/// count; with what is at images.
pub fn sum_numbers<const W: usize, S: Shape<W>, A: AffineState>(
    grid: &mut Grid,
    threads: &Threads,
    clouds: &[Cloud<W, S, A>],
    counts: impl Fn(&Cloud<W, S, A>) -> bool + Sync,
) {
    let (tiles, overlaps) = (&grid.tiles, &grid.overlaps);
    grid.sums.resize(tiles.len(), [[0.0; 2]; NODES]);
    let part = threads.part(tiles.len(), PARTS, 1);
    let parts = grid.sums.chunks_mut(part).zip(tiles.chunks(part));
    threads.each(parts, |(sums, tiles)| {
        for (sum, tile) in sums.iter_mut().zip(tiles) {
            *sum = [[0.0; 2]; NODES];
            for o in tile.overlapping(overlaps) {
                let cloud = &clouds[o.cloud as usize];
                if counts(cloud) {
                    add_window::<W, 2>(sum, &cloud.force[o.tile as usize].0, o.part());
                }
            }
        }
    });
    gather_sums(&grid.images, &mut grid.sums);
}

/// Computes velocities `p_I / m_I` of the nodes from the clouds' windows, with walls, and writes them to
/// [`Grid::mapped`] where they are wanted. The velocities with which the nodes move do not change.
pub fn divide_mapped<const W: usize, S: Shape<W>, A: AffineState>(
    grid: &mut Grid,
    threads: &Threads,
    clouds: &[Cloud<W, S, A>],
) {
    let (walls, overlaps, tiles) = (&grid.walls, &grid.overlaps, &grid.tiles);
    let geometry = grid.geometry;
    over_items(threads, &mut grid.mapped, &|mapped: &mut MappedTile| {
        if mapped.wanted == 0 {
            return;
        }
        let tile = &tiles[mapped.tile as usize];
        let mut sum = [[0.0; 4]; NODES];
        for o in tile.overlapping(overlaps) {
            let window = &clouds[o.cloud as usize].mass_momentum[o.tile as usize];
            add_window::<W, 4>(&mut sum, &window.0, o.part());
        }
        for (v, sum) in mapped.velocity.iter_mut().zip(&sum) {
            *v = [sum[1], sum[2]];
        }
        mapped.wall = WallContribution::default();
        if !tile.imaged {
            mapped.divide_momentum(tile, walls, &geometry);
        }
    });
    if !grid.images.is_empty() {
        gather_vectors(&mut grid.images, &mut grid.mapped);
        over_items(threads, &mut grid.mapped, &|mapped: &mut MappedTile| {
            let tile = &tiles[mapped.tile as usize];
            if tile.imaged && mapped.wanted != 0 {
                mapped.divide_momentum(tile, walls, &geometry);
            }
        });
    }
    act_mapped(grid);
    spread_vectors(&grid.images, &mut grid.mapped, 1.0);
}

impl MappedTile {
    /// Turns momenta into velocities, with walls.
    fn divide_momentum(&mut self, tile: &NodeTile, walls: &WallNodes, geometry: &Geometry) {
        for (v, per_mass) in self.velocity.iter_mut().zip(&tile.per_mass) {
            *v = [v[0] * per_mass, v[1] * per_mass];
        }
        let origin = first_node(tile.at);
        for i in bits(tile.walled) {
            let free = self.velocity[i];
            let alone = tile.is_alone(i);
            let held = walls.act(node(origin, i), free, None, alone).velocity;
            self.wall.work += walls.drive(node(origin, i), tile.mass[i], free, held);
            let impulse = [0, 1].map(|a| tile.mass[i] * (held[a] - free[a]));
            self.wall.count(geometry.place(node(origin, i)), impulse);
            self.velocity[i] = held;
        }
    }
}

impl NodeTile {
    /// Turns the momenta in [`Self::before`] into velocities, with walls.
    fn divide_momentum(&mut self, walls: &WallNodes, geometry: &Geometry, pic_fraction: f64) {
        for (per_mass, mass) in self.per_mass.iter_mut().zip(&self.mass) {
            *per_mass = if *mass > EMPTY { 1.0 / mass } else { 0.0 };
        }
        for (v, per_mass) in self.before.iter_mut().zip(&self.per_mass) {
            *v = [v[0] * per_mass, v[1] * per_mass];
        }
        let origin = first_node(self.at);
        self.stopped.clear();
        for i in bits(self.walled) {
            let free = self.before[i];
            let alone = self.is_alone(i);
            let held = walls.act(node(origin, i), free, None, alone).velocity;
            let felt = pic_fraction * self.mass[i];
            self.wall.work += walls.drive(node(origin, i), felt, free, held);
            let impulse = [0, 1].map(|a| felt * (held[a] - free[a]));
            self.wall.count(geometry.place(node(origin, i)), impulse);
            self.stopped
                .push([0, 1].map(|a| pic_fraction * (free[a] - held[a])));
            self.before[i] = held;
        }
    }
}
