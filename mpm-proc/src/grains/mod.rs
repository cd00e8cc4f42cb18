//! Several bodies of points with contact on the grid (Bardenhagen 2000).
//!
//! Each group of points is a grain with its own nodal velocities, so that grains do not interact until their nodes have
//! been kicked. Then, if a node of the regular grid has mass of two or more grains, the velocities of those that
//! approach are corrected ([`contact`]).

mod contact;
mod density;

use interface::message::wire::{EnvelopeVertex, ImpForce, ImpInfo, ImpState, Limits, PointState};
use interface::saved::ConfigurationMark;
use interface::solver::{Fault, MpmMeasurement, Refusal};
use interface::step::Step;
use serde::{Deserialize, Serialize};

use crate::kernel::shape::Shape;
use crate::kernel::threads::over_items;
use crate::kernel::transfer::AffineState;
use crate::pass::images::follow;
use crate::scheme::Scheme;
use crate::several;
use crate::state::contact::ContactLoad;
use crate::state::continuum::{Continuum, SavedContinuum};
use crate::state::grid::Grid;
use crate::state::saved::FORMAT;
use crate::step;
use contact::{Losses, SharedNodes};
use mechanics::threads::Threads;

/// A body of points with its own nodes.
pub struct Grain<const W: usize, S: Shape<W>, A: AffineState> {
    continuum: Continuum<W, S, A>,
    /// The contact and the result of the present step.
    load: ContactLoad,
    outcome: Result<Limits, Fault>,
}

/// All grains of a scene.
pub struct Grains<const W: usize, S: Shape<W>, A: AffineState> {
    all: Vec<Grain<W, S, A>>,
    shared: SharedNodes,
    /// Coefficient of Coulomb friction between grains.
    friction: f64,
    state: GrainsState,
    threads: Threads,
    measurement: MpmMeasurement,
}

/// The state of grains besides each of them, all of which is saved.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
struct GrainsState {
    /// By contact between grains so far.
    lost: Losses,
    /// Whether bodies of the other solver are near. Grains do not feel them, so the run stops.
    bodies_near: bool,
}

impl<const W: usize, S: Shape<W>, A: AffineState> Grains<W, S, A> {
    /// Grains of one cloud each, with friction between them.
    pub fn new(continua: Vec<Continuum<W, S, A>>, friction: f64, threads: Threads) -> Self {
        let grains = continua.into_iter().map(|continuum| Grain {
            continuum,
            load: ContactLoad::default(),
            outcome: Ok(Limits::default()),
        });
        Self {
            all: grains.collect(),
            shared: SharedNodes::default(),
            friction,
            state: GrainsState::default(),
            threads,
            measurement: MpmMeasurement::default(),
        }
    }

    /// The part of a step after the prediction: every grain moves its nodes, the nodes are in contact, and every grain
    /// moves its points.
    fn correct(&mut self, step: &Step) -> Result<Limits, Fault> {
        self.each(&|grain| grain.move_nodes(step))?; //  v_g^L                                 Bardenhagen (8) ... (11)
        let lost = if step.kick() > 0.0 {
            self.touch() //                              v_g~                                  Bardenhagen (12) ... (24)
        } else {
            Losses::default() // the opening step has no velocities of its own
        };
        let limits = self.each(&|grain| grain.move_points(step))?;
        if step.measure {
            self.measure(step.centring(), lost);
        }
        self.state.lost += lost;
        Ok(limits)
    }

    /// Does `work` with every grain; returns the narrowest limits.
    fn each(
        &mut self,
        work: &(impl Fn(&mut Grain<W, S, A>) -> Result<Limits, Fault> + Sync),
    ) -> Result<Limits, Fault> {
        over_items(&self.threads, &mut self.all, &|g| g.outcome = work(g));
        let mut limits = Limits::default();
        for grain in &mut self.all {
            let of = core::mem::replace(&mut grain.outcome, Ok(Limits::default()))?;
            limits = several::narrowest(&limits, &of);
        }
        Ok(limits)
    }

