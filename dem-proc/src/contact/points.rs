//! Contacts of material points: the evaluation of a pair, for any [`Geometry`]. Points touch bodies
//! ([`crate::contact::point_body`]) and one another ([`crate::contact::point_pairs`]).

use std::fmt::Debug;

use interface::Vec2;
use interface::message::wire::{ContactState, ImpForce};
use serde::{Deserialize, Serialize};

use crate::body::bodies::Bodies;
use crate::body::displacement::Displacement;
use crate::body::load::Load;
use crate::contact::engine::{Chunk, Listing, On, PairKind};
use crate::contact::passage::Passed;
use crate::contact::side::{Sums, Targets};
use crate::law::{Kinematics, Law, Loss, Stiffness};
use crate::lists::now::{Now, Slots};
use crate::lists::watch::Watching;
use crate::threads::CHUNK;

/// A kind of pairs of which at least one side is a point: where they touch, and on what their force acts.
pub trait Geometry: Listing<Key = [u32; 3], Watch = PointWatch> {
    /// Lever arms of a contact.
    type Arms: Copy;
    /// What a contact adds to sums, beside force and loss, and to which.
    type Effect: Copy + Debug + Send + Sync;

    /// Distance in m up to which two that do not touch are in reach.
    fn reach(on: &On<Self>, pair: Self::Pair) -> f64;
    /// Overlap in m, and the unit normal towards the (first) point.
    fn overlap(on: &On<Self>, pair: Self::Pair) -> (f64, Vec2);
    /// The lever arms of a contact with this overlap and normal.
    fn arms(on: &On<Self>, pair: Self::Pair, at: (f64, Vec2)) -> Self::Arms;
    /// Overlap in m one step before; `None` for a point that is new to the set.
    fn overlap_before(on: &On<Self>, pair: Self::Pair) -> Option<f64>;
    /// Relative displacement of the two surfaces as [`On::moved`] has it; `None` for a point that is new to the set.
    fn moved(on: &On<Self>, pair: Self::Pair, arms: &Self::Arms) -> Option<Vec2>;
    /// What a contact of this stiffness adds to sums, for forces (N/m) along the normal and the tangent.
    fn effect(
        on: &On<Self>,
        pair: Self::Pair,
        arms: &Self::Arms,
        stiffness: Stiffness,
        force: [f64; 2],
    ) -> Self::Effect;
    /// Adds an evaluated pair to the sums of points (eq. 46) and of bodies (eqs. 49, 50).
    fn add(outcome: &Outcome<Self::Effect>, forces: &mut [ImpForce], loads: &mut [Load]);
    /// Whether the overlap (m) is so large that the point may be on the wrong side.
    fn is_deep(on: &On<Self>, pair: Self::Pair, overlap: f64) -> bool;
    /// The passage of a pair that is deep, if it is one ([`crate::contact::passage`]).
    fn passed(on: &On<Self>, pair: Self::Pair, overlap: f64) -> Option<Passed>;
    /// A contact as frames contain it, with the force (N/m) on the (first) point.
    fn contact_state(on: &On<Self>, pair: Self::Pair, at: (f64, Vec2), force: Vec2)
    -> ContactState;
}

/// Adds to the sum of a point.
#[inline]
pub fn add_to_point(sum: &mut ImpForce, part: &ImpForce) {
    sum.force[0] += part.force[0];
    sum.force[1] += part.force[1];
    sum.couple += part.couple;
    sum.stiffness += part.stiffness;
    sum.tangential += part.tangential;
}

/// Where a point was that is new to the set.
const NOT_KNOWN: Vec2 = Vec2::new(f64::NAN, f64::NAN);

