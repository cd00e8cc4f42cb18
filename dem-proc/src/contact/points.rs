//! Contacts of material points: lists, histories, evaluation and saved state, for any law and any [`Geometry`] of a
//! pair. Points touch bodies ([`crate::contact::point_body`]) and one another ([`crate::contact::point_pairs`]).
//!
//! An evaluation does not change the state that is kept between steps ([`Kept`]). It writes its results to separate
//! fields: histories to `next`, positions of the points to `positions`, a new list to `fresh`. [`PointSide::commit`]
//! and [`PointSide::keep_list`] then make them the kept state.

use std::fmt::Debug;

use interface::Vec2;
use interface::message::wire::{ContactState, ImpForce, ImpInfo, ImpState};
use interface::saved::{pack, unpack};
use interface::solver::Refusal;
use serde::{Deserialize, Serialize};

use crate::body::bodies::Bodies;
use crate::body::displacement::Displacement;
use crate::body::load::Load;
use crate::contact::impact::{Impacts, Pressing};
use crate::contact::passage::Passed;
use crate::contact::point_side::{Interval, PointSide};
use crate::contact::versions::Versions;
use crate::law::history::Numbers;
use crate::law::{Kinematics, LastStep, Law, Loss, PairProperties, Stiffness};
use crate::saved::one_for_each;
use crate::threads::{CHUNK, Threads};

/// A kind of pairs of which at least one side is a point: which are near, where they touch, and on what their force acts.
pub trait Geometry: Debug + Send + Sync {
    /// The pairs of a list, with what belongs to them.
    type List: Debug + Default + Send + Sync;
    /// Two that may touch.
    type Pair: Copy + Debug + Send + Sync;
    /// Lever arms of a contact.
    type Arms: Copy;
    /// What a contact adds to sums, beside force and loss, and to which.
    type Effect: Copy + Debug + Send + Sync;

    /// Finds the pairs within reach plus `skin` (m), with points at `positions` (m).
    fn list(
        &self,
        bodies: &Bodies,
        set: &[ImpInfo],
        positions: &[Vec2],
        skin: f64,
        list: &mut Self::List,
    );
    /// The pairs, in ascending order of their keys.
    fn pairs(list: &Self::List) -> &[Self::Pair];
    /// Bytes of memory of a list.
    fn bytes(list: &Self::List) -> usize;
    /// Key of a pair whose points are in other slots; `None` if one of them is in none.
    fn key(pair: Self::Pair, slot: impl Fn(u32) -> Option<u32>) -> Option<[u32; 3]>;
    /// Whether a list still holds all pairs that may touch. Points have moved by up to `moved` (m) since it was built,
    /// bodies by `displacement`.
    fn holds(displacement: &mut Displacement, bodies: &Bodies, skin: f64, moved: f64) -> bool;
    /// The constants of a pair for its law.
    fn properties(&self, bodies: &Bodies, set: &[ImpInfo], pair: Self::Pair) -> PairProperties;
    /// Distance in m up to which two that do not touch are in reach.
    fn reach(on: &On<Self>, pair: Self::Pair) -> f64;
    /// Overlap in m, and the unit normal towards the (first) point.
    fn overlap(on: &On<Self>, pair: Self::Pair) -> (f64, Vec2);
    /// The lever arms of a contact with this overlap and normal.
    fn arms(on: &On<Self>, pair: Self::Pair, at: (f64, Vec2)) -> Self::Arms;
    /// Relative displacement of the two surfaces over the last step (s) in m; `None` if there was none.
    fn moved(on: &On<Self>, pair: Self::Pair, arms: &Self::Arms, dt: f64) -> Option<Vec2>;
    /// Relative velocity of the two surfaces in m/s, if there was no step.
    fn velocity(on: &On<Self>, pair: Self::Pair, arms: &Self::Arms) -> Vec2;
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

/// Where a point was that is new to the set.
const NOT_KNOWN: Vec2 = Vec2::new(f64::NAN, f64::NAN);

/// Points and bodies as an evaluation sees them.
#[derive(Debug)]
pub struct On<'a, G: Geometry + ?Sized> {
    /// The bodies.
    pub bodies: &'a Bodies,
    /// The set of the points.
    pub set: &'a [ImpInfo],
    /// Their states.
    pub states: &'a [ImpState],
    /// Their positions one step before in m, NaN for points that are new to the set; empty if there was no step.
    previous: &'a [Vec2],
    /// The list.
    pub list: &'a G::List,
}

