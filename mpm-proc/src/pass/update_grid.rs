//! The grid's update: the kick of the nodes with damping and walls (Jiang 2020 eqs. 17 and 48).

use super::columns::act_after;
use super::holds::hold_after;
use super::images::{gather_force, spread_after};
use crate::kernel::shape::Shape;
use crate::kernel::threads::over_items;
use crate::kernel::tiles::{Geometry, NODES, first_node, node};
use crate::kernel::transfer::AffineState;
use crate::kernel::window::add_window;
use crate::state::continuum::Continuum;
use crate::state::damping::Damping;
use crate::state::grid::Grid;
use crate::state::nodes::{NodeTile, bits};
use crate::state::points::Cloud;
use crate::state::walls::{Held, WallNodes};
use mechanics::threads::Threads;

/// `v_I^{n+1/2} = v_I^{n-1/2} + (f_I^int + f_I^cont + m_I g) / m_I kick`, with walls (eqs. 17, 48).
/// `kick` is its length in s.
pub fn update_grid<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
    kick: f64,
) {
    let (threads, damping) = (&continuum.threads, continuum.damping);
    let (clouds, grid) = (&continuum.clouds, &mut continuum.grid);
    kick_nodes(grid, threads, clouds, kick, damping);
    if kick > 0.0 {
        note_pressed(grid); // In an opening step no force acts: what moves into a wall there, supports have moved.
    }
    hold_after(continuum);
    let grid = &mut continuum.grid;
    spread_after(&grid.images, &mut grid.tiles, kick);
}

/// Leaves to the next step which nodes walls with friction have held against forces.
fn note_pressed(grid: &mut Grid) {
    grid.walls.begin_kick();
    for tile in &grid.tiles {
        for axis in 0..2 {
            for i in bits(tile.pressed[axis]) {
                grid.walls.press(node(first_node(tile.at), i), axis);
            }
        }
    }
}

fn kick_nodes<const W: usize, S: Shape<W>, A: AffineState>(
    grid: &mut Grid,
    threads: &Threads,
    clouds: &[Cloud<W, S, A>],
    kick: f64,
    damping: Option<Damping>,
) {
    let (overlaps, contact, gravity) = (&grid.overlaps, &grid.contact, grid.gravity);
    let act = Kick {
        length: kick,
        gravity,
        damping,
        walls: &grid.walls,
        geometry: grid.geometry,
    };
    over_items(threads, &mut grid.tiles, &|tile: &mut NodeTile| {
        let mut force = [[0.0; 2]; NODES];
        for o in tile.overlapping(overlaps) {
            let window = &clouds[o.cloud as usize].force[o.tile as usize];
            add_window::<W, 2>(&mut force, &window.0, o.part());
        }
        if let Some(contact) = contact.get(tile.index).filter(|nodes| nodes.touched) {
            for (f, c) in force.iter_mut().zip(&contact.force) {
                f[0] += c[0];
                f[1] += c[1];
            }
        }
        if tile.imaged {
            tile.after = force;
        } else {
            tile.kick(&force, &act);
        }
    });
    if !grid.images.is_empty() {
        gather_force(&mut grid.images, &mut grid.tiles, gravity);
        over_items(threads, &mut grid.tiles, &|tile: &mut NodeTile| {
            if tile.imaged {
                let force = tile.after;
                tile.kick(&force, &act);
            }
        });
    }
    act_after(grid);
}

/// Everything except forces that acts on the nodes in a kick.
struct Kick<'a> {
    /// Its length in s.
    length: f64,
    gravity: [f64; 2],
    damping: Option<Damping>,
    walls: &'a WallNodes,
    geometry: Geometry,
}

impl NodeTile {
    /// Counts what walls have taken in the kick of a node `on` them, which moved this mass (kg/m) at `free` (m/s).
    pub fn take(
        &mut self,
        i: usize,
        on: [i64; 2],
        held: &Held,
        (mass, free): (f64, [f64; 2]),
        geometry: &Geometry,
    ) {
        if held.rubbed != [0.0; 2] {
            self.friction.push((i, held.rubbed.map(|v| -mass * v)));
        }
        for a in 0..2 {
            let presses = held.pressed[a] && self.per_mass[i] > 0.0; // an empty node only falls
            self.pressed[a] |= u64::from(presses) << i;
        }
        let impulse = [0, 1].map(|a| mass * (held.velocity[a] - free[a]));
        self.wall.count(geometry.place(on), impulse);
    }

    /// Kicks the nodes by `force` (N/m).
    fn kick(&mut self, force: &[[f64; 2]; NODES], act: &Kick) {
        // An empty node falls too; no point reads it.
        let fall = act.gravity.map(|g| g * act.length);
        let nodes = self.after.iter_mut().zip(&self.before);
        for (((after, before), per_mass), f) in nodes.zip(&self.per_mass).zip(force) {
            let gain = per_mass * act.length;
            for a in 0..2 {
                after[a] = f[a].mul_add(gain, before[a] + fall[a]);
            }
        }
        if let Some(damping) = act.damping {
            damping.act(self);
        }
        self.smoothing_work = self.wall.work;
        self.pressed = [0; 2];
        let (origin, walls) = (first_node(self.at), act.walls);
        for (k, i) in bits(self.walled).enumerate() {
            let (free, on) = (self.after[i], node(origin, i));
            let alone = self.is_alone(i);
            let held = walls.act(on, free, Some(self.stopped[k]), alone);
            self.wall.work += walls.drive(on, self.mass[i], free, held.velocity);
            self.take(i, on, &held, (self.mass[i], free), &act.geometry);
            self.after[i] = held.velocity;
        }
        for (i, impulse) in self.damping.iter().enumerate() {
            (self.wall).count(act.geometry.place(node(origin, i)), *impulse);
        }
    }
}
