//! Points that leave the domain: through a periodic wall, to enter at the other end, or through an open one, to be
//! removed if the scene says so.
//!
//! Points are moved to the other end when they are next sorted, at most a cell beyond the wall. Until then, nodes
//! beyond the wall are images ([`crate::state::images`]) and carry them. The jump changes the potential of gravity.
//! This is work that gravity does in every round, and it counts as work of driven boundaries.
//!
//! A point is removed at the end of the step in which it left, after the step has been measured. Its momentum counts as
//! an impulse applied from outside, and its energy as work taken out by a boundary. The other points keep their ids.
//! The mass of a group shows how many of its points were removed. If an IMP is removed, the bound of the points' travel
//! becomes infinite, so that a new set is chosen before the set is used again.

use super::sort::sort;
use crate::kernel::lanes::LANES;
use crate::kernel::shape::Shape;
use crate::kernel::transfer::AffineState;
use crate::state::continuum::Continuum;
use crate::state::points::{Cloud, NO_POINT};

/// Removes the points that the step of `dt` (s) has taken out of the domain.
pub fn remove_left<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
    dt: f64,
) {
    if continuum.gone.is_empty() {
        return;
    }
    let (gravity, cell) = (continuum.grid.gravity, continuum.grid.geometry.cell);
    for &(number, lane) in &continuum.gone {
        let cloud = &mut continuum.clouds[number];
        let [x, v] = [cloud.position(lane), cloud.velocity(lane)];
        let elastic = cloud.volume * cloud.energy_of(lane);
        // Its velocity is that of half a step before: half a kick of gravity and of its load is still to come.
        let then = [0, 1].map(|a| x[a] - 0.5 * dt * v[a]);
        let held = cloud.kinetic_of(lane) + elastic
            - cloud.mass * (gravity[0] * then[0] + gravity[1] * then[1]);
        let loads = cloud.loads.as_ref();
        let work = loads.map_or(0.0, |l| l.last_work(lane, then));
        let turning = cloud.angular_momentum_of(lane, cell);
        continuum.state.totals.applied_impulse +=
            [-cloud.mass * v[0], -cloud.mass * v[1], -turning];
        continuum.state.totals.driven_work += work - held;
        continuum.state.totals.stress_work -= elastic;
        let local = cloud.remove(lane);
        let number = number as u32;
        if continuum.imps.has_point(number, local) {
            continuum.imps.state.travel = f64::INFINITY;
        }
    }
    continuum.gone.clear();
    sort(continuum);
}

impl<const W: usize, S: Shape<W>, A: AffineState> Cloud<W, S, A> {
    /// Removes a lane's point; the caller sorts. Returns its id less the cloud's first id.
    fn remove(&mut self, lane: usize) -> u32 {
        let id = &mut self.state.ids[lane / LANES][lane % LANES];
        let local = core::mem::replace(id, NO_POINT);
        self.lane_of[local as usize] = NO_POINT;
        self.removed += 1;
        local
    }
}
