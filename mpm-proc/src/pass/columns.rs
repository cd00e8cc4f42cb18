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

use crate::state::columns::Column;
use crate::state::grid::Grid;
use crate::state::nodes::{MappedTile, NodeAt, NodeTile};
use crate::state::walls::{Held, WallNodes};

/// The velocities of three nodes after the wall has acted, and that of the middle one before it has.
struct Acted {
    velocities: [[f64; 2]; 3],
    free: [f64; 2],
    held: Held,
    /// What moves with the node on the wall, in kg/m.
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
    /// Acts on the velocities of its nodes; `stopped` as for [`WallNodes::act`].
    fn act(
        &self,
        tiles: &[NodeTile],
        walls: &WallNodes,
        mut velocities: [[f64; 2]; 3],
        stopped: Option<[f64; 2]>,
    ) -> Acted {
        let of = |n: usize| {
            let (tile, n) = self.nodes[n].split();
            (tiles[tile].per_mass[n], tiles[tile].mass[n])
        };
        let [(p, _), (q, own), (r, _)] = [0, 1, 2].map(of);
        straighten(&mut velocities, [p, q, r], false);
        let free = velocities[1];
        let held = walls.act(self.on, free, stopped, true);
        velocities[1] = held.velocity;
        straighten(&mut velocities, [p, q, r], true);
        Acted {
            velocities,
            free,
            held,
            mass: own + if p > 0.0 { 4.0 / (p + r) } else { 0.0 },
        }
    }
}

/// Acts on velocities before the kick, of which points feel the share `pic_fraction`.
pub fn act_before(grid: &mut Grid, pic_fraction: f64) {
    let tiles = &mut grid.tiles;
    for column in &mut grid.columns {
        let nodes = column.nodes.map(NodeAt::split);
        let v = nodes.map(|(tile, n)| tiles[tile].before[n]);
        let acted = column.act(tiles, &grid.walls, v, None);
        for ((tile, n), v) in nodes.into_iter().zip(acted.velocities) {
            tiles[tile].before[n] = v;
        }
        let taken = [0, 1].map(|a| pic_fraction * (acted.free[a] - acted.held.velocity[a]));
        let wall = &mut tiles[nodes[1].0].wall;
        wall.count(
            grid.geometry.place(column.on),
            taken.map(|v| -acted.mass * v),
        );
        column.stopped = taken;
    }
}

/// Acts on velocities after the kick.
pub fn act_after(grid: &mut Grid) {
    let tiles = &mut grid.tiles;
    for column in &grid.columns {
        let nodes = column.nodes.map(NodeAt::split);
        let v = nodes.map(|(tile, n)| tiles[tile].after[n]);
        let acted = column.act(tiles, &grid.walls, v, Some(column.stopped));
        for ((tile, n), v) in nodes.into_iter().zip(acted.velocities) {
            tiles[tile].after[n] = v;
        }
        let (tile, n) = nodes[1];
        tiles[tile].take(
            n,
            column.on,
            &acted.held,
            (acted.mass, acted.free),
            &grid.geometry,
        );
    }
}

/// Acts on mapped velocities, where they are wanted.
pub fn act_mapped(grid: &mut Grid) {
    let mapped = &mut grid.mapped;
    for column in &grid.columns {
        let nodes = column.nodes.map(NodeAt::split);
        let is_wanted = |(tile, n): (usize, usize)| mapped[tile].wanted >> n & 1 == 1;
        if !nodes.into_iter().all(is_wanted) {
            continue;
        }
        let v = nodes.map(|(tile, n)| mapped[tile].velocity[n]);
        let acted = column.act(&grid.tiles, &grid.walls, v, None);
        for ((tile, n), v) in nodes.into_iter().zip(acted.velocities) {
            mapped[tile].velocity[n] = v;
        }
        let impulse = [0, 1].map(|a| acted.mass * (acted.held.velocity[a] - acted.free[a]));
        let MappedTile { wall, .. } = &mut mapped[nodes[1].0];
        wall.count(grid.geometry.place(column.on), impulse);
    }
}