impl<G: Geometry> On<'_, G> {
    /// Displacement in m of the point of a slot over the last step; `None` if it is new to the set, or there was no step.
    #[inline]
    pub fn way(&self, slot: u32) -> Option<Vec2> {
        let was = self.previous.get(slot as usize)?;
        (!was.x.is_nan()).then(|| self.position(slot) - was)
    }

    /// Velocity in m/s at which the spin of the point of a slot moves what lies at `arm` (m) from it.
    #[inline]
    pub fn turning(&self, slot: u32, arm: Vec2) -> Vec2 {
        if toggle(0) {
            return Vec2::zeros();
        }
        Vec2::new(-arm.y, arm.x) * self.states[slot as usize].spin
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
}

/// The state of the contacts of a list. The list follows from it: from the places of the points and the poses of the
/// bodies at which it was built.
#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(bound = "H: Numbers")]
struct State<H> {
    #[serde(with = "crate::law::history")]
    history: Vec<H>,
    /// Positions of the points one step before in m, NaN for points that are new to the set; empty if there was no step.
    #[serde(with = "crate::saved")]
    previous: Vec<Vec2>,
    /// Positions of the points when the list was built in m.
    #[serde(with = "crate::saved")]
    built_at: Vec<Vec2>,
    displacement: Displacement,
}

/// The state of the set of points.
#[derive(Debug, Default, Serialize, Deserialize)]
struct Sets {
    #[serde(with = "crate::saved")]
    now: Vec<ImpInfo>,
    /// The set to which the order of `kept` belongs, if it was replaced since.
    #[serde(with = "crate::saved")]
    replaced: Option<Vec<ImpInfo>>,
}

/// What is kept from one step to the next.
#[derive(Debug)]
struct Kept<G: Geometry, L: Law> {
    state: State<L::History>,
    list: G::List,
    /// Mobility of a pair as masses of its own, in 1/kg, and its constants.
    constants: Vec<(f64, L::Pair)>,
    /// Smallest reduced mass of a pair in kg/m; infinite if there is none.
    lightest: f64,
}

impl<G: Geometry, L: Law> Default for Kept<G, L> {
    fn default() -> Self {
        Self {
            state: State::default(),
            list: G::List::default(),
            constants: Vec::new(),
            lightest: f64::INFINITY,
        }
    }
}

impl<G: Geometry, L: Law> Kept<G, L> {
    /// Takes history and previous positions from an `old` list. If the set was `replaced`, they are assigned by id to
    /// the points of `set`.
    fn carry(&mut self, old: &Self, replaced: Option<&[ImpInfo]>, set: &[ImpInfo]) {
        let mut by_id: Vec<(u64, u32)> = Vec::new();
        if let Some(old_set) = replaced {
            by_id.extend(old_set.iter().zip(0..).map(|(info, slot)| (info.id, slot)));
            by_id.sort_unstable();
        }
        let old_slot = |slot: u32| {
            if replaced.is_none() {
                return Some(slot);
            }
            let id = set[slot as usize].id;
            let found = by_id.binary_search_by_key(&id, |&(id, _)| id);
            found.ok().map(|i| by_id[i].1)
        };
        let (old_pairs, old) = (G::pairs(&old.list), &old.state);
        let state = &mut self.state;
        state.history.clear();
        let history = |&pair: &G::Pair| {
            let index = G::key(pair, old_slot).and_then(|key| {
                let own = |pair: &G::Pair| G::key(*pair, Some).expect("of this set");
                old_pairs.binary_search_by_key(&key, own).ok()
            });
            index.map_or_else(L::History::default, |i| old.history[i])
        };
        (state.history).extend(G::pairs(&self.list).iter().map(history));
        state.previous.clear();
        if !old.previous.is_empty() {
            let at =
                |slot| old_slot(slot).map_or(NOT_KNOWN, |old_slot| old.previous[old_slot as usize]);
            (state.previous).extend((0..state.built_at.len() as u32).map(at));
        }
    }

