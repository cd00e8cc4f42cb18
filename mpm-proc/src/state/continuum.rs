//! The continuum: clouds of points over one grid, for one shape function and one transfer.

use interface::config::{Drift, StressUpdate};
use interface::message::wire::{EnvelopeVertex, ImpForce, ImpInfo, ImpState, Limits, PointState};
use interface::saved::{pack, unpack};
use interface::solver::{Fault, MpmMeasurement, Refusal};
use interface::step::Step;
use serde::{Deserialize, Serialize};

use crate::pass::contact::{Loaded, Touch};

use crate::kernel::lanes::LANES;
use crate::kernel::shape::Shape;
use crate::kernel::spread::Spread;
use crate::kernel::threads::Threads;
use crate::kernel::transfer::Transfer;
use crate::pass::leaving::Outside;
use crate::pass::measure::Books;
use crate::state::grid::{Grid, NODES};
use crate::state::imps::{Imps, SavedImps};
use crate::state::points::{Cloud, LaneCopy, NO_POINT, SavedCloud};
use crate::state::saved::refusal;
use crate::state::stages::Stages;

/// Share of a cell that points may have moved before they are sorted again: just below the margin of a tile's window,
/// so that rounding cannot carry one over it.
const SORT_AFTER: f64 = 0.99;

/// The whole state of the solver.
pub struct Continuum<const W: usize, S: Shape<W>, T: Transfer>
where
    T::Affine: LaneCopy,
{
    /// One cloud for each group of the configuration.
    pub clouds: Vec<Cloud<W, S, T::Affine>>,
    /// The grid.
    pub grid: Grid,
    /// Transfer scheme.
    pub transfer: T,
    /// The identified material points.
    pub imps: Imps,
    /// Points that bodies press on in the present step.
    pub loaded: Vec<Loaded>,
    /// Nodes that they touch, `W^2` each.
    pub touches: Vec<Touch>,
    /// How a contact force reaches the grid.
    pub spread: Spread,
    /// Points that leave the domain.
    pub outside: Outside,
    /// Sums that go on through the run, and the last measurement.
    pub books: Books,
    /// When stresses are updated.
    pub stress_update: StressUpdate,
    /// With which velocity points move.
    pub drift: Drift,
    /// Sums over nodes for the step limit of linear hats; empty for other shapes.
    pub loads_of_nodes: Vec<[f64; NODES]>,
    /// Stages of loading.
    pub stages: Stages,
    /// Mass-proportional damping of the present step in 1/s.
    pub damping: f64,
    /// Threads.
    pub threads: Threads,
    /// Upper bound of the displacement of any point since points were last sorted, in m.
    pub moved: f64,
}

impl<const W: usize, S: Shape<W>, T: Transfer> Continuum<W, S, T>
where
    T::Affine: LaneCopy,
{
    /// Sorts the points and lays out the grid, if they could have left their tiles' windows.
    pub fn keep_sorted(&mut self) {
        if self.moved > SORT_AFTER * self.grid.geometry.cell {
            self.sort();
        }
    }

    /// Sorts the points and lays out the grid; points that have crossed a periodic wall enter at the other end.
    pub fn sort(&mut self) {
        self.enter_again();
        for cloud in &mut self.clouds {
            cloud.sort(&self.grid.geometry);
        }
        self.grid.cover(&mut self.clouds);
        self.moved = 0.0;
    }

    /// Longest list of tiles that one thread keeps to itself.
    pub fn grain(&self) -> usize {
        self.threads
            .grain(self.clouds.iter().map(|c| c.tiles.len()).max().unwrap_or(0))
    }

    /// Looks at what moving the points reported: counts their drift, and refuses what is not finite or outside.
    pub fn check_points(&mut self, dt: f64) -> Result<(), Fault> {
        let closed = self.grid.walls.closed();
        let (lower, upper) = (self.grid.geometry.lower, self.grid.geometry.upper);
        let periodic = self.grid.geometry.periodic;
        // A wall that holds its nodes lets a point come closer than its nodes do, by less than a cell.
        let slack = |axis: usize, end: usize| {
            if periodic[axis] {
                f64::INFINITY
            } else if closed[axis][end] {
                self.grid.geometry.cell
            } else {
                0.0
            }
        };
        let lower = [lower[0] - slack(0, 0), lower[1] - slack(1, 0)];
        let upper = [upper[0] + slack(0, 1), upper[1] + slack(1, 1)];
        let mut speed_sq: f64 = 0.0;
        for (number, cloud) in self.clouds.iter().enumerate() {
            for (tile, report) in cloud.tiles.iter().zip(&cloud.reports) {
                let inside =
                    (0..2).all(|a| report.lower[a] >= lower[a] && report.upper[a] <= upper[a]);
                if !report.sum.is_finite() || !inside {
                    for block in tile.first..tile.first + tile.blocks {
                        for k in 0..LANES {
                            let lane = block * LANES + k;
                            match cloud.check_point(lane, lower, upper) {
                                Err(fault @ Fault::LeftDomain { .. }) => {
                                    self.outside.take(number, lane, fault)?;
                                }
                                other => other?,
                            }
                        }
                    }
                }
                speed_sq = speed_sq.max(report.speed_sq);
            }
        }
        let moved = speed_sq.sqrt() * dt;
        self.moved += moved;
        self.imps.travel += moved;
        Ok(())
    }
}

