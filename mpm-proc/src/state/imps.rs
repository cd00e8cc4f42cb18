//! The identified material points (IMPs): those near the bodies (Jiang 2020 section 4).

use interface::message::wire::{ImpForce, ImpInfo, ImpState};
use serde::{Deserialize, Serialize};

use super::markers::Markers;
use super::points::Cloud;
use crate::kernel::shape::Shape;
use crate::kernel::transfer::AffineState;

/// One IMP: a point of a cloud, or a marker.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Member {
    /// Number of the cloud.
    pub cloud: u32,
    /// Identity less the cloud's first; of a marker its number.
    pub local: u32,
}

/// The IMPs, slot by slot, ordered by id.
#[derive(Debug, Default)]
pub struct Imps {
    /// Which points, and how far points have moved since.
    pub state: ImpsState,
    /// The same points, as sent to the bodies' side.
    pub infos: Vec<ImpInfo>,
    /// The forces of the present step; empty where there are no bodies.
    pub forces: Vec<ImpForce>,
    /// Verlet skin `V_d` in m.
    pub skin: f64,
    /// The markers of the boundary, where bodies meet the segments between them: all members are markers then.
    pub markers: Option<Markers>,
}

/// The state of a set of IMPs, all of which is saved.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct ImpsState {
    /// Which points, ordered by id.
    pub members: Vec<Member>,
    /// Upper bound of the displacement of any point since the last selection in m.
    pub travel: f64,
    /// Spin in rad/s of the field that moved them, of members with friction, in their order.
    pub spins: Vec<(Member, f64)>,
}

impl Imps {
    /// Adds points of the first cloud; each is in the set once.
    pub fn add<const W: usize, S: Shape<W>, A: AffineState>(
        &mut self,
        locals: &[u32],
        clouds: &[Cloud<W, S, A>],
    ) {
        let member = |&local: &u32| Member { cloud: 0, local };
        self.state.members.extend(locals.iter().map(member));
        // Ids rise with the cloud and within it.
        self.state.members.sort_unstable();
        self.state.members.dedup();
        self.write_infos(clouds);
    }

    /// Fills in [`Self::infos`] from the members.
    pub fn write_infos<const W: usize, S: Shape<W>, A: AffineState>(
        &mut self,
        clouds: &[Cloud<W, S, A>],
    ) {
        self.infos.clear();
        if let Some(markers) = &self.markers {
            let members: Vec<usize> = self
                .state
                .members
                .iter()
                .map(|m| m.local as usize)
                .collect();
            self.infos.extend(markers.infos(&members));
            return;
        }
        self.infos.extend(self.state.members.iter().map(|m| {
            let cloud = &clouds[m.cloud as usize];
            ImpInfo {
                id: cloud.first_id + u64::from(m.local),
                radius: cloud.radius,
                mass: cloud.mass,
                group: m.cloud,
                next: 0,
            }
        }));
    }

    /// Adds the states of the IMPs to a list.
    pub fn add_states<const W: usize, S: Shape<W>, A: AffineState>(
        &self,
        clouds: &[Cloud<W, S, A>],
        states: &mut Vec<ImpState>,
    ) {
        let mut spins = self.state.spins.iter().peekable();
        let mut state = |m: &Member, [position, velocity]: [[f64; 2]; 2]| {
            while spins.next_if(|(of, _)| of < m).is_some() {}
            ImpState {
                position,
                velocity,
                spin: spins.next_if(|(of, _)| of == m).map_or(0.0, |s| s.1),
            }
        };
        let members = self.state.members.iter();
        // The kind of all members is looked up once: this runs over all of them in every step.
        if let Some(markers) = &self.markers {
            states.extend(members.map(|m| state(m, markers.motion(m.local))));
        } else {
            states.extend(members.map(|m| state(m, of_point(*m, clouds))));
        }
    }

    /// Position in m of a member that is there.
    #[inline(always)]
    pub fn position<const W: usize, S: Shape<W>, A: AffineState>(
        &self,
        member: Member,
        clouds: &[Cloud<W, S, A>],
    ) -> [f64; 2] {
        self.motion(member, clouds)[0]
    }

    /// Velocity in m/s of a member that is there.
    #[inline(always)]
    pub fn velocity<const W: usize, S: Shape<W>, A: AffineState>(
        &self,
        member: Member,
        clouds: &[Cloud<W, S, A>],
    ) -> [f64; 2] {
        self.motion(member, clouds)[1]
    }

    #[inline(always)]
    fn motion<const W: usize, S: Shape<W>, A: AffineState>(
        &self,
        member: Member,
        clouds: &[Cloud<W, S, A>],
    ) -> [[f64; 2]; 2] {
        match &self.markers {
            Some(markers) => markers.motion(member.local),
            None => of_point(member, clouds),
        }
    }

    /// Whether a point of a cloud is a member.
    pub fn has_point(&self, cloud: u32, local: u32) -> bool {
        self.markers.is_none() && self.state.members.contains(&Member { cloud, local })
    }
}

/// Position in m and velocity in m/s of a member that is a point.
#[inline(always)]
fn of_point<const W: usize, S: Shape<W>, A: AffineState>(
    member: Member,
    clouds: &[Cloud<W, S, A>],
) -> [[f64; 2]; 2] {
    let cloud = &clouds[member.cloud as usize];
    let lane = cloud.lane_of[member.local as usize] as usize;
    [cloud.position(lane), cloud.velocity(lane)]
}
