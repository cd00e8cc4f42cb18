//! Velocities across walls with friction, for B-splines.
//!
//! The functions of the nodes beyond a wall reach into the domain, where they carry a part of the pressure on it. A mirror
//! gives that part to the nodes within, but a wall with friction lets go, and no mirror does. If instead each node beyond
//! kept the velocity to itself and the wall held it, the strain of the first cell would be wrong by its half, and stresses
//! by a third. So the velocity is linear across the wall, `v_-1 = 2 v_0 - v_1`, wherever it moves: each kick and each
//! mapping ends with the least change by mass that makes it so,
//!
//! ```text
//! c = v_-1 - 2 v_0 + v_1,   J = c / (1/m_-1 + 4/m_0 + 1/m_1),   v_-1 -= J/m_-1,  v_0 += 2 J/m_0,  v_1 -= J/m_1
//! ```
//!
//! It keeps momentum, angular momentum and any linear field. The velocity of the wall's surface is then that of the node on
//! it, `(v_-1 + 6 v_0 + v_1)/8 = v_0`, so that the wall acts there alone, on all three nodes together: an impulse there
//! moves the mass `m_0 + 4/(1/m_-1 + 1/m_1)`.

use crate::kernel::tiles::NODES;
use crate::state::columns::Column;
use crate::state::grid::Grid;
use crate::state::nodes::NodeAt;
use crate::state::walls::{Held, WallNodes};

/// What the wall has done to the node on it.
struct Acted {
    /// Its velocity in m/s before the wall has acted.
    free: [f64; 2],
    held: Held,
    /// What moves with it, in kg/m.
    mass: f64,
}

/// Makes velocities linear by the least change by mass; where the middle one is held, of the other two.
fn straighten(v: &mut [[f64; 2]; 3], [p, q, r]: [f64; 3], held: bool) {
    if p == 0.0 {
        return; // no point sees the node beyond
    }
    let q = if held { 0.0 } else { q };
    for a in 0..2 {
        let impulse = (v[0][a] - 2.0 * v[1][a] + v[2][a]) / (p + 4.0 * q + r);
        v[0][a] -= p * impulse;
        v[1][a] += 2.0 * q * impulse;
        v[2][a] -= r * impulse;
    }
}

impl Column {
    /// Acts on the velocities `of` tiles at its nodes; `stopped` as for [`WallNodes::act`].
    fn act<T>(
        &self,
        tiles: &mut [T],
        of: impl Fn(&mut T) -> &mut [[f64; 2]; NODES],
        walls: &WallNodes,
        stopped: Option<[f64; 2]>,
    ) -> Acted {
        let nodes = self.nodes.map(NodeAt::split);
        let mut v = nodes.map(|(tile, n)| of(&mut tiles[tile])[n]);
        straighten(&mut v, self.per_mass, false);
        let free = v[1];
        let held = walls.act(self.on, free, stopped, true);
        v[1] = held.velocity;
        straighten(&mut v, self.per_mass, true);
        for ((tile, n), v) in nodes.into_iter().zip(v) {
            of(&mut tiles[tile])[n] = v;
        }
        let [p, _, r] = self.per_mass;
        let others = if p > 0.0 { 4.0 / (p + r) } else { 0.0 };
        let mass = self.mass + others;
        Acted { free, held, mass }
    }
}

/// Acts on velocities before the kick, of which points feel the share `pic_fraction`.
pub fn act_before(grid: &mut Grid, pic_fraction: f64) {
    let tiles = &mut grid.tiles;
    for column in &mut grid.columns {
        let nodes = column.nodes.map(NodeAt::split);
        let (on_wall, n) = nodes[1];
        column.per_mass = nodes.map(|(tile, n)| tiles[tile].per_mass[n]);
        column.mass = tiles[on_wall].mass[n];
        let acted = column.act(tiles, |tile| &mut tile.before, &grid.walls, None);
        column.stopped = [0, 1].map(|a| pic_fraction * (acted.free[a] - acted.held.velocity[a]));
        let impulse = column.stopped.map(|v| -acted.mass * v);
        let place = grid.geometry.place(column.on);
        tiles[on_wall].wall.count(place, impulse);
    }
}

/// Acts on velocities after the kick.
pub fn act_after(grid: &mut Grid) {
    let tiles = &mut grid.tiles;
    for column in &grid.columns {
        let stopped = Some(column.stopped);
        let Acted { free, held, mass } =
            column.act(tiles, |tile| &mut tile.after, &grid.walls, stopped);
        let (tile, n) = column.nodes[1].split();
        tiles[tile].take(n, column.on, &held, (mass, free), &grid.geometry);
    }
}

/// Acts on mapped velocities, where they are wanted.
pub fn act_mapped(grid: &mut Grid) {
    let mapped = &mut grid.mapped;
    for column in &grid.columns {
        let is_wanted = |at: NodeAt| {
            let (tile, n) = at.split();
            mapped[tile].wanted >> n & 1 == 1
        };
        if !column.nodes.into_iter().all(is_wanted) {
            continue;
        }
        let acted = column.act(mapped, |tile| &mut tile.velocity, &grid.walls, None);
        let impulse = [0, 1].map(|a| acted.mass * (acted.held.velocity[a] - acted.free[a]));
        let place = grid.geometry.place(column.on);
        mapped[column.nodes[1].split().0].wall.count(place, impulse);
    }
}