impl<const W: usize, S: Shape<W>, A: crate::kernel::transfer::AffineState + LaneCopy>
    Cloud<W, S, A>
{
    fn check_point(&self, lane: usize, lower: [f64; 2], upper: [f64; 2]) -> Result<(), Fault> {
        let local = self.ids[lane / LANES][lane % LANES];
        if local == NO_POINT {
            return Ok(());
        }
        let id = self.first_id + u64::from(local);
        if self.material.collapsed(lane) {
            return Err(Fault::Material {
                id,
                message: "its volume has vanished; a smaller step or a finer grid may help".into(),
            });
        }
        let [x, v] = [self.position(lane), self.velocity(lane)];
        let quantity = [(v, "velocity"), (x, "position")]
            .into_iter()
            // Squares that overflow are as good as infinite: no kinetic energy could be told.
            .find(|(q, _)| !(q[0] * q[0] + q[1] * q[1]).is_finite());
        if let Some((_, what)) = quantity {
            return Err(Fault::NotFinite {
                what: what.into(),
                item: format!("point {id}"),
            });
        }
        if (0..2).any(|a| x[a] < lower[a] || x[a] > upper[a]) {
            return Err(Fault::LeftDomain {
                id,
                x: x[0],
                y: x[1],
            });
        }
        Ok(())
    }
}

/// What of a continuum is saved.
#[derive(Serialize, Deserialize)]
pub struct SavedContinuum<A> {
    pub(crate) clouds: Vec<SavedCloud<A>>,
    contact: bool,
    imps: SavedImps,
    pub(crate) books: Books,
    moved: f64,
}

/// The mark of the bytes of one continuum.
pub(crate) const SAVED: &str = "continuum";

impl<const W: usize, S: Shape<W>, T: Transfer> Continuum<W, S, T>
where
    T::Affine: LaneCopy,
{
    /// The state before the next step.
    pub fn saved(&self) -> SavedContinuum<T::Affine> {
        let Self {
            clouds,
            grid,
            transfer: _, // of the configuration, and of the stage, which every step asks for
            imps,
            loaded: _,  // of one step
            touches: _, // likewise; they only say where the forces of the step before are
            spread: _,  // of the configuration
            outside: _, // of the configuration, and empty again at the end of a step
            books,
            stress_update: _,  // of the configuration
            drift: _,          // likewise
            loads_of_nodes: _, // of one step
            stages: _,         // of the configuration
            damping: _,        // of one step
            threads: _,        // of the configuration
            moved,
        } = self;
        SavedContinuum {
            clouds: clouds.iter().map(Cloud::save).collect(),
            contact: grid.save(),
            imps: imps.save(),
            books: books.clone(),
            moved: *moved,
        }
    }

    /// Takes over what [`Self::saved`] gave. The continuum has been configured and has done no step.
    ///
    /// # Errors
    /// A [`Refusal`] of what is not a state of this continuum, which is then of no more use.
    pub fn take_over(&mut self, saved: SavedContinuum<T::Affine>) -> Result<(), Refusal> {
        let SavedContinuum {
            clouds,
            contact,
            imps,
            books,
            moved,
        } = saved;
        let (groups, expected) = (clouds.len(), self.clouds.len());
        if groups != expected {
            let text = format!("{groups} groups, the configuration has {expected}");
            return Err(refusal(text));
        }
        if !(moved.is_finite() && moved >= 0.0) {
            return Err(refusal(format!("points have moved by {moved} m")));
        }
        for (group, (cloud, saved)) in self.clouds.iter_mut().zip(clouds).enumerate() {
            cloud.restore(saved, &self.grid.geometry).map_err(|r| {
                let message = format!("group {group} of the state: {}", r.message);
                Refusal { message, ..r }
            })?;
        }
        self.grid.restore(contact, &mut self.clouds);
        self.imps.restore(imps, &self.clouds)?;
        if !contact && !self.imps.infos.is_empty() {
            return Err(refusal("IMPs, and no room for contact on the nodes"));
        }
        self.loaded.clear();
        self.touches.clear();
        (self.books, self.moved) = (books, moved);
        Ok(())
    }
}

