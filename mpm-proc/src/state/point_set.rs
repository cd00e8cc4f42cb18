//! Sets of points of one group that are in a region at the start: those of probes and of holds.

use interface::message::wire::GroupState;

use super::points::{Cloud, NO_POINT};
use crate::kernel::shape::Shape;
use crate::kernel::transfer::AffineState;

/// Points of a cloud that were in a region at the start.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PointSet {
    /// Which of the scene's probes, or holds.
    pub number: usize,
    /// Number of the cloud.
    pub cloud: u32,
    /// Identities less the cloud's first, ascending; one or more.
    pub locals: Vec<u32>,
}

impl PointSet {
    /// Whether a point of a cloud is among them.
    pub fn has(&self, cloud: u32, local: u32) -> bool {
        self.cloud == cloud && self.locals.binary_search(&local).is_ok()
    }

    /// The lanes of its points that have not been removed.
    pub fn lanes<'a, const W: usize, S: Shape<W>, A: AffineState>(
        &'a self,
        cloud: &'a Cloud<W, S, A>,
    ) -> impl Iterator<Item = usize> + Clone + 'a {
        let lane = |&local: &u32| cloud.lane_of[local as usize];
        let lanes = self.locals.iter().map(lane);
        lanes.filter(|&lane| lane != NO_POINT).map(|l| l as usize)
    }

    /// Its mass, centre of mass and extent at the present positions; zeros if all its points have been removed.
    pub fn extent<const W: usize, S: Shape<W>, A: AffineState>(
        &self,
        cloud: &Cloud<W, S, A>,
    ) -> GroupState {
        let mut state = GroupState::default();
        let (mut count, mut sum) = (0_u32, [0.0; 2]);
        for lane in self.lanes(cloud) {
            let x = cloud.position(lane);
            if count == 0 {
                (state.lower, state.upper) = (x, x);
            }
            count += 1;
            for a in 0..2 {
                sum[a] += x[a];
                state.lower[a] = state.lower[a].min(x[a]);
                state.upper[a] = state.upper[a].max(x[a]);
            }
        }
        state.mass = cloud.mass * f64::from(count);
        state.position = sum.map(|x| x / f64::from(count.max(1)));
        state
    }

    /// Mean velocity in m/s and kinetic energy in J/m of its points.
    pub fn motion<const W: usize, S: Shape<W>, A: AffineState>(
        &self,
        cloud: &Cloud<W, S, A>,
    ) -> ([f64; 2], f64) {
        let (mut count, mut velocity, mut kinetic) = (0_u32, [0.0; 2], 0.0);
        for lane in self.lanes(cloud) {
            count += 1;
            let v = cloud.velocity(lane);
            velocity = [velocity[0] + v[0], velocity[1] + v[1]];
            kinetic += cloud.kinetic_of(lane);
        }
        (velocity.map(|v| v / f64::from(count.max(1))), kinetic)
    }
}