    fn bytes(&self) -> usize {
        G::bytes(&self.list)
            + self.constants.capacity() * size_of::<(f64, L::Pair)>()
            + self.state.history.capacity() * size_of::<L::History>()
            + (self.state.previous.capacity() + self.state.built_at.capacity()) * size_of::<Vec2>()
    }
}

/// Contacts of points by the law `L`.
#[derive(Debug)]
pub struct PointContacts<G: Geometry, L: Law> {
    law: L,
    geometry: G,
    skin: f64,
    sets: Sets,
    lists: Versions<Kept<G, L>>,
    next: Vec<L::History>,
    /// Positions of the points in the last evaluation in m.
    positions: Vec<Vec2>,
    buffers: Vec<Vec<Outcome<G::Effect>>>,
    any_in_reach: bool,
    passed: Option<Passed>,
    loss: Loss,
}

impl<G: Geometry, L: Law> PointContacts<G, L> {
    /// No points yet.
    pub fn new(law: L, geometry: G, skin: f64) -> Self {
        Self {
            law,
            geometry,
            skin,
            sets: Sets::default(),
            lists: Versions::default(),
            next: Vec::new(),
            positions: Vec::new(),
            buffers: Vec::new(),
            any_in_reach: false,
            passed: None,
            loss: Loss::default(),
        }
    }

    /// The data that an evaluation reads.
    fn view<'a>(&'a self, bodies: &'a Bodies, states: &'a [ImpState]) -> View<'a, G, L> {
        let now = self.lists.current();
        View {
            law: &self.law,
            now,
            on: On {
                bodies,
                set: &self.sets.now,
                states,
                previous: &now.state.previous,
                list: &now.list,
            },
        }
    }

    /// Builds a list for points of a set at these positions (m), with the constants of its pairs.
    fn listed(&self, fresh: &mut Kept<G, L>, bodies: &Bodies, set: &[ImpInfo], positions: &[Vec2]) {
        (self.geometry).list(bodies, set, positions, self.skin, &mut fresh.list);
        fresh.lightest = f64::INFINITY;
        fresh.constants.clear();
        for &pair in G::pairs(&fresh.list) {
            let properties = self.geometry.properties(bodies, set, pair);
            fresh.lightest = fresh.lightest.min(properties.mass);
            let constants = self.law.pair(&properties);
            fresh.constants.push((1.0 / properties.mass, constants));
        }
    }
}

/// What an evaluation reads.
struct View<'a, G: Geometry, L: Law> {
    law: &'a L,
    now: &'a Kept<G, L>,
    on: On<'a, G>,
}

