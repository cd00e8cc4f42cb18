//! The continuum: clouds of points over one grid, for one shape function, with or without affine parts. It is only data; the passes
//! work on it.

use interface::config::{Drift, Leaving, Stage, StressUpdate, Transfer as TransferConfig};
use interface::message::wire::PointState;
use interface::solver::{MpmMeasurement, Refusal};
use mechanics::threads::Threads;
use serde::{Deserialize, Serialize};

use super::contact::{Loaded, Touches};
use super::damping::Damping;
use super::grid::Grid;
use super::holds::Holds;
use super::imps::{Imps, ImpsState};
use super::markers::MarkersState;
use super::nodes::NodeTile;
use super::point_set::PointSet;
use super::points::{Cloud, NO_POINT, SavedCloud};
use super::settling::Settling;
use super::totals::{KickWork, Totals};
use super::walls::WallsState;
use crate::kernel::shape::Shape;
use crate::kernel::transfer::{AffineState, Transfer};

/// The whole state of the solver.
pub struct Continuum<const W: usize, S: Shape<W>, A: AffineState> {
    /// One cloud for each group of the configuration.
    pub clouds: Vec<Cloud<W, S, A>>,
    /// The grid.
    pub grid: Grid,
    /// Transfer scheme where a stage does not say.
    pub configured: TransferConfig,
    /// That of the present step.
    pub transfer: Transfer,
    /// The identified material points.
    pub imps: Imps,
    /// The points that bodies press on, or may press on next, in the present step.
    pub loaded: Vec<Loaded>,
    /// The nodes that they touch.
    pub touches: Touches,
    /// What happens to points that leave the domain.
    pub leaving: Leaving,
    /// Lanes whose points have left and are to be removed at the end of the step: cloud and lane, in this order.
    pub gone: Vec<(usize, usize)>,
    /// What a step leaves to the next one, besides the states of the parts.
    pub state: ContinuumState,
    /// Work in the kick of the present step.
    pub kick: KickWork,
    /// The last measurement.
    pub measurement: MpmMeasurement,
    /// When stresses are updated.
    pub stress_update: StressUpdate,
    /// With which velocity points move.
    pub drift: Drift,
    /// What positions take over from the step before, in the present step.
    pub settling: Settling,
    /// Stages of loading, in order of their beginning.
    pub stages: Vec<Stage>,
    /// Damping over the present kick.
    pub damping: Option<Damping>,
    /// Points whose mean motion is recorded.
    pub probes: Vec<PointSet>,
    /// Points that are held.
    pub holds: Holds,
    /// How loops are run.
    pub threads: Threads,
}

/// The state of a continuum besides its points and IMPs, all of which is saved.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct ContinuumState {
    /// Sums over the run.
    pub totals: Totals,
    /// Upper bound of the displacement of any point since points were last sorted, in m.
    pub moved: f64,
    /// Whether the nodes have room for the contact of bodies: a force of zero can change the sign of a zero, so this
    /// matters to the bit.
    pub touched: bool,
}

/// The states of a continuum and of its parts.
#[derive(Serialize, Deserialize)]
pub struct SavedContinuum<A> {
    pub(crate) own: ContinuumState,
    pub(crate) clouds: Vec<SavedCloud<A>>,
    imps: ImpsState,
    markers: Option<MarkersState>,
    walls: WallsState,
}

impl<const W: usize, S: Shape<W>, A: AffineState> Continuum<W, S, A> {
    /// The damping that acts on the points' own velocities: that of a transfer by increments.
    pub fn damping_of_points(&self) -> Option<Damping> {
        self.damping.filter(|_| self.transfer.increment)
    }

    /// Whether points move with the velocities of the nodes after the kick also where these are mapped once more.
    pub fn moves_by_kicked(&self) -> bool {
        self.drift == Drift::Nodal
            || matches!(self.stress_update, StressUpdate::Usf | StressUpdate::Usl)
    }

    /// Whether the velocities of points after the kick are mapped to the nodes within the step. Contact on the grid would
    /// not have acted on what the nodes get.
    pub fn maps_kicked(&self) -> bool {
        match self.stress_update {
            StressUpdate::Usf | StressUpdate::Usl => false,
            StressUpdate::Musl => true,
            StressUpdate::Usavg => self.drift == Drift::Mapped,
        }
    }

    /// Whether what points do not get of what the nodes gain in a kick, and what contact on the grid loses, are terms of the ledger.
    /// Where all of the stress is updated before or after the kick, its work has a part of them with the opposite sign
    /// (docs/energy.md).
    pub fn books_kick(&self) -> bool {
        self.stress_update == StressUpdate::Usavg && !self.maps_kicked()
    }

    /// Whether points near loads move with velocities that are mapped once more for them.
    pub fn maps_near_loads(&self) -> bool {
        let mapped = self.drift == Drift::Mapped && !self.loaded.is_empty();
        mapped && self.stress_update == StressUpdate::Usf
    }

    /// The state before the next step.
    pub fn saved(&self) -> SavedContinuum<A> {
        SavedContinuum {
            own: self.state.clone(),
            clouds: self.clouds.iter().map(Cloud::saved).collect(),
            imps: self.imps.state.clone(),
            markers: self.imps.markers.as_ref().map(|m| m.state.clone()),
            walls: self.grid.walls.state.clone(),
        }
    }

    /// Restores what [`Self::saved`] returned: takes the states, and makes again what follows from them. The continuum
    /// has been configured and has done no step.
    ///
    /// # Errors
    /// A [`Refusal`] if it is not a state of this continuum, which can then not be used any more.
    pub fn take_over(&mut self, saved: SavedContinuum<A>) -> Result<(), Refusal> {
        (self.state, self.imps.state) = (saved.own, saved.imps);
        self.grid.walls.take_over(saved.walls);
        for (cloud, saved) in self.clouds.iter_mut().zip(saved.clouds) {
            cloud.restore(saved, &self.grid.geometry)?;
        }
        if let (Some(markers), Some(saved)) = (&mut self.imps.markers, saved.markers) {
            markers.state = saved;
        }
        self.grid.contact.clear();
        self.grid.cover(&mut self.clouds);
        if self.state.touched {
            self.grid.make_room_for_contact();
        }
        self.imps.write_infos(&self.clouds);
        Ok(())
    }

    /// Adds all points by id; the clouds are groups from `first` on.
    pub fn add_points(&self, first: u32, points: &mut Vec<PointState>) {
        for (group, cloud) in (first..).zip(&self.clouds) {
            for (i, &lane) in cloud.lane_of.iter().enumerate() {
                if lane == NO_POINT {
                    continue;
                }
                let lane = lane as usize;
                let (stress, volume) = cloud.state.stresses.of_lane(lane);
                points.push(PointState {
                    id: cloud.first_id + i as u64,
                    position: self.grid.geometry.entered(cloud.position(lane)),
                    velocity: cloud.velocity(lane),
                    stress,
                    volume: volume * cloud.volume,
                    mass: cloud.mass,
                    group,
                    plastic_strain: cloud.plastic_strain(lane) as f32,
                });
            }
        }
    }

    /// Bytes of memory in use.
    pub fn bytes(&self) -> usize {
        let nodes = size_of::<NodeTile>() * self.grid.tiles.capacity();
        nodes + self.clouds.iter().map(Cloud::bytes).sum::<usize>()
    }

    /// Makes room for the contact of bodies where there are IMPs.
    pub fn make_room_for_contact(&mut self) {
        if !self.imps.infos.is_empty() && !self.state.touched {
            self.state.touched = true;
            self.grid.make_room_for_contact();
        }
    }
}
