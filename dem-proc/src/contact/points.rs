//! Contact between material points and bodies: one signed contact per point and body (Jiang 2020 section 4.1 as
//! docs/physics.md section 5 reads it).
//!
//! An evaluation does not change the state that is kept between steps ([`Kept`]). It writes its results to separate
//! fields: histories to `next`, positions of the points to `positions`, a new list to `fresh`. [`PointSide::commit`]
//! and [`PointSide::keep_list`] then make them the kept state.

use std::fmt::Debug;

use interface::Vec2;
use interface::message::wire::{ContactState, ImpForce, ImpInfo, ImpState};
use interface::solver::Refusal;
use mechanics::outline::{contact_point, see};

use crate::body::bodies::Bodies;
use crate::body::displacement::Displacement;
use crate::body::load::Load;
use crate::body::shape::edge_count;
use crate::contact::frame_contacts::POINT;
use crate::contact::passage::{CROSSING, Passage, Passed, TURN, admissible_depth, goes_through};
use crate::contact::point_side::{Interval, PointSide, SavedPoints};
use crate::contact::set::{restored_set, save_set};
use crate::contact::versions::Versions;
use crate::law::history::SavedHistories;
use crate::law::{Kinematics, LastStep, Law, Loss, PairProperties, reduced_on_outline};
use crate::lists::neighbours::{PointList, PointPair, REACH};
use crate::saved::{count, finite, refusal};
use crate::threads::{CHUNK, Threads};
use mechanics::mass::cross;

/// One evaluated pair in reach.
#[derive(Debug, Clone, Copy)]
struct Outcome {
    slot: u32,
    body: u32,
    /// Force on the point in N/m.
    force: Vec2,
    /// Torque on the body in N.
    torque: f64,
    /// `k_n` in N/m.
    stiffness: f64,
    /// Its contribution to the body's `Load::rate`.
    rate: f64,
    /// Its contribution to the body's `Load::mobility`.
    mobility: f64,
    /// Dissipated over the last step.
    loss: Loss,
    /// Whether the two press on one another.
    presses: bool,
    /// Whether the overlap is so large that the point may be on the wrong side.
    deep: bool,
    /// Index in the list.
    pair: u32,
}

/// What is kept from one step to the next.
#[derive(Debug)]
struct Kept<L: Law> {
    list: PointList,
    constants: Vec<L::Pair>,
    history: Vec<L::History>,
    /// Smallest reduced mass of a pair in kg/m; infinite if there is none.
    lightest: f64,
    /// Positions of the points one step before in m; empty if there was no step.
    previous: Vec<Vec2>,
    /// Positions of the points when the list was built in m.
    built_at: Vec<Vec2>,
    displacement: Displacement,
}

impl<L: Law> Default for Kept<L> {
    fn default() -> Self {
        Self {
            list: PointList::default(),
            constants: Vec::new(),
            history: Vec::new(),
            lightest: f64::INFINITY,
            previous: Vec::new(),
            built_at: Vec::new(),
            displacement: Displacement::default(),
        }
    }
}

impl<L: Law> Kept<L> {
    /// Takes history and previous positions from an `old` list. If the set was `replaced`, they are assigned by id to
    /// the points of `set`.
    fn carry(&mut self, old: &Self, replaced: Option<&[ImpInfo]>, set: &[ImpInfo]) {
        let mut by_id: Vec<(u64, u32)> = Vec::new();
        if let Some(old_set) = replaced {
            by_id.extend(old_set.iter().zip(0..).map(|(info, slot)| (info.id, slot)));
            by_id.sort_unstable();
        }
        let old_slot = |slot: usize| {
            if replaced.is_none() {
                return Some(slot as u32);
            }
            let id = set[slot].id;
            let found = by_id.binary_search_by_key(&id, |&(id, _)| id);
            found.ok().map(|i| by_id[i].1)
        };
        self.history.clear();
        self.history.extend(self.list.pairs.iter().map(|pair| {
            let key = old_slot(pair.slot as usize).map(|slot| (slot, pair.body, pair.part));
            let index = key.and_then(|k| {
                let pairs = &old.list.pairs;
                pairs
                    .binary_search_by_key(&k, |p| (p.slot, p.body, p.part))
                    .ok()
            });
            index.map_or_else(L::History::default, |i| old.history[i])
        }));
        self.previous.clear();
        if !old.previous.is_empty() {
            // A point that is new to the set touched nothing one step ago, so its previous position has no effect.
            let at = |(slot, now): (usize, &Vec2)| {
                old_slot(slot).map_or(*now, |old_slot| old.previous[old_slot as usize])
            };
            let now = self.built_at.iter().enumerate();
            self.previous.extend(now.map(at));
        }
    }
}

