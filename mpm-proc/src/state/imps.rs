//! The identified material points (IMPs): those near the bodies (Jiang 2020 section 4).

use interface::message::wire::{ImpForce, ImpInfo, ImpState};
use interface::solver::Refusal;
use serde::{Deserialize, Serialize};

use super::markers::{Markers, SavedMarkers};
use super::points::{Cloud, NO_POINT};
use super::saved::refusal;
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
    /// Which points, ordered by id.
    pub members: Vec<Member>,
    /// The same points, as sent to the bodies' side.
    pub infos: Vec<ImpInfo>,
    /// Their states, as of the last [`Self::refresh`].
    pub states: Vec<ImpState>,
    /// The forces of the present step; empty where there are no bodies.
    pub forces: Vec<ImpForce>,
    /// Upper bound of the displacement of any point since the last selection in m.
    pub travel: f64,
    /// Verlet skin `V_d` in m.
    pub skin: f64,
    /// The markers of the boundary, where bodies meet the segments between them: all members are markers then.
    pub markers: Option<Markers>,
}

/// The saved part of the IMPs.
#[derive(Debug, Serialize, Deserialize)]
pub struct SavedImps {
    members: Vec<Member>,
    travel: f64,
    markers: Option<SavedMarkers>,
}

impl Imps {
    /// The points, and how far points have moved since they were chosen.
    pub fn save(&self) -> SavedImps {
        let Self {
            members,
            infos: _,  // of the members
            states: _, // read from the points whenever they are asked for
            forces: _, // of one step
            travel,
            skin: _, // of the configuration
            markers,
        } = self;
        SavedImps {
            members: members.clone(),
            travel: *travel,
            markers: markers.as_ref().map(Markers::save),
        }
    }

    /// Restores what [`Self::save`] returned.
    ///
    /// # Errors
    /// A [`Refusal`] if members are not points of `clouds`, or not in order.
    pub fn restore<const W: usize, S: Shape<W>, A: AffineState>(
        &mut self,
        saved: SavedImps,
        clouds: &[Cloud<W, S, A>],
    ) -> Result<(), Refusal> {
        let SavedImps {
            members,
            travel,
            markers,
        } = saved;
        // NaN would never request another set.
        if travel.is_nan() || travel < 0.0 {
            return Err(refusal(format!("points have travelled by {travel} m")));
        }
        match (&mut self.markers, markers) {
            (Some(own), Some(saved)) => own.restore(saved)?,
            (None, None) => {}
            _ => {
                return Err(refusal(
                    "markers are in only one of state and configuration",
                ));
            }
        }
        for m in &members {
            if let Some(markers) = &self.markers {
                let known = (m.local as usize) < markers.x.len();
                if !known || markers.chain(m.local as usize).cloud != m.cloud {
                    let text = format!("the set has marker {}", m.local);
                    return Err(refusal(format!("{text}, which there is not")));
                }
                continue;
            }
            let cloud = clouds.get(m.cloud as usize);
            let lane = cloud.and_then(|c| c.lane_of.get(m.local as usize));
            // A removed point stays in the set until the next selection, which an infinite travel requests.
            if lane.is_none_or(|l| *l == NO_POINT && travel.is_finite()) {
                let text = format!("the set has point {} of group {}", m.local, m.cloud);
                return Err(refusal(format!("{text}, which there is not")));
            }
        }
        if !members.is_sorted_by(|a, b| a < b) {
            return Err(refusal("the set is not ordered by id"));
        }
        (self.members, self.travel) = (members, travel);
        self.write_infos(clouds);
        self.states.clear();
        self.forces.clear();
        Ok(())
    }

    /// Adds points of the first cloud to a set that [`Self::close`] ends.
    pub fn add(&mut self, locals: &[u32]) {
        let member = |&local: &u32| Member { cloud: 0, local };
        self.members.extend(locals.iter().map(member));
    }

    /// Ends a set to which points have been added: each once, by id.
    pub fn close<const W: usize, S: Shape<W>, A: AffineState>(
        &mut self,
        clouds: &[Cloud<W, S, A>],
    ) {
        // Ids rise with the cloud and within it.
        self.members.sort_unstable();
        self.members.dedup();
        self.write_infos(clouds);
    }

    /// Fills in [`Self::infos`] from the members.
    pub fn write_infos<const W: usize, S: Shape<W>, A: AffineState>(
        &mut self,
        clouds: &[Cloud<W, S, A>],
    ) {
        self.infos.clear();
        if let Some(markers) = &self.markers {
            let members: Vec<usize> = self.members.iter().map(|m| m.local as usize).collect();
            self.infos.extend(markers.infos(&members));
            return;
        }
        self.infos.extend(self.members.iter().map(|m| {
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

    /// Reads the states of the IMPs.
    pub fn refresh<const W: usize, S: Shape<W>, A: AffineState>(
        &mut self,
        clouds: &[Cloud<W, S, A>],
    ) {
        self.states.clear();
        if let Some(markers) = &self.markers {
            let members = self.members.iter();
            self.states
                .extend(members.map(|m| markers.state(m.local as usize)));
            return;
        }
        self.states.extend(self.members.iter().map(|m| {
            let cloud = &clouds[m.cloud as usize];
            let lane = cloud.lane_of[m.local as usize] as usize;
            ImpState {
                position: cloud.position(lane),
                velocity: cloud.velocity(lane),
            }
        }));
    }

    /// Position in m of a member that is there.
    pub fn position<const W: usize, S: Shape<W>, A: AffineState>(
        &self,
        member: Member,
        clouds: &[Cloud<W, S, A>],
    ) -> [f64; 2] {
        if let Some(markers) = &self.markers {
            return markers.x[member.local as usize];
        }
        let cloud = &clouds[member.cloud as usize];
        cloud.position(cloud.lane_of[member.local as usize] as usize)
    }

    /// Velocity in m/s of a member that is there.
    pub fn velocity<const W: usize, S: Shape<W>, A: AffineState>(
        &self,
        member: Member,
        clouds: &[Cloud<W, S, A>],
    ) -> [f64; 2] {
        if let Some(markers) = &self.markers {
            return markers.v[member.local as usize];
        }
        let cloud = &clouds[member.cloud as usize];
        cloud.velocity(cloud.lane_of[member.local as usize] as usize)
    }

    /// Whether a point of a cloud is a member.
    pub fn has_point(&self, cloud: u32, local: u32) -> bool {
        self.markers.is_none() && self.members.contains(&Member { cloud, local })
    }
}
