//! The material of a cloud: stress, volume and state of its points, behind one trait for all models.

use interface::saved::{pack, unpack};
use interface::solver::Refusal;
use mechanics::threads::Threads;
use serde::{Deserialize, Serialize};

use super::nodes::NodeTile;
use super::saved::Bytes;
use super::volumes::VolumeNodes;
use crate::kernel::blocks::{LaneCopy, Sources, reorder};
use crate::kernel::lanes::{LANES, Lanes, largest, splat, sum};
use crate::kernel::point_tile::Tile;
use crate::kernel::shape::Shape;
use crate::kernel::window::VectorWindow;
use crate::material::{Material, Point, Stress};

/// A velocity of the nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Velocity {
    /// `v_I^{n-1/2}`.
    Before,
    /// `v_I^{n+1/2}`.
    After,
}

/// The end of the strained interval to which the positions of the points belong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PositionsAt {
    /// Its start.
    Start,
    /// Its end.
    End,
}

/// What the stress pass reports of a tile.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub struct StressReport {
    /// Largest stiffness over density of its points in m^2/s^2; it bounds the next step.
    pub stiffness: f64,
    /// Work per initial volume lost to plastic flow and to viscous stress in this step, summed over points, in Pa.
    pub lost: [f64; 2],
    /// Work per initial volume of the stress in this step, summed over points, in Pa.
    pub work: f64,
}

/// What the stress pass reads and writes, except the points of the material.
pub struct StressPass<'a, const W: usize, S: Shape<W>> {
    /// How loops are run.
    pub threads: &'a Threads,
    /// Shape function of the cloud.
    pub shape: S,
    /// Interval in s.
    pub dt: f64,
    /// `1/L` in 1/m.
    pub per_cell: f64,
    /// Initial volume of a point in m^2.
    pub volume: f64,
    /// Tiles of the cloud.
    pub tiles: &'a [Tile],
    /// `x_p^n` in m.
    pub x: &'a [[Lanes; 2]],
    /// Node tiles.
    pub nodes: &'a [NodeTile],
    /// Volumes at the nodes, where the material asks for them, and the shares of them ([`crate::pass::volumes`]).
    pub volumes: Option<(&'a [VolumeNodes], [f64; 2])>,
    /// Which velocities of the nodes strain the points.
    pub velocity: Velocity,
    /// To which end of the interval `x_p` belongs.
    pub positions_at: PositionsAt,
    /// Whether the stress is updated over `dt`.
    pub strain: bool,
    /// Whether internal forces are summed.
    pub load: bool,
    /// `f_I^int` of each tile's window in N/m.
    pub force: &'a mut [VectorWindow],
    /// Report of each tile.
    pub reports: &'a mut [StressReport],
}

/// The stress pass of a cloud. The pass itself implements it for every model, so that the data need not know the pass.
pub trait UpdateStress<const W: usize, S: Shape<W>> {
    /// Updates the stress of all points to `t_n` and sums their internal forces (eqs. 13, 21 to 25).
    fn update(&mut self, pass: StressPass<'_, W, S>);
}

/// The material of a cloud's points, whatever the model: called once in a pass, never within a loop over points.
pub trait Constitutive<const W: usize, S: Shape<W>>: UpdateStress<W, S> + Send + Sync {
    /// Elastic energy per initial volume of a lane's point in Pa.
    fn energy_of(&self, lane: usize) -> f64;

    /// Elastic energy in J/m of the points of `tile`, each of initial volume `volume` (m^2).
    fn elastic_energy(&self, tile: &Tile, volume: f64) -> f64;

    /// Moves the data of points to their new places.
    fn reorder(&mut self, sources: &Sources);

    /// Largest wave speed of the undeformed material in m/s.
    fn sound_speed(&self) -> f64;

    /// Gives one lane an initial stress `xx, yy, zz, xy` in Pa.
    ///
    /// # Errors
    /// Why the model cannot have it.
    fn prestress(&mut self, lane: usize, stress: [f64; 4]) -> Result<(), String>;

    /// Stress `xx, yy, zz, xy` (Pa) of a lane's point, and its volume over the initial one.
    fn strained(&self, lane: usize) -> ([f64; 4], f64);

    /// `plastic_strain` of the model, of a lane's point.
    fn plastic_strain(&self, lane: usize) -> f64;