/// Contact between points and bodies by the law `L`.
#[derive(Debug)]
pub struct PointContacts<L: Law> {
    law: L,
    /// Surface of each point group; empty where the scene has no table of laws.
    surfaces: Vec<u32>,
    skin: f64,
    set: Vec<ImpInfo>,
    /// The set to which the order of `kept` belongs, if it was replaced since.
    replaced: Option<Vec<ImpInfo>>,
    lists: Versions<Kept<L>>,
    next: Vec<L::History>,
    /// Positions of the points in the last evaluation in m.
    positions: Vec<Vec2>,
    buffers: Vec<Vec<Outcome>>,
    any_in_reach: bool,
    /// Slot, body and kind of passage of the first point that is too far inside a body.
    passed: Option<(u32, u32, Passage)>,
    loss: Loss,
}

impl<L: Law> PointContacts<L> {
    /// No points yet.
    pub fn new(law: L, surfaces: Vec<u32>, skin: f64) -> Self {
        Self {
            law,
            surfaces,
            skin,
            set: Vec::new(),
            replaced: None,
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
    fn view<'a>(&'a self, bodies: &'a Bodies, states: &'a [ImpState]) -> View<'a, L> {
        View {
            law: &self.law,
            set: &self.set,
            now: self.lists.current(),
            bodies,
            states,
        }
    }

    /// Builds a list for points of a set at these positions (m), with the constants of its pairs.
    fn listed(&self, fresh: &mut Kept<L>, bodies: &Bodies, set: &[ImpInfo], positions: &[Vec2]) {
        fresh.list.build(bodies, set, positions, self.skin);
        let pairs = &fresh.list.pairs;
        fresh.constants.clear();
        fresh.constants.extend(pairs.iter().map(|pair| {
            let info = &set[pair.slot as usize];
            let of_point = self.surfaces.get(info.group as usize).copied().unwrap_or(0);
            self.law.pair(&PairProperties {
                mass: reduced_mass(bodies, set, pair),
                radius: reduced_on_outline(
                    info.radius,
                    bodies.radius_at(pair.body as usize, pair.part),
                ),
                surfaces: [of_point, bodies.properties[pair.body as usize].surface],
            })
        }));
        let masses = pairs.iter().map(|pair| reduced_mass(bodies, set, pair));
        fresh.lightest = masses.fold(f64::INFINITY, f64::min);
        fresh.built_at.clear();
        fresh.built_at.extend_from_slice(positions);
    }

    /// Builds a new list; history and previous positions are assigned by id.
    fn build(&mut self, bodies: &Bodies) {
        let mut fresh = std::mem::take(&mut self.lists.fresh);
        self.listed(&mut fresh, bodies, &self.set, &self.positions);
        fresh.carry(&self.lists.kept, self.replaced.as_deref(), &self.set);
        fresh.displacement.reset(bodies);
        self.lists.fresh = fresh;
        self.lists.rebuilt = true;
    }
}

/// Reduced mass of a pair in kg/m.
fn reduced_mass(bodies: &Bodies, set: &[ImpInfo], pair: &PointPair) -> f64 {
    let body = &bodies.state[pair.body as usize];
    1.0 / (1.0 / set[pair.slot as usize].mass + body.inverse_mass)
}

/// Points, bodies and their pairs as an evaluation sees them.
struct View<'a, L: Law> {
    law: &'a L,
    set: &'a [ImpInfo],
    now: &'a Kept<L>,
    bodies: &'a Bodies,
    states: &'a [ImpState],
}

