//! A configured solver: its bodies, their contacts, and the results that one step leaves for the next.

use interface::Vec2;
use interface::ledger::Totals;
use interface::message::wire::EnvelopeVertex;
use interface::solver::DemMeasurement;
use serde::{Deserialize, Serialize};

use crate::body::bodies::{Bodies, Body, Rigid};
use crate::body::displacement::Displacement;
use crate::body::load::{Load, PairLoad};
use crate::contact::impact::SurfaceMotion;
use crate::contact::pairs::BodySide;
use crate::contact::point_body::PointBody;
use crate::contact::point_side::PointSide;
use crate::contact::points::PointContacts;
use crate::law::contact::Contact;
use crate::law::dashpot::Viscous;
use crate::law::normal::Linear;
use crate::law::tangent::Coulomb;
use crate::parry::BoxTree;
use crate::threads::Threads;

/// The state of the solver beside that of its bodies and contacts.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(crate) struct State {
    /// Upper bound of the speed of any surface over the last step, in m/s.
    pub speed: f64,
    /// Displacement of surfaces since the last call of `envelopes`.
    pub published: Displacement,
    /// Sums over the run.
    pub totals: Totals,
}

/// A configured solver.
#[derive(Debug)]
pub struct System {
    /// Acceleration of gravity in m/s^2.
    pub(crate) gravity: Vec2,
    /// The bodies.
    pub(crate) bodies: Bodies,
    /// Contact with points.
    pub(crate) points: Box<dyn PointSide>,
    /// Contact between the points of two groups, if the scene has a law for it.
    pub(crate) point_pairs: Option<Box<dyn PointSide>>,
    /// Contact between bodies, if the scene has a law for it and a body that forces can move.
    pub(crate) pairs: Option<Box<dyn BodySide>>,
    /// How loops are run.
    pub(crate) threads: Threads,
    /// Contact loads on the bodies.
    pub(crate) loads: Loads,
    /// Results of the kick, which the drift commits.
    pub(crate) kicked: Kicked,
    /// Constants of the step limits.
    pub(crate) constants: LimitConstants,
    /// What is saved with the bodies and the contacts.
    pub(crate) state: State,
    /// `V_d` in m.
    pub(crate) skin: f64,
    /// The envelopes.
    pub(crate) envelopes: Vec<EnvelopeVertex>,
    /// The last measurement.
    pub(crate) measurement: DemMeasurement,
}

/// Contact loads on each body.
#[derive(Debug, Default)]
pub(crate) struct Loads {
    /// By points.
    pub by_points: Vec<Load>,
    /// By bodies.
    pub by_bodies: Vec<PairLoad>,
    /// Whether any of `by_points` may be other than zero.
    pub any_by_points: bool,
}

impl Loads {
    /// No loads on `n` bodies.
    pub fn of(n: usize) -> Self {
        Self {
            by_points: vec![Load::default(); n],
            by_bodies: vec![PairLoad::default(); n],
            any_by_points: false,
        }
    }
}

/// Results of the kick of a step, not yet committed.
#[derive(Debug, Default)]
pub(crate) struct Kicked {
    /// Velocities and spins of the bodies at `t_{n+1/2}`.
    pub velocities: Vec<(Vec2, f64)>,
    /// Bounds of their surfaces' motion, for the step limit.
    pub motions: Vec<SurfaceMotion>,
    /// Largest surface speed in each part of the bodies in m/s.
    pub fastest: Vec<f64>,
    /// Upper bound of the speed of any surface in m/s.
    pub speed: f64,
}

/// Constants of the step limits, from the configuration.
#[derive(Debug)]
pub(crate) struct LimitConstants {
    /// Largest acceleration of any surface by gravity and external forces, in m/s^2.
    pub outer_acceleration: f64,
    /// Bound of the squared frequency of two bodies in contact, at any contact point, in 1/s^2.
    pub first_contact: f64,
    /// `(2 / r)^2` with the resolutions `r` of impacts between bodies and of points.
    pub per_resolution_sq: [f64; 2],
}

impl Default for System {
    /// No bodies.
    fn default() -> Self {
        let law = Contact {
            normal: Linear { stiffness: 0.0 },
            tangent: Coulomb::SMOOTH,
            dashpot: Viscous {
                ratio: 0.0,
                mass: 0.0,
            },
        };
        Self {
            gravity: Vec2::zeros(),
            bodies: Bodies::default(),
            points: Box::new(PointContacts::new(
                law,
                PointBody {
                    surfaces: Vec::new(),
                },
                0.0,
            )),
            point_pairs: None,
            pairs: None,
            threads: Threads::default(),
            loads: Loads::default(),
            kicked: Kicked::default(),
            constants: LimitConstants {
                outer_acceleration: 0.0,
                first_contact: 0.0,
                per_resolution_sq: [1.0; 2],
            },
            state: State::default(),
            skin: 0.0,
            envelopes: Vec::new(),
            measurement: DemMeasurement::default(),
        }
    }
}

impl System {
    /// Bytes of memory in use.
    pub fn bytes(&self) -> usize {
        let trees = self
            .bodies
            .properties
            .iter()
            .filter_map(|b| b.shape.edges.as_ref());
        let body = size_of::<Body>() + size_of::<Rigid>() + 2 * size_of::<Load>();
        self.bodies.len() * body
            + self.bodies.outline.len() * 2 * size_of::<Vec2>()
            + trees.map(BoxTree::bytes).sum::<usize>()
            + self.points.bytes()
            + self.point_pairs.as_ref().map_or(0, |p| p.bytes())
            + self.pairs.as_ref().map_or(0, |p| p.bytes())
    }
}
