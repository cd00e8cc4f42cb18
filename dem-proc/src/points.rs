//! Contact between material points and bodies: one signed contact per point and body (Jiang 2020 section 4.1 as
//! PHYSICS.md section 5 reads it).

use std::fmt::Debug;

use interface::Vec2;
use interface::outline::{contact_point, see};
use interface::wire::{ImpForce, ImpInfo, ImpState};

use crate::body::{Bodies, Odometer};
use crate::law::{Law, Loss, Mates, Past, Touch};
use crate::load::Load;
use crate::mass::cross;
use crate::neighbours::{PointList, PointPair, REACH};
use crate::passage::{CROSSING, Passage, Passed, TURN, admissible_depth, goes_through};
use crate::shape::edge_count;
use crate::threads::Threads;

/// The intervals around `t_n`, as contact sees them.
#[derive(Debug, Clone, Copy)]
pub struct Interval {
    /// The one behind.
    pub past: Past,
    /// How far a point and a surface can come together in the one ahead, in m: a law whose stiffness grows with the
    /// overlap declares what it may be by then.
    pub closing: f64,
}

/// What the step needs from the contact between points and bodies, whatever the law.
pub trait PointSide: Debug + Send {
    /// Slots are now ordered as `set`.
    fn imp_set(&mut self, set: &[ImpInfo]);
    /// The present set.
    fn set(&self) -> &[ImpInfo];
    /// Builds the list anew if a pair that is not in it could touch.
    fn update_list(&mut self, bodies: &Bodies, states: &[ImpState]);
    /// Evaluates every pair of the list (eqs. 44, 43, 41) and sums the forces on the points slot by slot (eq. 46) and
    /// the same numbers negated on the bodies (eqs. 49, 50).
    fn evaluate(
        &mut self,
        bodies: &Bodies,
        states: &[ImpState],
        interval: Interval,
        threads: &Threads,
        forces: &mut [ImpForce],
        loads: &mut [Load],
    );
    /// The first point, in the order of the list, that the last evaluation found too far inside a body.
    fn passed(&self, bodies: &Bodies, states: &[ImpState]) -> Option<Passed>;
    /// Energy dissipated over the last step.
    fn loss(&self) -> Loss;
    /// Energy in the contact springs in J/m.
    fn energy(&self, bodies: &Bodies, states: &[ImpState]) -> f64;
    /// Accepts what was evaluated as the history of the next step.
    fn commit(&mut self, states: &[ImpState]);
    /// Largest damping ratio of a contact in reach; 0 where there is none.
    fn damping_ratio(&self) -> f64;
    /// The bodies move on with surface speeds up to `speed` (m/s) for `dt` (s).
    fn advance(&mut self, speed: f64, dt: f64);
    /// Bytes of memory.
    fn bytes(&self) -> usize;
}

/// One evaluated pair in reach.
#[derive(Debug, Clone, Copy)]
struct Outcome {
    slot: u32,
    body: u32,
    /// On the point, in N/m.
    force: Vec2,
    /// On the body, in N.
    torque: f64,
    /// `k_n` in N/m.
    stiffness: f64,
    /// Share in the body's `Load::rate`.
    rate: f64,
    /// Share in the body's `Load::mobility`.
    mobility: f64,
    /// Dissipated over the last step.
    loss: Loss,
    /// Whether the two press on one another.
    presses: bool,
    /// Whether the point is so deep that it may be on the wrong side.
    deep: bool,
    /// Of the list.
    pair: u32,
}