impl<L: Law> View<'_, L> {
    /// Overlap (eq. 44 with the signed distance) and normal of pair `k` for a point at `x`.
    #[inline]
    fn overlap(&self, x: Vec2, k: usize) -> (f64, Vec2) {
        let bodies = self.bodies;
        let PointPair {
            slot,
            body,
            part,
            edges,
        } = self.now.list.pairs[k];
        let candidates = &self.now.list.edges[edges[0] as usize..edges[1] as usize];
        let mut outline = bodies.outline_of(body as usize);
        if !bodies.properties[body as usize].shape.has_edges {
            outline = &outline[part as usize..=part as usize];
        }
        let seen = see(outline, candidates.iter().map(|&i| i as usize), x);
        let contact_distance =
            bodies.radius_at(body as usize, part) + self.set[slot as usize].radius;
        (contact_distance - seen.distance, seen.normal)
    }

    /// Evaluates one pair: geometry, law, contact point. `None` if it is out of reach.
    #[inline]
    fn pair(&self, last_step: LastStep, closing: f64, k: usize) -> Option<(Outcome, L::History)> {
        let (bodies, now) = (self.bodies, self.now);
        let PointPair { slot, body, .. } = self.now.list.pairs[k];
        let (state, info) = (&self.states[slot as usize], &self.set[slot as usize]);
        let rigid = &bodies.frames[body as usize];
        let x = Vec2::from(state.position);
        let (overlap, normal) = self.overlap(x, k);
        if overlap <= -REACH * info.radius {
            return None;
        }
        let tangent = Vec2::new(-normal.y, normal.x);
        let p = contact_point(x, info.radius, overlap, normal);
        let r = p - rigid.center;
        let (r_n, r_t) = (cross(r, normal), cross(r, tangent));
        let mut kinematics = Kinematics {
            overlap,
            ..Kinematics::default()
        };
        // If there was a step, the velocity is computed from positions. It is the velocity of the grid at the
        // point, and that of the surfaces; a FLIP point's own velocity is noisier.
        let was = self
            .now
            .previous
            .get(slot as usize)
            .filter(|_| last_step.dt > 0.0);
        if let Some(was) = was {
            let moved = x - was - rigid.displacement(r);
            kinematics.moved = [moved.dot(&normal), moved.dot(&tangent)];
            kinematics.velocity = kinematics.moved.map(|u| u * last_step.per_dt);
        } else {
            let body = bodies.state[body as usize].velocity_at(r);
            let velocity = Vec2::from(state.velocity) - body;
            kinematics.velocity = [velocity.dot(&normal), velocity.dot(&tangent)];
        }
        let (constants, before) = (&now.constants[k], &now.history[k]);
        let own = bodies.radius_at(body as usize, self.now.list.pairs[k].part);
        let deep = overlap > info.radius.min(own + (1.0 - CROSSING) * info.radius);
        let pair = k as u32;
        let k = self.law.stiffness(constants, overlap + closing);
        let (m, i) = (rigid.inverse_mass, rigid.inverse_inertia);
        let mobility = m + i * r_n * r_n;
        let mut outcome = Outcome {
            slot,
            body,
            force: Vec2::zeros(),
            torque: 0.0,
            stiffness: k.normal,
            mobility,
            rate: k.normal * mobility + k.tangential * (m + i * r_t * r_t),
            loss: Loss::default(),
            presses: overlap > 0.0,
            deep,
            pair,
        };
        if overlap <= 0.0 {
            outcome.loss = self.law.separate(constants, &kinematics, before);
            return Some((outcome, L::History::default()));
        }
        let response = self.law.response(constants, &kinematics, before);
        outcome.force = normal * response.normal + tangent * response.tangential;
        outcome.torque = -(r_n * response.normal + r_t * response.tangential);
        outcome.loss = response.loss;
        Some((outcome, response.history))
    }

    /// Whether the point of pair `k` is too far inside the body ([`crate::contact::passage`]). It is called only for a
    /// large overlap, which is rare.
    #[cold]
    fn passage(&self, k: usize) -> Option<Passage> {
        let bodies = self.bodies;
        let PointPair {
            slot, body, part, ..
        } = self.now.list.pairs[k];
        let x = Vec2::from(self.states[slot as usize].position);
        let (overlap, normal) = self.overlap(x, k);
        let radius = self.set[slot as usize].radius;
        if self.went_through(x, k, normal) {
            Some(Passage::Through)
        } else if overlap - radius > admissible_depth(bodies, body as usize, part) {
            Some(Passage::Deep)
        } else {
            None
        }
    }

    /// Whether the path of a point over the last step, in the frame of the body, passes through the outline to a place
    /// with another normal.
    fn went_through(&self, x: Vec2, k: usize, normal: Vec2) -> bool {
        let bodies = self.bodies;
        let PointPair {
            slot, body, part, ..
        } = self.now.list.pairs[k];
        let Some(was) = self.now.previous.get(slot as usize) else {
            return false;
        };
        let b = body as usize;
        let frame = &bodies.frames[b];
        let moved = x - was - frame.displacement(x - frame.center);
        let from = x - frame.turned(moved);
        let reach = bodies.radius_at(b, part) + self.set[slot as usize].radius;
        let mut outline = bodies.outline_of(b);
        let has_edges = bodies.properties[b].shape.has_edges;
        if !has_edges {
            outline = &outline[part as usize..=part as usize];
        }
        let before = see(outline, 0..edge_count(outline.len()), from);
        before.normal.dot(&normal) < TURN && (!has_edges || goes_through(outline, from, x, reach))
    }
}

