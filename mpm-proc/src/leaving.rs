//! Points that leave the domain and are removed, where a scene says so.
//!
//! A point is removed at the end of the step that took it out, after the step has been measured: with it go its momentum,
//! which counts as an impulse applied from outside, and its energy, which counts as work taken out by a boundary. The
//! others keep their identities. How many are gone shows in the mass of their group. If an identified material point
//! goes, the bound of the points' travel becomes infinite, so that the set is chosen anew before it is used again.

use interface::config::Leaving;
use interface::solver::Fault;

use crate::continuum::Continuum;
use crate::lanes::LANES;
use crate::points::{Cloud, LaneCopy, NO_POINT};
use crate::shape::Shape;
use crate::transfer::{AffineState, Transfer};

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
    /// Removes the points that the step has taken out of the domain.
    pub fn remove_left(&mut self) {
        if self.outside.gone.is_empty() {
            return;
        }
        let gravity = self.grid.gravity;
        for &(number, lane) in &self.outside.gone {
            let cloud = &mut self.clouds[number];
            let [x, v] = [cloud.position(lane), cloud.velocity(lane)];
            let held = cloud.kinetic_of(lane) + cloud.volume * cloud.material.energy_of(lane)
                - cloud.mass * (gravity[0] * x[0] + gravity[1] * x[1]);
            let work = cloud.loads.as_ref().map_or(0.0, |l| l.last_work(lane, x));
            self.books.applied_impulse += v.map(|v| -cloud.mass * v);
            self.books.driven_work += work - held;
            let local = cloud.remove(lane);
            let number = number as u32;
            let is_imp = |m: &crate::imps::Member| m.cloud == number && m.local == local;
            if self.imps.members.iter().any(is_imp) {
                self.imps.travel = f64::INFINITY;
            }
        }
        self.outside.gone.clear();
        self.sort();
    }
}

impl<const W: usize, S: Shape<W>, A: AffineState + LaneCopy> Cloud<W, S, A> {
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
            let of_lane = |s: [crate::lanes::Lanes; 2]| s.map(|s| s.as_array()[lane % LANES]);
            let affine: f64 = slopes.iter().map(|s| square(of_lane(*s))).sum();
            twice += affine / S::INVERSE_INERTIA.unwrap_or(1.0);
        }
        0.5 * self.mass * twice
    }
}