/// Contact between points and bodies by the law `L`.
#[derive(Debug)]
pub struct PointContacts<L: Law> {
    law: L,
    /// Surface of each point group; empty where the scene has no table of laws.
    surfaces: Vec<u32>,
    skin: f64,
    set: Vec<ImpInfo>,
    /// The set that list and history are still ordered by, where it was replaced since.
    replaced: Option<Vec<ImpInfo>>,
    list: PointList,
    constants: Vec<L::Pair>,
    history: Vec<L::History>,
    next: Vec<L::History>,
    buffers: Vec<Vec<Outcome>>,
    /// Positions of the points one step before; empty if there was no step.
    previous: Vec<Vec2>,
    any_in_reach: bool,
    /// Slot, body and how, of the first point that is too far inside a body.
    passed: Option<(u32, u32, Passage)>,
    loss: Loss,
    built_at: Vec<Vec2>,
    odometer: Odometer,
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
            list: PointList::default(),
            constants: Vec::new(),
            history: Vec::new(),
            next: Vec::new(),
            buffers: Vec::new(),
            previous: Vec::new(),
            any_in_reach: false,
            passed: None,
            loss: Loss::default(),
            built_at: Vec::new(),
            odometer: Odometer::default(),
        }
    }

    /// Builds the list; history and previous positions follow the ids.
    fn build(&mut self, bodies: &Bodies, states: &[ImpState]) {
        let old_pairs = std::mem::take(&mut self.list.pairs);
        self.list.build(bodies, &self.set, states, self.skin);
        self.carry_history(&old_pairs, states);
        self.replaced = None;
        let pairs = &self.list.pairs;
        self.next.resize(pairs.len(), L::History::default());
        self.constants.clear();
        self.constants.extend(pairs.iter().map(|pair| {
            let (info, body) = (
                &self.set[pair.slot as usize],
                &bodies.state[pair.body as usize],
            );
            let of_point = self.surfaces.get(info.group as usize).copied().unwrap_or(0);
            self.law.pair(&Mates {
                mass: 1.0 / (1.0 / info.mass + body.inverse_mass),
                radius: crate::law::reduced(
                    info.radius,
                    bodies.radius_at(pair.body as usize, pair.part),
                ),
                surfaces: [of_point, bodies.fixed[pair.body as usize].surface],
            })
        }));
        self.built_at.clear();
        self.built_at
            .extend(states.iter().map(|s| Vec2::from(s.position)));
        self.odometer.reset(bodies);
    }

    fn carry_history(&mut self, old_pairs: &[PointPair], states: &[ImpState]) {
        let old_history = std::mem::take(&mut self.history);
        let mut by_id: Vec<(u64, u32)> = Vec::new();
        if let Some(old_set) = &self.replaced {
            by_id.extend(old_set.iter().zip(0..).map(|(info, slot)| (info.id, slot)));
            by_id.sort_unstable();
        }
        let replaced = self.replaced.is_some();
        let old_slot = |slot: usize| {
            if !replaced {
                return Some(slot as u32);
            }
            let id = self.set[slot].id;
            let found = by_id.binary_search_by_key(&id, |&(id, _)| id);
            found.ok().map(|i| by_id[i].1)
        };
        let pairs = self.list.pairs.iter();
        self.history = pairs
            .map(|pair| {
                let key = old_slot(pair.slot as usize).map(|slot| (slot, pair.body, pair.part));
                let index = key.and_then(|k| {
                    old_pairs
                        .binary_search_by_key(&k, |p| (p.slot, p.body, p.part))
                        .ok()
                });
                index.map_or_else(L::History::default, |i| old_history[i])
            })
            .collect();
        if !self.previous.is_empty() && replaced {
            // A point that is new to the set touched nothing one step ago; where it was does not matter.
            let at = |(slot, state): (usize, &ImpState)| {
                old_slot(slot).map_or(state.position.into(), |old| self.previous[old as usize])
            };
            self.previous = states.iter().enumerate().map(at).collect();
        }
    }

    /// Overlap (eq. 44 with the signed distance) and normal of pair `k` for a point at `x`.
    #[inline]
    fn overlap(&self, bodies: &Bodies, x: Vec2, k: usize) -> (f64, Vec2) {
        let PointPair {
            slot,
            body,
            part,
            edges,
        } = self.list.pairs[k];
        let candidates = &self.list.edges[edges[0] as usize..edges[1] as usize];
        let mut outline = bodies.outline_of(body as usize);
        if !bodies.fixed[body as usize].shape.has_edges {
            outline = &outline[part as usize..=part as usize];
        }
        let seen = see(outline, candidates.iter().map(|&i| i as usize), x);
        let contact_distance =
            bodies.radius_at(body as usize, part) + self.set[slot as usize].radius;
        (contact_distance - seen.distance, seen.normal)
    }

    /// One pair: geometry, law, contact point. `None` out of reach.
    #[inline]
    fn pair(
        &self,
        bodies: &Bodies,
        states: &[ImpState],
        past: Past,
        closing: f64,
        k: usize,
    ) -> Option<(Outcome, L::History)> {
        let PointPair { slot, body, .. } = self.list.pairs[k];
        let (state, info) = (&states[slot as usize], &self.set[slot as usize]);
        let rigid = &bodies.frames[body as usize];
        let x = Vec2::from(state.position);
        let (overlap, normal) = self.overlap(bodies, x, k);
        if overlap <= -REACH * info.radius {
            return None;
        }
        let tangent = Vec2::new(-normal.y, normal.x);
        let p = contact_point(x, info.radius, overlap, normal);
        let r = p - rigid.center;
        let (r_n, r_t) = (cross(r, normal), cross(r, tangent));
        let mut touch = Touch {
            overlap,
            ..Touch::default()
        };
        if L::MOTION {
            // The velocity over the last step from positions, where there was one: that of the grid at the point,
            // which is what the surfaces really did (a FLIP point's own velocity is noisier).
            let was = self.previous.get(slot as usize).filter(|_| past.dt > 0.0);
            if let Some(was) = was {
                let moved = x - was - rigid.displacement(r);
                touch.moved = [moved.dot(&normal), moved.dot(&tangent)];
                touch.velocity = touch.moved.map(|u| u * past.per_dt);
            } else {
                let body = bodies.state[body as usize].velocity_at(r);
                let velocity = Vec2::from(state.velocity) - body;
                touch.velocity = [velocity.dot(&normal), velocity.dot(&tangent)];
            }
        }
        let (constants, before) = (&self.constants[k], &self.history[k]);
        let own = bodies.radius_at(body as usize, self.list.pairs[k].part);
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
            outcome.loss = self.law.part(constants, &touch, before);
            return Some((outcome, L::History::default()));
        }
        let press = self.law.press(constants, &touch, before);
        outcome.force = normal * press.normal + tangent * press.tangential;
        outcome.torque = -(r_n * press.normal + r_t * press.tangential);
        outcome.loss = press.loss;
        Some((outcome, press.history))
    }

    /// Whether the point of pair `k` is too far inside the body ([`crate::passage`]). Nearly none is so deep that it has to
    /// be looked at.
    #[cold]
    fn passage(&self, bodies: &Bodies, states: &[ImpState], k: usize) -> Option<Passage> {
        let PointPair {
            slot, body, part, ..
        } = self.list.pairs[k];
        let x = Vec2::from(states[slot as usize].position);
        let (overlap, normal) = self.overlap(bodies, x, k);
        let radius = self.set[slot as usize].radius;
        if self.went_through(bodies, x, k, normal) {
            Some(Passage::Through)
        } else if overlap - radius > admissible_depth(bodies, body as usize, part) {
            Some(Passage::Deep)
        } else {
            None
        }
    }

    /// Whether the way of a point over the last step, as the body sees it, leads through its outline to where the normal
    /// is another.
    fn went_through(&self, bodies: &Bodies, x: Vec2, k: usize, normal: Vec2) -> bool {
        let PointPair {
            slot, body, part, ..
        } = self.list.pairs[k];
        let Some(was) = self.previous.get(slot as usize) else {
            return false;
        };
        let b = body as usize;
        let frame = &bodies.frames[b];
        let moved = x - was - frame.displacement(x - frame.center);
        let from = x - frame.turned(moved);
        let reach = bodies.radius_at(b, part) + self.set[slot as usize].radius;
        let mut outline = bodies.outline_of(b);
        let has_edges = bodies.fixed[b].shape.has_edges;
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
        self.replaced.get_or_insert(old); // history still has the order of the first of several replacements
    }

    fn set(&self) -> &[ImpInfo] {
        &self.set
    }

    fn update_list(&mut self, bodies: &Bodies, states: &[ImpState]) {
        if self.replaced.is_none() {
            if self.set.is_empty() {
                return;
            }
            let points = states.iter().zip(&self.built_at);
            let points = points.map(|(s, at)| (Vec2::from(s.position) - at).norm_squared());
            let left = self.skin - points.fold(0.0, f64::max).sqrt();
            if left > 0.0 && self.odometer.stays_below(left, bodies) {
                return;
            }
        }
        self.build(bodies, states);
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
        let Interval { past, closing } = interval;
        forces.fill(ImpForce::default());
        let (mut loss, mut any_in_reach, mut passed) = (Loss::default(), false, None);
        let mut next = std::mem::take(&mut self.next);
        let mut buffers = std::mem::take(&mut self.buffers);
        let chunk = |from: usize, next: &mut [L::History], outcomes: &mut Vec<Outcome>| {
            outcomes.clear();
            for (k, next) in next.iter_mut().enumerate() {
                *next = L::History::default();
                if let Some((outcome, history)) = self.pair(bodies, states, past, closing, from + k)
                {
                    outcomes.push(outcome);
                    *next = history;
                }
            }
        };
        threads.chunks(&mut next, &mut buffers, chunk, |outcomes: &Vec<Outcome>| {
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
                    let passage = self.passage(bodies, states, outcome.pair as usize);
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
        let of_pair = |&k: &usize| {
            let pair = &self.list.pairs[k];
            (pair.slot, pair.body) == (slot, body)
        };
        let x = Vec2::from(states[slot as usize].position);
        let overlaps = (0..self.list.pairs.len()).filter(of_pair);
        let overlaps = overlaps.map(|k| self.overlap(bodies, x, k).0);
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
        let energy = |k: usize| {
            let x = states[self.list.pairs[k].slot as usize].position.into();
            let (overlap, _) = self.overlap(bodies, x, k);
            if overlap > 0.0 {
                self.law.energy(&self.constants[k], overlap, &self.next[k])
            } else {
                0.0
            }
        };
        (0..self.list.pairs.len()).map(energy).sum()
    }

    fn commit(&mut self, states: &[ImpState]) {
        std::mem::swap(&mut self.history, &mut self.next);
        self.previous.clear();
        self.previous
            .extend(states.iter().map(|s| Vec2::from(s.position)));
    }

    fn damping_ratio(&self) -> f64 {
        if self.any_in_reach {
            self.law.damping_ratio()
        } else {
            0.0
        }
    }

    fn advance(&mut self, speed: f64, dt: f64) {
        self.odometer.advance(speed, dt);
    }

    fn bytes(&self) -> usize {
        self.list.pairs.capacity() * size_of::<PointPair>()
            + self.list.edges.capacity() * size_of::<u32>()
            + self.constants.capacity() * size_of::<L::Pair>()
            + self.buffers.iter().map(Vec::capacity).sum::<usize>() * size_of::<Outcome>()
            + 2 * self.history.capacity() * size_of::<L::History>()
            + self.previous.capacity() * size_of::<Vec2>()
            + self.set.capacity() * size_of::<ImpInfo>()
    }
}