impl<G: Geometry, L: Law> View<'_, G, L> {
    /// Evaluates one pair: geometry, law, contact point. `None` if it is out of reach.
    #[inline]
    fn pair(&self, interval: Interval, k: usize) -> Option<(Outcome<G::Effect>, L::History)> {
        let Interval {
            last_step,
            closing,
            impacts,
        } = interval;
        let (on, now) = (&self.on, self.now);
        let pair = G::pairs(&now.list)[k];
        let (overlap, normal) = G::overlap(on, pair);
        if overlap <= -G::reach(on, pair) {
            return None;
        }
        let tangent = Vec2::new(-normal.y, normal.x);
        let arms = G::arms(on, pair, (overlap, normal));
        let mut kinematics = Kinematics {
            overlap,
            ..Kinematics::default()
        };
        // If there was a step, the velocity is computed from positions. It is the velocity of the grid at the
        // point, and that of the surfaces; a FLIP point's own velocity is noisier. A point that is new to the set
        // has not moved (docs/physics.md).
        if last_step.dt > 0.0 {
            let moved = G::moved(on, pair, &arms, last_step.dt).unwrap_or_default();
            kinematics.moved = [moved.dot(&normal), moved.dot(&tangent)];
            kinematics.velocity = kinematics.moved.map(|u| u * last_step.per_dt);
        } else {
            let velocity = G::velocity(on, pair, &arms);
            kinematics.velocity = [velocity.dot(&normal), velocity.dot(&tangent)];
        }
        let ((mobility, constants), before) = (&now.constants[k], &now.state.history[k]);
        let (force, loss, history) = if overlap > 0.0 {
            let response = self.law.response(constants, &kinematics, before);
            let force = [response.normal, response.tangential];
            (force, response.loss, response.history)
        } else {
            let loss = self.law.separate(constants, &kinematics, before);
            ([0.0; 2], loss, L::History::default())
        };
        let stiffness = self.law.stiffness(constants, overlap + closing);
        let pressing = Pressing {
            overlap,
            force: force[0],
            stiffness: stiffness.normal,
            width: 0.0,
        };
        let count = impacts.count(kinematics.velocity[0], *mobility, &pressing);
        let outcome = Outcome {
            pair: k as u32,
            deep: G::is_deep(on, pair, overlap),
            overlap,
            force: normal * force[0] + tangent * force[1],
            effect: G::effect(on, pair, &arms, stiffness.times(count), force),
            loss,
        };
        Some((outcome, history))
    }
}

impl<G: Geometry, L: Law> PointSide for PointContacts<G, L> {
    fn imp_set(&mut self, set: &[ImpInfo]) {
        let old = std::mem::replace(&mut self.sets.now, set.to_vec());
        self.sets.replaced.get_or_insert(old); // history still has the order of the set before the first of several replacements
    }

    fn set(&self) -> &[ImpInfo] {
        &self.sets.now
    }

    fn update_list(&mut self, bodies: &Bodies, states: &[ImpState]) {
        self.positions.clear();
        let positions = states.iter().map(|s| Vec2::from(s.position));
        self.positions.extend(positions);
        self.lists.rebuilt = false;
        if self.sets.replaced.is_none() {
            if self.sets.now.is_empty() {
                return;
            }
            let kept = &mut self.lists.kept.state;
            let points = self.positions.iter().zip(&kept.built_at);
            let points = points.map(|(now, at)| (now - at).norm_squared());
            let moved = points.fold(0.0, f64::max).sqrt();
            if G::holds(&mut kept.displacement, bodies, self.skin, moved) {
                return;
            }
        }
        let mut fresh = std::mem::take(&mut self.lists.fresh);
        self.listed(&mut fresh, bodies, &self.sets.now, &self.positions);
        fresh.state.built_at.clone_from(&self.positions);
        fresh.carry(
            &self.lists.kept,
            self.sets.replaced.as_deref(),
            &self.sets.now,
        );
        fresh.state.displacement.reset(bodies);
        self.lists.fresh = fresh;
        self.lists.rebuilt = true;
    }

    fn evaluate(
        &mut self,
        bodies: &Bodies,
        states: &[ImpState],
        interval: Interval,
        threads: &Threads,
        forces: &mut [ImpForce],
        loads: &mut [Load],
    ) {
        let (mut loss, mut any_in_reach, mut passed) = (Loss::default(), false, None);
        let mut next = std::mem::take(&mut self.next);
        let mut buffers = std::mem::take(&mut self.buffers);
        let view = self.view(bodies, states);
        let pairs = G::pairs(view.on.list);
        next.resize(pairs.len(), L::History::default());
        let chunk = |i: usize, next: &mut [L::History], outcomes: &mut Vec<Outcome<G::Effect>>| {
            let from = i * CHUNK;
            outcomes.clear();
            for (k, next) in next.iter_mut().enumerate() {
                *next = L::History::default();
                if let Some((outcome, history)) = view.pair(interval, from + k) {
                    outcomes.push(outcome);
                    *next = history;
                }
            }
        };
        threads.chunks_in_passing(&mut next, &mut buffers, chunk, |outcomes| {
            for outcome in outcomes {
                G::add(outcome, forces, loads);
                loss += outcome.loss;
                any_in_reach = true;
                if outcome.deep && passed.is_none() {
                    let pair = pairs[outcome.pair as usize];
                    passed = G::passed(&view.on, pair, outcome.overlap);
                }
            }
        });
        self.next = next;
        self.buffers = buffers;
        self.loss = loss;
        self.any_in_reach = any_in_reach;
        self.passed = passed;
    }