/// What the solver asks of a continuum, whatever its shape function and transfer.
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

    /// The state before the next step.
    fn save(&self) -> Vec<u8>;

    /// Takes over what [`Self::save`] gave.
    ///
    /// # Errors
    /// A [`Refusal`] of what is not a state of this configuration; the scheme is then of no more use.
    fn restore(&mut self, saved: &[u8]) -> Result<(), Refusal>;

    /// Sorts the points whether they need it or not.
    #[cfg(test)]
    fn sort_now(&mut self);

    /// Whether points were sorted at the end of the last step.
    #[cfg(test)]
    fn just_sorted(&self) -> bool;
}

impl<const W: usize, S: Shape<W>, T: Transfer> Scheme for Continuum<W, S, T>
where
    T::Affine: LaneCopy,
{
    fn predict(&mut self, step: &Step) -> Result<(), Fault> {
        Continuum::predict(self, step)
    }

    fn correct(&mut self, step: &Step, forces: &[ImpForce]) -> Result<Limits, Fault> {
        Continuum::correct(self, step, forces)
    }

    fn select_imps(&mut self, envelopes: &[EnvelopeVertex]) -> &[ImpInfo] {
        self.imps.select(&self.clouds, envelopes);
        if !self.imps.infos.is_empty() && self.grid.contact.is_empty() {
            self.grid.hold_contact();
        }
        &self.imps.infos
    }

    fn travel(&self) -> f64 {
        self.imps.travel
    }

    fn imp_states(&mut self) -> &[ImpState] {
        self.imps.refresh(&self.clouds);
        &self.imps.states
    }

    fn measurement(&self) -> &MpmMeasurement {
        &self.books.measurement
    }

    fn points(&self) -> Vec<PointState> {
        let point = |group: usize, cloud: &Cloud<W, S, T::Affine>, (i, &lane): (usize, &u32)| {
            let (stress, volume) = cloud.material.strained(lane as usize);
            PointState {
                id: cloud.first_id + i as u64,
                position: self.grid.geometry.entered(cloud.position(lane as usize)),
                velocity: cloud.velocity(lane as usize),
                stress,
                volume: volume * cloud.volume,
                mass: cloud.mass,
                group: group as u32,
                reserved: 0,
            }
        };
        let clouds = self.clouds.iter().enumerate();
        clouds
            .flat_map(|(group, c)| {
                let stays = |l: &(usize, &u32)| *l.1 != NO_POINT;
                let lanes = c.lane_of.iter().enumerate().filter(stays);
                lanes.map(move |l| point(group, c, l))
            })
            .collect()
    }

    fn bytes(&self) -> usize {
        let nodes = size_of::<crate::state::grid::NodeTile>() * self.grid.tiles.capacity();
        nodes + self.clouds.iter().map(Cloud::bytes).sum::<usize>()
    }

    fn save(&self) -> Vec<u8> {
        pack(SAVED, &self.saved())
    }

    fn restore(&mut self, saved: &[u8]) -> Result<(), Refusal> {
        self.take_over(unpack(SAVED, saved)?)
    }

    #[cfg(test)]
    fn sort_now(&mut self) {
        self.sort();
    }

    #[cfg(test)]
    fn just_sorted(&self) -> bool {
        self.moved == 0.0
    }
}