impl<G: Geometry> On<'_, G> {
    /// Displacement in m of the point of a slot over the last step; `None` if it is new to the set, or there was no step.
    #[inline]
    pub fn way(&self, slot: u32) -> Option<Vec2> {
        Some(self.position(slot) - self.watch.was(slot)?)
    }

    /// Displacement over the last step of what lies at `arm` (m) from the point of a slot, with the spin of the point;
    /// its velocity in m/s if there was no step. `None` if the point is new to the set.
    #[inline]
    pub fn moved(&self, slot: u32, arm: Vec2) -> Option<Vec2> {
        let state = &self.states[slot as usize];
        let turning = Vec2::new(-arm.y, arm.x) * state.spin;
        let dt = self.interval.last_step;
        if dt > 0.0 {
            Some(self.way(slot)? + turning * dt)
        } else {
            Some(Vec2::from(state.velocity) + turning)
        }
    }

    /// Position of the point of a slot in m.
    #[inline]
    pub fn position(&self, slot: u32) -> Vec2 {
        self.states[slot as usize].position.into()
    }
}

/// One evaluated pair in reach.
#[derive(Debug, Clone, Copy)]
pub struct Outcome<E> {
    /// Index in the list.
    pair: u32,
    /// Whether the overlap is so large that the point may be on the wrong side.
    deep: bool,
    /// In m.
    pub overlap: f64,
    /// Force on the (first) point in N/m.
    pub force: Vec2,
    /// The geometry's own.
    pub effect: E,
    /// Dissipated over the last step.
    loss: Loss,
    /// Energy in J/m of its springs, if that is wanted.
    energy: f64,
}

/// Where points and bodies were when a list was built, and where the points were one step before.
#[derive(Debug, Serialize, Deserialize)]
pub struct PointWatch {
    /// In m.
    pub skin: f64,
    /// Positions of the points one step before in m, NaN for points that are new to the set; empty if there was no step.
    previous: Vec<Vec2>,
    /// Positions of the points when the list was built in m.
    pub built_at: Vec<Vec2>,
    displacement: Displacement,
    /// Positions of the points in the last evaluation in m.
    #[serde(skip)]
    pub positions: Vec<Vec2>,
}

impl Watching for PointWatch {
    fn new(skin: f64) -> Self {
        Self {
            skin,
            previous: Vec::new(),
            built_at: Vec::new(),
            displacement: Displacement::default(),
            positions: Vec::new(),
        }
    }

    fn holds(&mut self, now: &Now, points: u32) -> bool {
        self.positions.clear();
        let positions = now.states.iter().map(|s| Vec2::from(s.position));
        self.positions.extend(positions);
        if now.sets.replaced.is_some() || now.sets.now.is_empty() {
            return now.sets.replaced.is_none();
        }
        let moved = self.positions.iter().zip(&self.built_at);
        let moved = moved.map(|(now, at)| (now - at).norm_squared());
        let left = self.skin - f64::from(points) * moved.fold(0.0, f64::max).sqrt();
        if points == 2 {
            left >= 0.0
        } else {
            left > 0.0 && self.displacement.stays_below(left, now.bodies)
        }
    }

    fn begin(&mut self, old: &Self, now: &Now, slots: &Slots) {
        self.positions.clone_from(&old.positions);
        self.built_at.clone_from(&old.positions);
        self.displacement.reset(now.bodies);
        self.previous.clear();
        if !old.previous.is_empty() {
            let was = |slot| {
                let before = slots.before(slot);
                before.map_or(NOT_KNOWN, |before| old.previous[before as usize])
            };
            (self.previous).extend((0..self.built_at.len() as u32).map(was));
        }
    }

    fn commit(&mut self) {
        std::mem::swap(&mut self.previous, &mut self.positions);
    }

    fn advance(&mut self, speed: f64, dt: f64) {
        self.displacement.advance(speed, dt);
    }

    fn bodies_then(&self, bodies: &Bodies) -> Option<Bodies> {
        Some(bodies.placed(self.displacement.start().iter().copied()))
    }
}

impl PointWatch {
    /// Position in m of the point of a slot one step before; `None` if it is new to the set, or there was no step.
    #[inline]
    pub fn was(&self, slot: u32) -> Option<Vec2> {
        let was = *self.previous.get(slot as usize)?;
        (!was.x.is_nan()).then_some(was)
    }
}