    fn passed(&self) -> Option<Passed> {
        self.passed
    }

    fn loss(&self) -> Loss {
        self.loss
    }

    fn energy(&self, bodies: &Bodies, states: &[ImpState]) -> f64 {
        let view = self.view(bodies, states);
        let energy = |(k, &pair): (usize, &G::Pair)| {
            let (overlap, _) = G::overlap(&view.on, pair);
            if overlap > 0.0 {
                (self.law).energy(&view.now.constants[k].1, overlap, &self.next[k])
            } else {
                0.0
            }
        };
        G::pairs(view.on.list).iter().enumerate().map(energy).sum()
    }

    fn collect_contacts(
        &self,
        bodies: &Bodies,
        states: &[ImpState],
        last_step: LastStep,
        found: &mut Vec<ContactState>,
    ) {
        let view = self.view(bodies, states);
        // The next step affects only the stiffness, not the force.
        let interval = Interval {
            last_step,
            closing: 0.0,
            impacts: Impacts {
                count: 1.0,
                ..Impacts::default()
            },
        };
        for (k, &pair) in G::pairs(view.on.list).iter().enumerate() {
            let in_reach = view.pair(interval, k);
            if let Some((outcome, _)) = in_reach.filter(|(outcome, _)| outcome.overlap > 0.0) {
                let at = G::overlap(&view.on, pair);
                found.push(G::contact_state(&view.on, pair, at, outcome.force));
            }
        }
    }

    fn keep_list(&mut self) {
        if self.lists.keep() {
            self.sets.replaced = None;
        }
    }

    fn commit(&mut self) {
        self.keep_list();
        let kept = &mut self.lists.kept.state;
        std::mem::swap(&mut kept.history, &mut self.next);
        std::mem::swap(&mut kept.previous, &mut self.positions);
    }

    fn damping_ratio(&self) -> f64 {
        if self.any_in_reach {
            self.law.damping_ratio(self.lists.current().lightest)
        } else {
            0.0
        }
    }

    fn advance(&mut self, speed: f64, dt: f64) {
        self.lists.kept.state.displacement.advance(speed, dt);
    }

    fn bytes(&self) -> usize {
        let buffers = self.buffers.iter().map(Vec::capacity).sum::<usize>();
        self.lists.kept.bytes()
            + self.lists.fresh.bytes()
            + buffers * size_of::<Outcome<G::Effect>>()
            + self.next.capacity() * size_of::<L::History>()
            + self.positions.capacity() * size_of::<Vec2>()
            + self.sets.now.capacity() * size_of::<ImpInfo>()
    }

    fn save(&self) -> Vec<u8> {
        pack("points", &(&self.sets, &self.lists.kept.state))
    }

    fn restore(&mut self, saved: &[u8], bodies: &Bodies) -> Result<(), Refusal> {
        let (sets, state): (Sets, State<L::History>) = unpack("points", saved)?;
        let then = bodies.placed(state.displacement.start().iter().copied());
        let listed = sets.replaced.as_ref().unwrap_or(&sets.now);
        let mut kept = Kept::default();
        self.listed(&mut kept, &then, listed, &state.built_at);
        one_for_each(&state.history, G::pairs(&kept.list).len())?;
        kept.state = state;
        (self.sets, self.lists.kept, self.lists.rebuilt) = (sets, kept, false);
        Ok(())
    }
}

#[allow(missing_docs)]
pub fn toggle(bit: u32) -> bool {
    static BITS: std::sync::OnceLock<u32> = std::sync::OnceLock::new();
    BITS.get_or_init(|| std::env::var("TOGGLE").map_or(0, |v| v.parse().unwrap())) >> bit & 1 == 1
}
