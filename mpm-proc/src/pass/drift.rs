//! The drift of points that bodies press on.
//!
//! A kick `a dt` changes the nodes at once, and points move with the nodes. But the points get the kick through the
//! shape functions and give it back to the nodes through them, so in the next step the nodes have only `P S a dt` of
//! it, with `P = M^-1 S^T m`. So in every step a point moves by `S (1 - P S) a dt^2` more than the grid will have
//! moved. This does not affect strains, since USF and MUSL compute them from velocities that have been mapped. It does
//! affect contact, whose overlap depends on the position of a point. The energy that its spring takes up then differs
//! from the work of its force by `dv_c^T M (1 - P S) dv` in a step. Over a run this is of first order, and it can have
//! either sign.
//!
//! So a point on which a body presses moves with `sum_I S_Ip v~_I`, where `v~ = P v_p^{n+1/2}` is what the nodes will
//! have of the points' new velocities. The power of its contact is then that of the nodes before and after `t_n`, as
//! for stress, and the balance closes to second order (`docs/energy.md`). Other points may move with the nodes as
//! usual, because no force depends on their error.
//!
//! This needs one more mapping, only of the points that reach the nodes in question.

use interface::config::StressUpdate;

use crate::kernel::blocks::LaneCopy;
use crate::kernel::lanes::LANES;
use crate::kernel::shape::Shape;
use crate::kernel::transfer::AffineState;
use crate::state::continuum::Continuum;
use crate::state::points::{Cloud, NO_POINT};

/// Finds the nodes that loaded points touch, and the points that determine the velocities of these nodes.
pub fn find_near_loads<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
) {
    if continuum.grid.mapped.is_empty() {
        continuum.grid.make_room_for_mapped();
    }
    for tile in &mut continuum.grid.mapped {
        tile.wanted = 0;
    }
    for cloud in &mut continuum.clouds {
        for tile in &mut cloud.tiles {
            tile.near_load = false;
        }
    }
    for touch in &continuum.touches {
        let (tile, node) = touch.at.split();
        continuum.grid.mapped[tile].wanted |= 1 << node;
    }
    let clouds = &mut continuum.clouds;
    continuum.grid.points_behind::<W>(|cloud, tile| {
        clouds[cloud].tiles[tile].near_load = true;
    });
}

/// Moves the loaded points from where the nodes took them to where the mapped velocities take them.
pub fn move_loaded_points<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
    dt: f64,
) {
    let (clouds, grid) = (&mut continuum.clouds, &continuum.grid);
    let mapped = |tile: usize, node: usize| match continuum.stress_update {
        StressUpdate::Usf => grid.mapped[tile].velocity[node],
        StressUpdate::Usl | StressUpdate::Musl | StressUpdate::Usavg => {
            grid.tiles[tile].before[node]
        }
    };
    let touches = continuum.touches.chunks_exact(W * W);
    for (point, touches) in continuum.loaded.iter().zip(touches) {
        let (mut velocity, mut more) = ([0.0; 2], [0.0; 2]);
        for touch in touches {
            let (tile, node) = touch.at.split();
            let (mapped, kicked) = (mapped(tile, node), grid.tiles[tile].after[node]);
            for a in 0..2 {
                velocity[a] += touch.gather * mapped[a];
                more[a] += touch.gather * (mapped[a] - kicked[a]);
            }
        }
        // The mapped velocities do not include supports.
        for (a, held) in continuum.holds.along(point.member).into_iter().enumerate() {
            if held {
                (velocity[a], more[a]) = (0.0, 0.0);
            }
        }
        let cloud = &mut clouds[point.member.cloud as usize];
        cloud.shift(point.member.local, more.map(|v| v * dt), velocity);
    }
}

impl<const W: usize, S: Shape<W>, A: AffineState> Cloud<W, S, A> {
    /// Moves a point by `by` (m), which makes its velocity (m/s) in this step that given.
    fn shift(&mut self, local: u32, by: [f64; 2], velocity: [f64; 2]) {
        let lane = self.lane_of[local as usize] as usize;
        let tile = self.tile_of_lane(lane);
        let (first, blocks, index) = (tile.first, tile.blocks, tile.index);
        let report = &mut self.reports[index];
        report.speed_sq = report
            .speed_sq
            .max(velocity[0] * velocity[0] + velocity[1] * velocity[1]);
        for a in 0..2 {
            let x = &mut self.state.x[lane / LANES][a].as_mut_array()[lane % LANES];
            *x += by[a];
            report.lower[a] = report.lower[a].min(*x);
            report.upper[a] = report.upper[a].max(*x);
        }
        if lane == first * LANES {
            // Lanes without a point move with the first point of their tile.
            let (leader, last) = (self.state.x[first], first + blocks - 1);
            for k in (0..LANES).filter(|&k| self.state.ids[last][k] == NO_POINT) {
                self.state.x[last].copy_lane(k, &leader, 0);
            }
        }
    }
}