impl<L: Law> PointSide for PointContacts<L> {
    fn imp_set(&mut self, set: &[ImpInfo]) {
        let old = std::mem::replace(&mut self.set, set.to_vec());
        self.replaced.get_or_insert(old); // history still has the order of the set before the first of several replacements
    }

    fn set(&self) -> &[ImpInfo] {
        &self.set
    }

    fn update_list(&mut self, bodies: &Bodies, states: &[ImpState]) {
        self.positions.clear();
        let positions = states.iter().map(|s| Vec2::from(s.position));
        self.positions.extend(positions);
        self.lists.rebuilt = false;
        if self.replaced.is_none() {
            if self.set.is_empty() {
                return;
            }
            let points = self.positions.iter().zip(&self.lists.kept.built_at);
            let points = points.map(|(now, at)| (now - at).norm_squared());
            let left = self.skin - points.fold(0.0, f64::max).sqrt();
            if left > 0.0 && self.lists.kept.displacement.stays_below(left, bodies) {
                return;
            }
        }
        self.build(bodies);
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
        let Interval { last_step, closing } = interval;
        forces.fill(ImpForce::default());
        let (mut loss, mut any_in_reach, mut passed) = (Loss::default(), false, None);
        let mut next = std::mem::take(&mut self.next);
        let mut buffers = std::mem::take(&mut self.buffers);
        let view = self.view(bodies, states);
        next.resize(view.now.list.pairs.len(), L::History::default());
        let chunk = |i: usize, next: &mut [L::History], outcomes: &mut Vec<Outcome>| {
            let from = i * CHUNK;
            outcomes.clear();
            for (k, next) in next.iter_mut().enumerate() {
                *next = L::History::default();
                if let Some((outcome, history)) = view.pair(last_step, closing, from + k) {
                    outcomes.push(outcome);
                    *next = history;
                }
            }
        };
        threads.chunks_in_passing(&mut next, &mut buffers, chunk, |outcomes: &Vec<Outcome>| {
            for outcome in outcomes {
                let force = &mut forces[outcome.slot as usize];
                force.force[0] += outcome.force.x;
                force.force[1] += outcome.force.y;
                force.stiffness += outcome.stiffness;
                let load = &mut loads[outcome.body as usize];
                load.force -= outcome.force;
                load.torque += outcome.torque;
                load.rate += outcome.rate;
                load.mobility += outcome.mobility;
                load.contacts += u32::from(outcome.presses);
                loss += outcome.loss;
                any_in_reach = true;
                if outcome.deep && passed.is_none() {
                    let passage = view.passage(outcome.pair as usize);
                    passed = passage.map(|passage| (outcome.slot, outcome.body, passage));
                }
            }
        });
        self.next = next;
        self.buffers = buffers;
        self.loss = loss;
        self.any_in_reach = any_in_reach;
        self.passed = passed;
    }

    fn passed(&self, bodies: &Bodies, states: &[ImpState]) -> Option<Passed> {
        let (slot, body, passage) = self.passed?;
        let view = self.view(bodies, states);
        let pairs = &view.now.list.pairs;
        let of_pair = |&k: &usize| (pairs[k].slot, pairs[k].body) == (slot, body);
        let x = Vec2::from(states[slot as usize].position);
        let overlaps = (0..pairs.len()).filter(of_pair);
        let overlaps = overlaps.map(|k| view.overlap(x, k).0);
        Some(Passed {
            id: self.set[slot as usize].id,
            body: body as usize,
            passage,
            overlap: overlaps.fold(f64::NEG_INFINITY, f64::max),
        })
    }

    fn loss(&self) -> Loss {
        self.loss
    }

    fn energy(&self, bodies: &Bodies, states: &[ImpState]) -> f64 {
        let view = self.view(bodies, states);
        let now = view.now;
        let energy = |k: usize| {
            let x = states[now.list.pairs[k].slot as usize].position.into();
            let (overlap, _) = view.overlap(x, k);
            if overlap > 0.0 {
                self.law.energy(&now.constants[k], overlap, &self.next[k])
            } else {
                0.0
            }
        };
        (0..now.list.pairs.len()).map(energy).sum()
    }

    fn tell(
        &self,
        bodies: &Bodies,
        states: &[ImpState],
        last_step: LastStep,
        found: &mut Vec<ContactState>,
    ) {
        let view = self.view(bodies, states);
        for (k, pair) in view.now.list.pairs.iter().enumerate() {
            let pressing = view
                .pair(last_step, 0.0, k)
                .filter(|(outcome, _)| outcome.presses);
            let Some((outcome, _)) = pressing else {
                continue;
            };
            let info = &self.set[pair.slot as usize];
            let x = states[pair.slot as usize].position.into();
            let (overlap, normal) = view.overlap(x, k);
            found.push(ContactState {
                body: pair.body.into(),
                other: info.id,
                with: POINT,
                position: contact_point(x, info.radius, overlap, normal).into(),
                force: (-outcome.force).into(),
            });
        }
    }

