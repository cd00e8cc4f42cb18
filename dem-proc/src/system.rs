//! The solver: its bodies, their contacts, and the results that one step leaves for the next.

use interface::Vec2;
use interface::ledger::Totals;
use interface::message::wire::{ContactState, EnvelopeVertex, ImpForce};
use interface::saved::ConfigurationMark;
use interface::solver::DemMeasurement;
use serde::{Deserialize, Serialize};

use crate::body::bodies::{Bodies, Body, Rigid};
use crate::body::displacement::Displacement;
use crate::body::load::{Load, PairLoad};
use crate::contact::impact::SurfaceMotion;
use crate::contact::side::Side;
use crate::lists::now::Sets;
use crate::parry::BoxTree;
use crate::threads::part;
use mechanics::threads::Threads;

/// The state of the solver beside that of its bodies and contacts.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(crate) struct State {
    /// Upper bound of the speed of any surface over the last step, in m/s.
    pub speed: f64,
    /// Displacement of surfaces since the last call of `envelopes`.
    pub published: Displacement,
    /// Sums over the run.
    pub totals: Totals,
    /// The sets of points.
    pub sets: Sets,
}

/// The spheropolygon solver. It has no bodies until it is configured.
#[derive(Debug)]
pub struct Sdem {
    /// Of the configuration, for saved states.
    pub(crate) mark: ConfigurationMark,
    /// Acceleration of gravity in m/s^2.
    pub(crate) gravity: Vec2,
    /// The bodies.
    pub(crate) bodies: Bodies,
    /// Contacts of every kind.
    pub(crate) sides: Sides,
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
    /// The contacts that pressed in the last measured or opening step: of bodies, of points with bodies, and of pairs of points,
    /// each in the order of its list.
    pub(crate) contacts: Vec<ContactState>,
    /// The last measurement.
    pub(crate) measurement: DemMeasurement,
}

/// Contacts of each kind that the scene has, in the order of frames.
pub(crate) type Sides = [Option<Box<dyn Side>>; 3];

/// Between bodies: there if the scene has a law for it and a body that forces can move.
pub(crate) const BODIES: usize = 0;
/// Of points with bodies.
pub(crate) const POINTS: usize = 1;
/// Between the points of two groups: there if the scene has a law for it.
pub(crate) const POINT_PAIRS: usize = 2;

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

    /// Makes them zero, and the `forces` on points. Returns whether contacts of points have to be evaluated: if there
    /// are none, and were none in the step before, there is nothing to add.
    pub fn clear(&mut self, threads: &Threads, forces: &mut [ImpForce], points: bool) -> bool {
        // By parts, since the thread that clears a load is the one that kicks by it and mostly the one that adds to it.
        let part = part(threads, self.by_bodies.len());
        threads.each(self.by_bodies.chunks_mut(part), |loads| {
            loads.fill(PairLoad::default());
        });
        let evaluate = points || self.any_by_points;
        if evaluate {
            self.by_points.fill(Load::default());
            forces.fill(ImpForce::default());
        }
        self.any_by_points = points;
        evaluate
    }
}

/// Results of the kick of a step, not yet committed.
#[derive(Debug, Default)]
pub(crate) struct Kicked {
    /// Velocities and spins of the bodies at `t_{n+1/2}`.
    pub velocities: Vec<(Vec2, f64)>,
    /// Bounds of their surfaces' motion, for the step limit.
    pub motions: Vec<SurfaceMotion>,
    /// Largest surface speed in m/s in each part of the bodies, the largest `m v^2` in J/m of a free one, and the largest
    /// spin in rad/s.
    pub most: Vec<[f64; 3]>,
    /// Sum of mass times position in kg of the free ones of each chunk of the bodies.
    pub moments: Vec<Vec2>,
    /// Upper bound of the speed of any surface in m/s.
    pub speed: f64,
    /// Largest `m v^2` in J/m of a body that forces move, in the directions in which they do.
    pub energy: f64,
    /// Largest spin of a body in rad/s.
    pub spin: f64,
}

/// Constants of the step limits, from the configuration.
#[derive(Debug)]
pub(crate) struct LimitConstants {
    /// Largest acceleration of any surface in m/s^2: by gravity, and by gravity and external forces.
    pub outer_accelerations: [f64; 2],
    /// Bound of the squared frequency of two bodies in contact, at any contact point, in 1/s^2.
    pub first_contact: f64,
    /// `(2 / r)^2` with the resolutions `r` of impacts between bodies and of points.
    pub per_resolution_sq: [f64; 2],
}

impl Sdem {
    /// Bytes of memory in use before the first step, when contacts have no lists yet.
    pub fn bytes(&self) -> usize {
        let bodies = self.bodies.properties.iter();
        let trees = bodies.filter_map(|b| b.shape.edges.as_ref());
        let body = size_of::<Body>() + size_of::<Rigid>() + 2 * size_of::<Load>();
        self.bodies.len() * body
            + self.bodies.outline.len() * 2 * size_of::<Vec2>()
            + trees.map(BoxTree::bytes).sum::<usize>()
    }
}
