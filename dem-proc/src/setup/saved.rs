//! The saved state of the solver, and its checks.
//!
//! Each struct with state defines next to its definition which fields are saved. It destructures itself field by field,
//! so that for a new field one has to decide whether it is state, follows from the configuration, or belongs to one
//! evaluation only. Lists are not saved: they are built again, in the same order, from the saved positions of bodies
//! and points at which they were first built.

use interface::config::{BodyConfig, DemConfig};
use interface::saved::ConfigurationMark;
use interface::solver::Refusal;
use mechanics::ledger::Totals;
use serde::{Deserialize, Serialize};

use crate::body::bodies::SavedBody;
use crate::body::displacement::{Displacement, SavedDisplacement};
use crate::body::load::{Load, PairLoad};
use crate::contact::pairs::SavedPairs;
use crate::contact::point_side::SavedPoints;
use crate::saved::{finite, refusal};
use crate::system::System;

/// Name of the format of the bytes.
pub const FORMAT: &str = "tandem-dem 6";

/// The state before a step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SavedSystem {
    bodies: Vec<SavedBody>,
    /// In m/s.
    speed: f64,
    published: SavedDisplacement,
    totals: Totals,
    points: SavedPoints,
    point_pairs: Option<SavedPoints>,
    pairs: Option<SavedPairs>,
}

impl SavedSystem {
    /// The state of `system` before the next step.
    pub fn of(system: &System) -> Self {
        let System {
            bodies,
            points,
            point_pairs,
            pairs,
            speed,
            published,
            totals,
            // These belong to the configuration.
            gravity: _,
            threads: _,
            constants: _,
            skin: _,
            // Results of an evaluation; the next one overwrites them.
            loads: _,
            kicked: _,
            // Answers that were already sent.
            envelopes: _,
            measurement: _,
        } = system;
        Self {
            bodies: bodies.save(),
            speed: *speed,
            published: published.save(),
            totals: *totals,
            points: points.save(),
            point_pairs: point_pairs.as_ref().map(|pairs| pairs.save()),
            pairs: pairs.as_ref().map(|pairs| pairs.save()),
        }
    }

    /// Puts `system` into this state. After a refusal the set of points is unchanged, but bodies may have other lists.
    ///
    /// # Errors
    /// A refusal that says what differs.
    pub fn restore(&self, system: &mut System) -> Result<(), Refusal> {
        let Self {
            bodies,
            speed,
            published,
            totals,
            points,
            point_pairs,
            pairs,
        } = self;
        let bodies = system.bodies.restored(bodies)?;
        // Driven bodies may have another speed than in the saved run.
        let speed = speed.max(bodies.initial_speed());
        finite(|| "the largest speed".into(), &[speed])?;
        finite(|| "a sum of the ledger".into(), &numbers(totals))?;
        let published = Displacement::restored(published, &bodies)?;
        match (&mut system.pairs, pairs) {
            (Some(here), Some(saved)) => here.restore(saved, &bodies)?,
            (None, None) => {}
            _ => {
                return Err(refusal(
                    "contact between bodies is in only one of state and scene",
                ));
            }
        }
        match (&mut system.point_pairs, point_pairs) {
            (Some(here), Some(saved)) => here.restore(saved, &bodies)?,
            (None, None) => {}
            _ => {
                return Err(refusal(
                    "contact between points is in only one of state and scene",
                ));
            }
        }
        system.points.restore(points, &bodies)?;
        (system.bodies, system.speed) = (bodies, speed);
        (system.published, system.totals) = (published, *totals);
        system.loads.by_points.fill(Load::default());
        system.loads.by_bodies.fill(PairLoad::default());
        system.loads.any_by_points = true; // the next evaluation clears what the last one left
        Ok(())
    }
}

/// The numbers of the totals.
fn numbers(totals: &Totals) -> [f64; 7] {
    let Totals {
        friction_work,
        viscous_work,
        driven_work,
        applied_impulse,
        contact_impulse,
    } = *totals;
    let ([ax, ay], [cx, cy]) = (applied_impulse.value(), contact_impulse.value());
    [friction_work, viscous_work, driven_work, ax, ay, cx, cy]
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
