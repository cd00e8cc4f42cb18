//! The saved state of the solver. The state of a component is one struct, which derives `Serialize` and `Deserialize` and
//! is saved whole; what stands beside it belongs to the configuration, follows from the state, or is a result of one
//! evaluation.
//!
//! Lists are not saved. They are built again, in the same order, from the saved positions of bodies and points at which
//! they were first built. The hash of a checkpoint decides whether bytes are what was saved, and the mark whether the
//! configuration is the same; neither is examined again here.

use interface::config::{BodyConfig, DemConfig};
use interface::saved::ConfigurationMark;
use interface::solver::Refusal;
use serde::{Deserialize, Serialize};

use crate::body::bodies::Pose;
use crate::body::frame::LastMove;
use crate::body::load::{Load, PairLoad};
use crate::system::{Sdem, State};

/// Name of the format of the bytes.
pub const FORMAT: &str = "tandem-dem 12";

/// The state before a step.
#[derive(Serialize, Deserialize)]
pub struct Saved {
    bodies: Vec<(Pose, LastMove)>,
    state: State,
    /// Those that the scene has, in their order.
    sides: Vec<Vec<u8>>,
}

impl Sdem {
    /// The state before the next step.
    pub(crate) fn saved(&self) -> Saved {
        Saved {
            bodies: self.bodies.save(),
            state: self.state.clone(),
            sides: self
                .sides
                .iter()
                .flatten()
                .map(|side| side.save())
                .collect(),
        }
    }

    /// Takes a configured solver to this state.
    ///
    /// # Errors
    /// A refusal if it is no state of this configuration.
    pub(crate) fn take(&mut self, saved: Saved) -> Result<(), Refusal> {
        self.bodies.restore(&saved.bodies);
        self.state = saved.state;
        // Driven bodies may have another speed than in the saved run.
        self.state.speed = self.state.speed.max(self.bodies.initial_speed());
        for (side, saved) in self.sides.iter_mut().flatten().zip(&saved.sides) {
            side.restore(saved, &self.bodies, &self.state.sets)?;
        }
        self.loads.by_points.fill(Load::default());
        self.loads.by_bodies.fill(PairLoad::default());
        self.loads.any_by_points = true; // the next evaluation clears what the last one left
        Ok(())
    }
}

/// What the numbers of a state of `config` depend on. Laws, gravity and motions may differ.
pub fn mark(config: &DemConfig) -> ConfigurationMark {
    let DemConfig {
        gravity: _,
        bodies,
        point_contact: _, // a saved history names its own parts
        body_contact,
        overlap,
        contact_resolution: _, // affects only the step, which the coupler may choose again
        contact_pairs: _,      // as for the law above
        point_surfaces: _,
        group_pairs,
        interface,
        skin,
        threads: _, // any number of threads gives the same bits
    } = config;
    let mut mark = ConfigurationMark::default();
    let between: Vec<_> = group_pairs.iter().map(|pair| pair.between).collect();
    mark.add("body_contact", &body_contact.is_some());
    mark.add("dem.overlap", overlap);
    mark.add("group_pair", &between);
    mark.add("mpm.interface", interface);
    mark.add("coupling.skin", skin);
    for (i, body) in bodies.iter().enumerate() {
        let BodyConfig {
            name,
            shape,
            sphero_radius,
            inertia,
            position: _, // an initial value, as are angle, velocity and spin
            angle: _,
            velocity: _,
            spin: _,
            motion,
            surface: _,
        } = body;
        // Two bodies that forces do not move are in no list.
        let listed = body_contact.is_some() && motion.yielding() != [0.0; 3];
        let parts = (name, shape, sphero_radius, inertia, listed);
        mark.add(format!("dem.body.{i}"), &parts);
    }
    mark
}