    /// Whether a point's volume has become zero or negative.
    fn collapsed(&self, lane: usize) -> bool;

    /// `viscosity_over_density` of the model in m^2/s.
    fn viscosity_over_density(&self) -> f64;

    /// `stiffness_over_density` of the undeformed material in m^2/s^2.
    fn initial_stiffness(&self) -> f64;

    /// `volume_rate` of the model in 1/s.
    fn volume_rate(&self) -> f64;

    /// Volumes over the initial ones of the points of a block.
    fn volumes(&self, block: usize) -> Lanes;

    /// Bytes of memory in use.
    fn bytes(&self) -> usize;

    /// [`MaterialPoints::points`].
    fn save(&self) -> Bytes;

    /// Restores what [`Self::save`] returned.
    ///
    /// # Errors
    /// A [`Refusal`] of bytes that are not that.
    fn restore(&mut self, saved: &Bytes) -> Result<(), Refusal>;
}

/// A model, and stress, volume and state of the points of a cloud.
pub struct MaterialPoints<M: Material> {
    /// The model.
    pub model: M,
    /// Its points, block by block: the whole state.
    pub points: Vec<Point<M::State>>,
    scratch: Vec<Point<M::State>>,
}

impl<M: Material> MaterialPoints<M> {
    /// `blocks` blocks of unstressed points.
    pub fn new(model: M, blocks: usize) -> Self {
        Self {
            model,
            points: vec![model.initial(); blocks],
            scratch: Vec::new(),
        }
    }
}

impl<const W: usize, S: Shape<W>, M: Material> Constitutive<W, S> for MaterialPoints<M> {
    fn elastic_energy(&self, tile: &Tile, volume: f64) -> f64 {
        (0..tile.blocks)
            .map(|b| {
                let energy = self.model.elastic_energy(&self.points[tile.first + b]);
                sum(energy * tile.live(b))
            })
            .sum::<f64>()
            * volume
    }

    fn energy_of(&self, lane: usize) -> f64 {
        let energy = self.model.elastic_energy(&self.points[lane / LANES]);
        energy.as_array()[lane % LANES]
    }

    fn reorder(&mut self, sources: &Sources) {
        reorder(&mut self.points, &mut self.scratch, sources);
    }

    fn sound_speed(&self) -> f64 {
        self.model.sound_speed()
    }

    fn prestress(&mut self, lane: usize, stress: [f64; 4]) -> Result<(), String> {
        let [xx, yy, zz, xy] = stress.map(splat);
        let point = self.model.prestressed(Stress { xx, yy, zz, xy })?;
        self.points[lane / LANES].copy_lane(lane % LANES, &point, 0);
        Ok(())
    }

    fn strained(&self, lane: usize) -> ([f64; 4], f64) {
        let Point { stress, volume, .. } = &self.points[lane / LANES];
        let of = |lanes: &Lanes| lanes.as_array()[lane % LANES];
        let Stress { xx, yy, zz, xy } = stress;
        ([xx, yy, zz, xy].map(of), of(volume))
    }

    fn plastic_strain(&self, lane: usize) -> f64 {
        let strain = self.model.plastic_strain(&self.points[lane / LANES]);
        strain.as_array()[lane % LANES]
    }

    fn collapsed(&self, lane: usize) -> bool {
        let (_, volume) = Constitutive::<W, S>::strained(self, lane);
        volume.is_nan() || volume <= 0.0
    }

    fn viscosity_over_density(&self) -> f64 {
        self.model.viscosity_over_density()
    }

    fn initial_stiffness(&self) -> f64 {
        largest(self.model.stiffness_over_density(&self.model.initial()))
    }

    fn volume_rate(&self) -> f64 {
        self.model.volume_rate()
    }

    fn volumes(&self, block: usize) -> Lanes {
        self.points[block].volume
    }

    fn bytes(&self) -> usize {
        (self.points.capacity() + self.scratch.capacity()) * size_of::<Point<M::State>>()
    }

    fn save(&self) -> Bytes {
        Bytes(pack(SAVED, &self.points))
    }

    fn restore(&mut self, saved: &Bytes) -> Result<(), Refusal> {
        self.points = unpack(SAVED, &saved.0)?;
        Ok(())
    }
}

/// The name in front of the points, whose type the cloud does not know.
const SAVED: &str = "points";
