//! The continuum: clouds of points over one grid, for one shape function, with or without affine parts. It is only data; the passes
//! work on it.

use interface::config::{Drift, StressUpdate};
use interface::solver::Refusal;
use mechanics::threads::Threads;
use serde::{Deserialize, Serialize};

use super::contact::{Loaded, Touch};
use super::grid::Grid;
use super::holds::Holds;
use super::imps::{Imps, SavedImps};
use super::outside::Outside;
use super::point_set::PointSet;
use super::points::{Cloud, SavedCloud};
use super::saved::refusal;
use super::stages::Stages;
use super::totals::Totals;
use crate::kernel::shape::Shape;
use crate::kernel::spread::Spread;
use crate::kernel::tiles::NODES;
use crate::kernel::transfer::{AffineState, Transfer};

/// The whole state of the solver.
pub struct Continuum<const W: usize, S: Shape<W>, A: AffineState> {
    /// One cloud for each group of the configuration.
    pub clouds: Vec<Cloud<W, S, A>>,
    /// The grid.
    pub grid: Grid,
    /// Transfer scheme.
    pub transfer: Transfer,
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
    /// Sums over the run, and the last measurement.
    pub totals: Totals,
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
    /// Points whose mean motion is recorded.
    pub probes: Vec<PointSet>,
    /// Points that are held.
    pub holds: Holds,
    /// How loops are run.
    pub threads: Threads,
    /// Upper bound of the displacement of any point since points were last sorted, in m.
    pub moved: f64,
}

/// The saved part of a continuum.
#[derive(Serialize, Deserialize)]
pub struct SavedContinuum<A> {
    pub(crate) clouds: Vec<SavedCloud<A>>,
    contact: bool,
    imps: SavedImps,
    pub(crate) totals: Totals,
    moved: f64,
}

/// The name of the format of one continuum.
pub(crate) const SAVED: &str = "continuum";

impl<const W: usize, S: Shape<W>, A: AffineState> Continuum<W, S, A> {
    /// The state before the next step.
    pub fn saved(&self) -> SavedContinuum<A> {
        let Self {
            clouds,
            grid,
            transfer: _, // of the configuration, and of the stage, which every step asks for
            imps,
            loaded: _,  // of one step
            touches: _, // likewise; they only locate the forces of the last step
            spread: _,  // of the configuration
            outside: _, // of the configuration, and empty again at the end of a step
            totals,
            stress_update: _,  // of the configuration
            drift: _,          // likewise
            loads_of_nodes: _, // of one step
            stages: _,         // of the configuration
            damping: _,        // of one step
            probes: _,         // of the configuration
            holds: _,          // likewise, and what is of one step
            threads: _,        // of the configuration
            moved,
        } = self;
        SavedContinuum {
            clouds: clouds.iter().map(Cloud::save).collect(),
            contact: grid.save(),
            imps: imps.save(),
            totals: totals.clone(),
            moved: *moved,
        }
    }

    /// Restores what [`Self::saved`] returned. The continuum has been configured and has done no step.
    ///
    /// # Errors
    /// A [`Refusal`] if it is not a state of this continuum, which can then not be used any more.
    pub fn take_over(&mut self, saved: SavedContinuum<A>) -> Result<(), Refusal> {
        let SavedContinuum {
            clouds,
            contact,
            imps,
            totals,
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
            return Err(refusal("IMPs without the contact data of the nodes"));
        }
        self.loaded.clear();
        self.touches.clear();
        (self.totals, self.moved) = (totals, moved);
        Ok(())
    }
}
