//! Points that leave the domain: by a periodic wall, to enter at the other end; or by an open one, to be removed, where a
//! scene says so.
//!
//! Points are put to the other end when they are next sorted, at most a cell beyond the wall: until then nodes beyond it
//! are images ([`crate::state::images`]) and carry them. What gravity would gain or lose by the jump is work that it does in every
//! round, and counts as work of driven boundaries.
//!
//! A point is removed at the end of the step that took it out, after the step has been measured: with it go its momentum,
//! which counts as an impulse applied from outside, and its energy, which counts as work taken out by a boundary. The
//! others keep their identities. How many are gone shows in the mass of their group. If an identified material point
//! goes, the bound of the points' travel becomes infinite, so that the set is chosen anew before it is used again.

use super::sort::sort;
use crate::kernel::lanes::LANES;
use crate::kernel::shape::Shape;
use crate::kernel::transfer::{AffineState, Transfer};
use crate::state::continuum::Continuum;
use crate::state::points::{Cloud, NO_POINT};

/// Removes the points that the step has taken out of the domain.
pub fn remove_left<const W: usize, S: Shape<W>, T: Transfer>(continuum: &mut Continuum<W, S, T>) {
    if continuum.outside.gone.is_empty() {
        return;
    }
    let gravity = continuum.grid.gravity;
    for &(number, lane) in &continuum.outside.gone {
        let cloud = &mut continuum.clouds[number];
        let [x, v] = [cloud.position(lane), cloud.velocity(lane)];
        let elastic = cloud.volume * cloud.material.energy_of(lane);
        let held =
            cloud.kinetic_of(lane) + elastic - cloud.mass * (gravity[0] * x[0] + gravity[1] * x[1]);
        let work = cloud.loads.as_ref().map_or(0.0, |l| l.last_work(lane, x));
        continuum.totals.applied_impulse += v.map(|v| -cloud.mass * v);
        continuum.totals.driven_work += work - held;
        continuum.totals.stress_work -= elastic;
        let local = cloud.remove(lane);
        let number = number as u32;
        if continuum.imps.has_point(number, local) {
            continuum.imps.travel = f64::INFINITY;
        }
    }
    continuum.outside.gone.clear();
    sort(continuum);
}

impl<const W: usize, S: Shape<W>, A: AffineState> Cloud<W, S, A> {
    /// Takes a lane's point away; the caller sorts. Returns its identity less the cloud's first.
    fn remove(&mut self, lane: usize) -> u32 {
        let id = &mut self.ids[lane / LANES][lane % LANES];
        let local = core::mem::replace(id, NO_POINT);
        self.lane_of[local as usize] = NO_POINT;
        self.removed += 1;
        local
    }
}