impl<G: Geometry, L: Law> Chunk<'_, G, L> {
    /// Evaluates one pair: geometry, law, contact point. `None` if it is out of reach.
    #[inline]
    fn pair(&self, k: usize) -> Option<(Outcome<G::Effect>, L::History)> {
        let (on, law, pair) = (&self.on, self.law, self.pairs[k]);
        let (overlap, normal) = G::overlap(on, pair);
        if overlap <= -G::reach(on, pair) {
            return None;
        }
        let tangent = Vec2::new(-normal.y, normal.x);
        let arms = G::arms(on, pair, (overlap, normal));
        // If there was a step, the velocity is computed from positions. It is the velocity of the grid at the
        // point, and that of the surfaces; a FLIP point's own velocity is noisier. A point that is new to the set
        // has not moved (docs/physics.md).
        let moved = G::moved(on, pair, &arms).unwrap_or_default();
        let fallen = if on.interval.last_step > 0.0 {
            G::overlap_before(on, pair).map_or(0.0, |before| before - overlap)
        } else {
            moved.dot(&normal)
        };
        let [moved, velocity] = (on.moves).scaled([fallen, moved.dot(&tangent)]);
        let kinematics = Kinematics {
            overlap,
            moved,
            velocity,
            sines: [0.0; 2],
        };
        let (constants, (before, ())) = (&self.constants[k], &self.history[k]);
        let (force, loss, history) = if overlap > 0.0 {
            let response = law.response(constants, &kinematics, before);
            let force = [response.normal, response.tangential];
            (force, response.loss, response.history)
        } else {
            let loss = law.separate(constants, &kinematics, before);
            ([0.0; 2], loss, L::History::default())
        };
        let energy = if overlap > 0.0 && on.interval.measured {
            law.energy(constants, overlap, &history)
        } else {
            0.0
        };
        let stiffness = law.stiffness(constants, overlap + on.interval.closing);
        let (impacts, velocity) = (&on.interval.impacts, kinematics.velocity[0]);
        let stiffness = impacts.counted(stiffness, [overlap, force[0]], velocity, self.mobility[k]);
        let outcome = Outcome {
            pair: (self.number * CHUNK + k) as u32,
            deep: G::is_deep(on, pair, overlap),
            overlap,
            force: normal * force[0] + tangent * force[1],
            effect: G::effect(on, pair, &arms, stiffness, force),
            loss,
            energy,
        };
        Some((outcome, history))
    }
}

impl<G: Geometry> PairKind for G {
    type Memory = ();
    type Found = ();
    type Added = Vec<Outcome<G::Effect>>;
    type Room<L: Law> = ();

    #[inline]
    fn evaluate<L: Law>(
        chunk: &Chunk<Self, L>,
        (): &mut (),
        next: &mut [(L::History, ())],
        ((), added): (&mut (), &mut Self::Added),
    ) {
        added.clear();
        for (k, (next, ())) in next.iter_mut().enumerate() {
            *next = L::History::default();
            if let Some((outcome, history)) = chunk.pair(k) {
                added.push(outcome);
                *next = history;
            }
        }
    }

    #[inline]
    fn add(on: &On<G>, added: &Self::Added, to: &mut Targets, sums: &mut Sums) {
        let (forces, loads) = (&mut *to.forces, &mut *to.by_points);
        for outcome in added {
            G::add(outcome, forces, loads);
            sums.loss += outcome.loss;
            if on.interval.measured && outcome.overlap > 0.0 {
                let pair = on.pairs[outcome.pair as usize];
                let at = G::overlap(on, pair);
                (to.contacts).push(G::contact_state(on, pair, at, outcome.force));
                sums.hold(outcome.energy);
            }
            if outcome.deep && sums.passed.is_none() {
                let pair = on.pairs[outcome.pair as usize];
                sums.passed = G::passed(on, pair, outcome.overlap);
            }
        }
        sums.in_reach += added.len();
    }
}
