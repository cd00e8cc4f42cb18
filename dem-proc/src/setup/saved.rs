//! The saved state of the solver, and its checks.
//!
//! Each struct with state defines next to its definition which fields are saved. It destructures itself field by field,
//! so that for a new field one has to decide whether it is state, follows from the configuration, or belongs to one
//! evaluation only. Lists are not saved: they are built again, in the same order, from the saved positions of bodies
//! and points at which they were first built.

use interface::config::{BodyConfig, DemConfig};
use interface::ledger::Totals;
use interface::solver::Refusal;
use serde::{Deserialize, Serialize};

use crate::body::bodies::SavedBody;
use crate::body::displacement::{Displacement, SavedDisplacement};
use crate::body::load::{Load, PairLoad};
use crate::contact::pairs::SavedPairs;
use crate::contact::point_side::SavedPoints;
use crate::saved::{count, finite, refusal};
use crate::system::System;

/// Name of the format of the bytes.
pub const FORMAT: &str = "tandem-dem 5";

/// The state before a step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SavedSystem {
    marks: Marks,
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
    /// The state of `system` before the next step; `marks` are those of its configuration.
    pub fn of(system: &System, marks: &Marks) -> Self {
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
            marks: marks.clone(),
            bodies: bodies.save(),
            speed: *speed,
            published: published.save(),
            totals: *totals,
            points: points.save(),
            point_pairs: point_pairs.as_ref().map(|pairs| pairs.save()),
            pairs: pairs.as_ref().map(|pairs| pairs.save()),
        }
    }

    /// Puts `system` into this state; `own` are the marks of its configuration. After a refusal the set of points is
    /// unchanged, but bodies may have other lists.
    ///
    /// # Errors
    /// A refusal that says what differs.
    pub fn restore(&self, system: &mut System, own: &Marks) -> Result<(), Refusal> {
        let Self {
            marks,
            bodies,
            speed,
            published,
            totals,
            points,
            point_pairs,
            pairs,
        } = self;
        own.check(marks)?;
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

/// The parts of a configuration that a state depends on. A state of a configuration with other parts is refused with
/// the key that differs. Laws, gravity and motions may differ.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Marks {
    /// One for each of [`KEYS`]; empty without a configuration.
    keys: Vec<u64>,
    /// One for each body.
    bodies: Vec<u64>,
}

/// Keys of the configuration other than bodies, in the order of [`Marks::keys`].
const KEYS: [&str; 5] = [
    "body_contact",
    "dem.overlap",
    "group_pair",
    "mpm.interface",
    "coupling.skin",
];

impl Marks {
    /// The marks of `config`.
    pub fn new(config: &DemConfig) -> Self {
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
        let keys = [
            mark(&body_contact.is_some()),
            mark(overlap),
            mark(
                &group_pairs
                    .iter()
                    .map(|pair| pair.between)
                    .collect::<Vec<_>>(),
            ),
            mark(interface),
            mark(skin),
        ];
        let body = |body: &BodyConfig| {
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
            mark(&(name, shape, sphero_radius, inertia, listed))
        };
        Self {
            keys: keys.to_vec(),
            bodies: bodies.iter().map(body).collect(),
        }
    }

    /// Refuses the state of another configuration.
    ///
    /// # Errors
    /// A refusal with the first key that differs.
    pub fn check(&self, saved: &Self) -> Result<(), Refusal> {
        count("bodies", saved.bodies.len(), self.bodies.len())?;
        count("marks", saved.keys.len(), self.keys.len())?;
        let other = |key: &str| refusal(format!("the saved state is of another `{key}`"));
        for (key, (is, was)) in KEYS.iter().zip(self.keys.iter().zip(&saved.keys)) {
            if is != was {
                return Err(other(key));
            }
        }
        let mut bodies = self.bodies.iter().zip(&saved.bodies);
        match bodies.position(|(is, was)| is != was) {
            Some(i) => Err(other(&format!("dem.body.{i}"))),
            None => Ok(()),
        }
    }
}

/// Fowler, Noll and Vo's hash (FNV-1a) of a value's bytes: it detects mistakes, not attacks.
fn mark<T: Serialize>(value: &T) -> u64 {
    let bytes = interface::saved::pack("", value);
    let add = |hash: u64, byte: &u8| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, add)
}
