//! Contact of layers on the nodes (Bardenhagen 2000).
//!
//! Each layer has its own velocities at the nodes, so that layers do not interact until their nodes have been kicked. Then,
//! if a node of the regular grid has mass of two or more of them, the velocities of those that approach are corrected
//! ([`nodes`]).

mod density;
mod nodes;

use interface::message::wire::Ledger;
use interface::step::Step;
use mechanics::threads::Threads;

use crate::kernel::shape::Shape;
use crate::kernel::transfer::AffineState;
use crate::state::continuum::Continuum;
pub use nodes::Losses;
use nodes::SharedNodes;

/// Contact of all layers with friction between them.
#[derive(Debug, Default)]
pub struct GridContact {
    shared: SharedNodes,
    /// Coefficient of Coulomb friction.
    friction: f64,
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

    /// Corrects the velocities of nodes that have been kicked. Returns what that dissipates.
    pub fn act<const W: usize, S: Shape<W>, A: AffineState>(
        &mut self,
        threads: &Threads,
        layers: &mut [&mut Continuum<W, S, A>],
        step: &Step,
    ) -> Losses {
        if step.kick() == 0.0 {
            return Losses::default(); // The opening step has no velocities of its own.
        }
        let grids: Vec<_> = layers.iter().map(|layer| &layer.grid).collect();
        self.shared.find(threads, &grids);
        self.shared.find_gradients(threads, layers);
        let mut lost = self.shared.touch(threads, &grids, self.friction);
        self.shared.give_back(threads, layers);
        let first = &layers[0];
        if first.books_kick() {
            return lost;
        }
        if let Some(damping) = first.damping {
            lost.damping = damping.beside(lost.friction + lost.impact);
        }
        lost.impact = 0.0;
        lost
    }

    /// Adds what has been lost to a measurement, of the present step the share `centring`. Energy that impacts give beyond
    /// what they have taken is created, and stays in the residual.
    pub fn measure(&self, ledger: &mut Ledger, of_step: Losses, centring: f64) {
        let before = self.lost;
        ledger.friction_work += before.friction + centring * of_step.friction;
        ledger.viscous_work += (before.impact + centring * of_step.impact).max(0.0);
        ledger.viscous_work += before.damping + centring * of_step.damping;
    }
}
