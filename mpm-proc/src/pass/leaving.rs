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

use interface::config::Leaving;
use interface::solver::Fault;

use crate::kernel::lanes::LANES;
use crate::kernel::shape::Shape;
use crate::kernel::transfer::{AffineState, Transfer};
use crate::state::continuum::Continuum;
use crate::state::points::{Cloud, LaneCopy, NO_POINT};

/// What happens to points outside.
#[derive(Debug)]
pub struct Outside {
    rule: Leaving,
    /// Lanes to be removed at the end of the step: cloud and lane, in this order.
    gone: Vec<(usize, usize)>,
}

impl Outside {
    /// With this rule.
    pub fn new(rule: Leaving) -> Self {
        Self {
            rule,
            gone: Vec::new(),
        }
    }

    /// A point was found outside.
    ///
    /// # Errors
    /// `fault`, which names it, where points must stay.
    pub fn take(&mut self, cloud: usize, lane: usize, fault: Fault) -> Result<(), Fault> {
        match self.rule {
            Leaving::Stop => Err(fault),
            Leaving::Remove => {
                self.gone.push((cloud, lane));
                Ok(())
            }
        }
    }
}

impl<const W: usize, S: Shape<W>, T: Transfer> Continuum<W, S, T>
where
    T::Affine: LaneCopy,
{
    /// Puts points that have crossed a periodic wall to the other end; the caller sorts.
    pub fn enter_again(&mut self) {
        let geometry = self.grid.geometry;
        if geometry.periodic == [false; 2] {
            return;
        }
        let gravity = self.grid.gravity;
        let mut crossed = false;
        for cloud in &mut self.clouds {
            for lane in 0..cloud.ids.len() * LANES {
                let x = cloud.position(lane);
                let entered = geometry.entered(x);
                if entered == x {
                    continue;
                }
                cloud.place(lane, entered);
                if cloud.ids[lane / LANES][lane % LANES] != NO_POINT {
                    crossed = true;
                    for a in 0..2 {
                        self.books.driven_work -= cloud.mass * gravity[a] * (entered[a] - x[a]);
                    }
                }
            }
        }
        if crossed {
            // Near other bodies now: the identified material points are chosen anew before they are used again.
            self.imps.travel = f64::INFINITY;
        }
    }

    /// Removes the points that the step has taken out of the domain.
    pub fn remove_left(&mut self) {
        if self.outside.gone.is_empty() {
            return;
        }
        let gravity = self.grid.gravity;
        for &(number, lane) in &self.outside.gone {
            let cloud = &mut self.clouds[number];
            let [x, v] = [cloud.position(lane), cloud.velocity(lane)];
            let elastic = cloud.volume * cloud.material.energy_of(lane);
            let held = cloud.kinetic_of(lane) + elastic
                - cloud.mass * (gravity[0] * x[0] + gravity[1] * x[1]);
            let work = cloud.loads.as_ref().map_or(0.0, |l| l.last_work(lane, x));
            self.books.applied_impulse += v.map(|v| -cloud.mass * v);
            self.books.driven_work += work - held;
            self.books.stress_work -= elastic;
            let local = cloud.remove(lane);
            let number = number as u32;
            let is_imp = |m: &crate::state::imps::Member| m.cloud == number && m.local == local;
            if self.imps.members.iter().any(is_imp) {
                self.imps.travel = f64::INFINITY;
            }
        }
        self.outside.gone.clear();
        self.sort();
    }
}

impl<const W: usize, S: Shape<W>, A: AffineState + LaneCopy> Cloud<W, S, A> {
    /// Moves a lane's point to `x` (m).
    fn place(&mut self, lane: usize, x: [f64; 2]) {
        for a in 0..2 {
            self.x[lane / LANES][a].as_mut_array()[lane % LANES] = x[a];
        }
    }

    /// Takes a lane's point away; the caller sorts. Returns its identity less the cloud's first.
    fn remove(&mut self, lane: usize) -> u32 {
        let id = &mut self.ids[lane / LANES][lane % LANES];
        let local = core::mem::replace(id, NO_POINT);
        self.lane_of[local as usize] = NO_POINT;
        self.removed += 1;
        local
    }

    /// Kinetic energy of a lane's point in J/m, with that of its affine part.
    fn kinetic_of(&self, lane: usize) -> f64 {
        let square = |v: [f64; 2]| v[0] * v[0] + v[1] * v[1];
        let mut twice = square(self.velocity(lane));
        if A::PRESENT {
            let slopes = self.motion[lane / LANES].affine.slopes();
            let of_lane =
                |s: [crate::kernel::lanes::Lanes; 2]| s.map(|s| s.as_array()[lane % LANES]);
            let affine: f64 = slopes.iter().map(|s| square(of_lane(*s))).sum();
            twice += affine / S::INVERSE_INERTIA.unwrap_or(1.0);
        }
        0.5 * self.mass * twice
    }
}