    fn keep_list(&mut self) {
        if self.lists.keep() {
            self.replaced = None;
        }
    }

    fn commit(&mut self) {
        self.keep_list();
        std::mem::swap(&mut self.lists.kept.history, &mut self.next);
        std::mem::swap(&mut self.lists.kept.previous, &mut self.positions);
    }

    fn damping_ratio(&self) -> f64 {
        if self.any_in_reach {
            self.law.damping_ratio(self.lists.current().lightest)
        } else {
            0.0
        }
    }

    fn advance(&mut self, speed: f64, dt: f64) {
        self.lists.kept.displacement.advance(speed, dt);
    }

    fn bytes(&self) -> usize {
        let kept = |kept: &Kept<L>| {
            kept.list.pairs.capacity() * size_of::<PointPair>()
                + kept.list.edges.capacity() * size_of::<u32>()
                + kept.constants.capacity() * size_of::<L::Pair>()
                + kept.history.capacity() * size_of::<L::History>()
                + (kept.previous.capacity() + kept.built_at.capacity()) * size_of::<Vec2>()
        };
        kept(&self.lists.kept)
            + kept(&self.lists.fresh)
            + self.buffers.iter().map(Vec::capacity).sum::<usize>() * size_of::<Outcome>()
            + self.next.capacity() * size_of::<L::History>()
            + self.positions.capacity() * size_of::<Vec2>()
            + self.set.capacity() * size_of::<ImpInfo>()
    }

    fn save(&self) -> SavedPoints {
        let Self {
            set,
            replaced,
            lists:
                Versions {
                    kept,
                    fresh: _,
                    rebuilt: _,
                },
            // These belong to the configuration.
            law: _,
            surfaces: _,
            skin: _,
            // Results of an evaluation; the next one overwrites them.
            next: _,
            positions: _,
            buffers: _,
            any_in_reach: _,
            passed: _,
            loss: _,
        } = self;
        let Kept {
            list: _,      // follows from `built_at`, the set of that time and the displacement's poses
            constants: _, // follow from the list
            lightest: _,  // likewise
            history,
            previous,
            built_at,
            displacement,
        } = kept;
        let plain = |v: &Vec<Vec2>| v.iter().map(|&v| v.into()).collect();
        SavedPoints {
            set: save_set(set),
            replaced: replaced.as_deref().map(save_set),
            previous: plain(previous),
            built_at: plain(built_at),
            displacement: displacement.save(),
            histories: SavedHistories::of(history),
            chain: None,
        }
    }

    fn restore(&mut self, saved: &SavedPoints, bodies: &Bodies) -> Result<(), Refusal> {
        let SavedPoints {
            set,
            replaced,
            previous,
            built_at,
            displacement,
            histories,
            chain,
        } = saved;
        if chain.is_some() {
            return Err(refusal("contact with segments, and not with points"));
        }
        let set = restored_set(set)?;
        let replaced = replaced.as_deref().map(restored_set).transpose()?;
        let listed = replaced.as_ref().unwrap_or(&set);
        let displacement = Displacement::restored(displacement, bodies)?;
        finite(|| "a point".into(), previous.as_flattened())?;
        finite(|| "a point".into(), built_at.as_flattened())?;
        if !previous.is_empty() {
            count("points of the step before", previous.len(), listed.len())?;
        }
        let vectors = |v: &[[f64; 2]]| -> Vec<Vec2> { v.iter().map(|&v| v.into()).collect() };
        let mut kept = Kept::default();
        if displacement.start().is_empty() && !bodies.is_empty() {
            // No list has been built; the next step builds one for the set.
            count("points in no list", built_at.len(), 0)?;
            if !(listed.is_empty() && previous.is_empty()) {
                return Err(refusal("points without a list"));
            }
        } else {
            count("points in a list", built_at.len(), listed.len())?;
            let then = bodies.placed(displacement.start().iter().copied());
            self.listed(&mut kept, &then, listed, &vectors(built_at));
        }
        kept.history = histories.restored(kept.list.pairs.len())?;
        (kept.previous, kept.displacement) = (vectors(previous), displacement);
        self.lists.kept = kept;
        (self.set, self.replaced, self.lists.rebuilt) = (set, replaced, false);
        Ok(())
    }
}
