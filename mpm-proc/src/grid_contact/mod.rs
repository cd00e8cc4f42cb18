//! Contact of layers on the nodes (Bardenhagen 2000).
//!
//! Each layer has its own velocities at the nodes, so that layers do not interact until their nodes have been kicked. Then,
//! if a node of the regular grid has mass of two or more of them, the velocities of those that approach are corrected
//! ([`nodes`]).

mod density;
mod nodes;

use interface::message::wire::Ledger;
use interface::step::Step;

use crate::kernel::shape::Shape;
use crate::kernel::transfer::AffineState;
use crate::pass::images::follow;
use crate::state::continuum::Continuum;
use crate::state::grid::Grid;
pub use nodes::Losses;
use nodes::SharedNodes;

/// Contact of all layers with friction between them.
#[derive(Debug, Default)]
pub struct GridContact {
    shared: SharedNodes,
    /// Coefficient of Coulomb friction.
    friction: f64,
    /// In the present step.
    losing: Losses,
    /// In all steps before, which is saved.
    pub lost: Losses,
}

impl GridContact {
    /// With this coefficient of friction.
    pub fn new(friction: f64) -> Self {
        Self {
            friction,
            ..Self::default()
        }
    }

    /// Corrects the velocities of nodes that have been kicked.
    pub fn act<const W: usize, S: Shape<W>, A: AffineState>(
        &mut self,
        layers: &mut [&mut Continuum<W, S, A>],
        step: &Step,
    ) {
        if step.kick() == 0.0 {
            return; // The opening step has no velocities of its own.
        }
        self.shared.find(layers.iter().map(|layer| &layer.grid));
        for (number, layer) in layers.iter().enumerate() {
            self.shared.add_density_gradients(number, layer);
        }
        let grids = layers.iter_mut().map(|layer| &mut layer.grid.tiles[..]);
        let mut tiles: Vec<_> = grids.collect();
        self.losing = self.shared.touch(&mut tiles, self.friction);
        for layer in &mut *layers {
            let Grid { images, tiles, .. } = &mut layer.grid;
            follow(images, tiles);
        }
        let first = &layers[0];
        if let Some(damping) = first.damping_of_points() {
            self.losing.damping = damping.beside(self.losing.friction + self.losing.impact);
        }
        if !first.books_kick() {
            self.losing.impact = 0.0;
        }
    }

    /// Adds what has been lost to a measurement, with the share `centring` of the present step. Energy that impacts give
    /// beyond what they have taken is created, and stays in the residual.
    pub fn measure(&self, ledger: &mut Ledger, centring: f64) {
        let (lost, losing) = (self.lost, self.losing);
        ledger.friction_work += lost.friction + centring * losing.friction;
        ledger.viscous_work += (lost.impact + centring * losing.impact).max(0.0);
        ledger.viscous_work += lost.damping + centring * losing.damping;
    }

    /// Ends a step.
    pub fn close(&mut self) {
        self.lost += core::mem::take(&mut self.losing);
    }
}
