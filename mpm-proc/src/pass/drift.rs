//! The drift: points move with the field that strains them.
//!
//! A kick `a dt` changes the nodes at once, and points move with the nodes. But the points get the kick through the
//! shape functions and give it back to the nodes through them, so in the next step the nodes have only `P S a dt` of
//! it, with `P = M^-1 S^T m`. So in every step a point moves by `S (1 - P S) a dt^2` more than the grid will have
//! moved, and than USF, MUSL and USAVG strain it, whose velocities have been mapped. If positions kept this, they would be
//! of first order in the step, and a solid that is bent far would tear: places and strains of its points part.
//!
//! So MUSL and USAVG, which map the velocities after the kick anyway, move all points with them. USF moves a point with
//! the nodes, and by what is missing in the next step, when the field is known ([`crate::state::settling`]). The sum of all
//! corrections times the masses is zero, since both velocities carry the momentum of the points.
//!
//! For contact this is a step too late: its overlap depends on the position of a point now. The energy that its spring takes
//! up would differ from the work of its force by `dv_c^T M (1 - P S) dv` in a step, and a single point in a stiff contact,
//! whose kick the nodes do not keep, would be unstable. So with USF the points that bodies press on move with the mapped
//! velocities at once. The power of their contact is then that of the nodes before and after `t_n`, as for stress, and the
//! balance closes to second order (`docs/energy.md`). This needs one more mapping, only of the points that reach the nodes
//! in question.

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

/// Moves the loaded points from where the nodes took them to where the mapped velocities take them. With USF only: elsewhere
/// all points move with mapped velocities.
pub fn move_loaded_points<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
    dt: f64,
) {
    let (clouds, grid) = (&mut continuum.clouds, &continuum.grid);
    let ahead = continuum.settling.ahead;
    let touches = continuum.touches.chunks_exact(W * W);
    for (point, touches) in continuum.loaded.iter().zip(touches) {
        let mut more = [0.0; 2];
        for touch in touches {
            let (tile, node) = touch.at.split();
            let (mapped, kicked) = (
                grid.mapped[tile].velocity[node],
                grid.tiles[tile].after[node],
            );
            for a in 0..2 {
                more[a] += touch.gather * (mapped[a] - kicked[a]);
            }
        }
        // The mapped velocities do not include supports.
        for (a, held) in continuum.holds.along(point.member).into_iter().enumerate() {
            if held {
                more[a] = 0.0;
            }
        }
        let cloud = &mut clouds[point.member.cloud as usize];
        cloud.shift(point.member.local, more, [dt, ahead]);
    }
}

impl<const W: usize, S: Shape<W>, A: AffineState> Cloud<W, S, A> {
    /// Moves a point with `more` (m/s) velocity than it has moved with, over `dt` (s), of which `ahead` (s) is not settled.
    fn shift(&mut self, local: u32, more: [f64; 2], [dt, ahead]: [f64; 2]) {
        let lane = self.lane_of[local as usize] as usize;
        let tile = self.tile_of_lane(lane);
        let (first, blocks, index) = (tile.first, tile.blocks, tile.index);
        let report = &mut self.reports[index];
        report.shifted = report.shifted.max(more[0].hypot(more[1]));
        for a in 0..2 {
            let x = &mut self.state.x[lane / LANES][a].as_mut_array()[lane % LANES];
            *x += more[a] * dt;
            report.lower[a] = report.lower[a].min(*x);
            report.upper[a] = report.upper[a].max(*x);
            let unsettled = &mut self.state.unsettled[lane / LANES][a];
            unsettled.as_mut_array()[lane % LANES] += more[a] * ahead;
        }
        if lane == first * LANES {
            // Lanes without a point move with the first point of their tile.
            let (x, unsettled) = (self.state.x[first], self.state.unsettled[first]);
            let last = first + blocks - 1;
            for k in (0..LANES).filter(|&k| self.state.ids[last][k] == NO_POINT) {
                self.state.x[last].copy_lane(k, &x, 0);
                self.state.unsettled[last].copy_lane(k, &unsettled, 0);
            }
        }
    }
}