    /// Contact on shared nodes.
    fn touch(&mut self) -> Losses {
        self.shared.find(self.all.iter().map(|g| &g.continuum.grid));
        for (number, grain) in self.all.iter().enumerate() {
            self.shared.add_density_gradients(number, &grain.continuum);
        }
        let grids = self.all.iter_mut().map(|g| &mut g.continuum.grid.tiles[..]);
        let mut lost = self
            .shared
            .touch(&mut grids.collect::<Vec<_>>(), self.friction);
        for grain in &mut self.all {
            let Grid { images, tiles, .. } = &mut grain.continuum.grid;
            follow(images, tiles);
        }
        if let Some(damping) = self.all[0].continuum.damping_of_points() {
            lost.damping = damping.beside(lost.friction + lost.impact);
        }
        if !self.all[0].continuum.books_kick() {
            lost.impact = 0.0;
        }
        lost
    }

    /// Takes the share `centring` of what the present step has `lost`. Energy that impacts give beyond what they have
    /// taken is created, and stays in the residual.
    fn measure(&mut self, centring: f64, lost: Losses) {
        several::measure(&mut self.measurement, self.all.iter().map(|g| &g.continuum));
        let ledger = &mut self.measurement.ledger;
        ledger.friction_work += self.state.lost.friction + centring * lost.friction;
        ledger.viscous_work += (self.state.lost.impact + centring * lost.impact).max(0.0);
        ledger.viscous_work += self.state.lost.damping + centring * lost.damping;
    }
}

impl<const W: usize, S: Shape<W>, A: AffineState> Grain<W, S, A> {
    fn move_nodes(&mut self, step: &Step) -> Result<Limits, Fault> {
        self.load = step::move_nodes(&mut self.continuum, step, &[])?;
        Ok(Limits::default())
    }

    fn move_points(&mut self, step: &Step) -> Result<Limits, Fault> {
        step::move_points(&mut self.continuum, step, self.load)
    }
}

/// The states of all grains.
#[derive(Serialize, Deserialize)]
struct SavedGrains<A> {
    own: GrainsState,
    all: Vec<SavedContinuum<A>>,
}

impl<const W: usize, S: Shape<W>, A: AffineState> Scheme for Grains<W, S, A> {
    fn predict(&mut self, step: &Step) -> Result<(), Fault> {
        self.each(&|grain| step::predict(&mut grain.continuum, step).map(|()| Limits::default()))?;
        Ok(())
    }

    fn correct(&mut self, step: &Step, _: &[ImpForce]) -> Result<Limits, Fault> {
        if self.state.bodies_near {
            return Err(Fault::Other(
                "contact on the grid (mpm.grid_contact) cannot be combined with bodies of another solver; leave out one of them"
                    .into(),
            ));
        }
        Grains::correct(self, step)
    }

    fn select_imps(&mut self, envelopes: &[EnvelopeVertex]) -> &[ImpInfo] {
        self.state.bodies_near = !envelopes.is_empty();
        for grain in &mut self.all {
            grain.continuum.imps.state.travel = 0.0;
        }
        &[]
    }

    fn travel(&self) -> f64 {
        several::travel(self.all.iter().map(|g| &g.continuum))
    }

    fn imp_states(&mut self) -> &[ImpState] {
        &[]
    }

    fn measurement(&self) -> &MpmMeasurement {
        &self.measurement
    }

    fn points(&self) -> Vec<PointState> {
        several::points(self.all.iter().map(|g| &g.continuum)) // a grain is a group
    }

    fn bytes(&self) -> usize {
        self.all.iter().map(|g| g.continuum.bytes()).sum()
    }

    fn save(&self, mark: &ConfigurationMark) -> Vec<u8> {
        let all = self.all.iter().map(|g| g.continuum.saved()).collect();
        let own = self.state;
        mark.seal(FORMAT, &SavedGrains { own, all })
    }

    fn restore(&mut self, mark: &ConfigurationMark, saved: &[u8]) -> Result<(), Refusal> {
        let SavedGrains { own, all } = mark.open(FORMAT, saved)?;
        self.state = own;
        for (grain, saved) in self.all.iter_mut().zip(all) {
            grain.continuum.take_over(saved)?;
        }
        Ok(())
    }
}
