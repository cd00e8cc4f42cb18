//! A configured solver: one trait for all shape functions and transfers.

use interface::message::wire::{EnvelopeVertex, ImpForce, ImpInfo, ImpState, Limits, PointState};
use interface::saved::ConfigurationMark;
use interface::solver::{Fault, MpmMeasurement, Refusal};
use interface::step::Step;

use crate::kernel::shape::Shape;
use crate::kernel::transfer::AffineState;
use crate::pass::select_imps::select_imps;
use crate::pass::select_markers::select_markers;
use crate::state::continuum::Continuum;
use crate::state::nodes::NodeTile;
use crate::state::points::{Cloud, NO_POINT};
use crate::state::saved::FORMAT;
use crate::step;

/// The functions of a continuum that the solver needs, for any shape function and transfer.
pub trait Scheme: Send {
    /// The part of a step that needs no contact force.
    fn predict(&mut self, step: &Step) -> Result<(), Fault>;

    /// The rest of the step, with the forces on the IMPs.
    fn correct(&mut self, step: &Step, forces: &[ImpForce]) -> Result<Limits, Fault>;

    /// Chooses the IMPs anew.
    fn select_imps(&mut self, envelopes: &[EnvelopeVertex]) -> &[ImpInfo];

    /// Largest displacement since the last selection in m.
    fn travel(&self) -> f64;

    /// States of the IMPs.
    fn imp_states(&mut self) -> &[ImpState];

    /// The last measurement.
    fn measurement(&self) -> &MpmMeasurement;

    /// All points by id.
    fn points(&self) -> Vec<PointState>;

    /// Bytes of memory in use.
    fn bytes(&self) -> usize;

    /// The state before the next step, with the mark of the configuration.
    fn save(&self, mark: &ConfigurationMark) -> Vec<u8>;

    /// Restores what [`Self::save`] returned.
    ///
    /// # Errors
    /// A [`Refusal`] if the bytes are not a state of this configuration; the scheme can then not be used any more.
    fn restore(&mut self, mark: &ConfigurationMark, saved: &[u8]) -> Result<(), Refusal>;
}

impl<const W: usize, S: Shape<W>, A: AffineState> Scheme for Continuum<W, S, A> {
    fn predict(&mut self, step: &Step) -> Result<(), Fault> {
        step::predict(self, step)
    }

    fn correct(&mut self, step: &Step, forces: &[ImpForce]) -> Result<Limits, Fault> {
        step::correct(self, step, forces)
    }

    fn select_imps(&mut self, envelopes: &[EnvelopeVertex]) -> &[ImpInfo] {
        if self.imps.markers.is_some() {
            select_markers(&mut self.imps, envelopes);
            self.imps.write_infos(&self.clouds);
        } else {
            select_imps(&mut self.imps, &self.clouds, envelopes);
        }
        self.make_room_for_contact();
        &self.imps.infos
    }

    fn travel(&self) -> f64 {
        self.imps.state.travel
    }

    fn imp_states(&mut self) -> &[ImpState] {
        self.imps.refresh(&self.clouds);
        &self.imps.states
    }

    fn measurement(&self) -> &MpmMeasurement {
        &self.measurement
    }

    fn points(&self) -> Vec<PointState> {
        let mut points = Vec::new();
        for (group, cloud) in self.clouds.iter().enumerate() {
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
                    group: group as u32,
                    plastic_strain: cloud.plastic_strain(lane) as f32,
                });
            }
        }
        points
    }

    fn bytes(&self) -> usize {
        let nodes = size_of::<NodeTile>() * self.grid.tiles.capacity();
        nodes + self.clouds.iter().map(Cloud::bytes).sum::<usize>()
    }

    fn save(&self, mark: &ConfigurationMark) -> Vec<u8> {
        mark.seal(FORMAT, &self.saved())
    }

    fn restore(&mut self, mark: &ConfigurationMark, saved: &[u8]) -> Result<(), Refusal> {
        self.take_over(mark.open(FORMAT, saved)?)
    }
}
