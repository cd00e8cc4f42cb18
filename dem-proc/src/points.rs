//! Contact between material points and bodies: one signed contact per point and body (Jiang 2020 section 4.1 as
//! PHYSICS.md section 5 reads it).

use std::fmt::Debug;

use interface::Vec2;
use interface::wire::{ImpForce, ImpInfo, ImpState};

use crate::body::{Bodies, Reference};
use crate::contact::{contact_point, see};
use crate::law::{History, Law, Loss, Touch};
use crate::load::Load;
use crate::mass::cross;
use crate::neighbours::{PointList, PointPair, REACH};
use crate::threads::Threads;

/// What the step needs from the contact between points and bodies, whatever the law.
pub trait PointSide: Debug + Send {
    /// Slots are now ordered as `set`.
    fn imp_set(&mut self, set: &[ImpInfo]);
    /// The present set.
    fn set(&self) -> &[ImpInfo];
    /// Builds the list anew if a pair that is not in it could touch.
    fn update_list(&mut self, bodies: &Bodies, states: &[ImpState]);
    /// Evaluates every pair of the list (eqs. 44, 43, 41).
    fn evaluate(&mut self, bodies: &Bodies, states: &[ImpState], dt_before: f64, threads: &Threads);
    /// Sums the evaluated pairs: forces on the points slot by slot (eq. 46), the same numbers negated on the bodies
    /// (eqs. 49, 50).
    fn gather(&self, forces: &mut [ImpForce], loads: &mut [Load]);
    /// Energy dissipated over the last step.
    fn loss(&self) -> Loss;
    /// Energy in the contact springs in J/m.
    fn energy(&self, bodies: &Bodies, states: &[ImpState]) -> f64;
    /// Accepts what was evaluated as the history of the next step.
    fn commit(&mut self, states: &[ImpState]);
    /// Largest damping ratio of the law.
    fn damping_ratio(&self) -> f64;
    /// Bytes of memory.
    fn bytes(&self) -> usize;
}

/// One evaluated pair.
#[derive(Debug, Clone, Copy, Default)]
struct Outcome {
    /// On the point, in N/m.
    force: Vec2,
    /// On the body, in N.
    torque: f64,
    /// `k_n` in N/m where the point is in reach, else 0.
    stiffness: f64,
    /// Share in the body's `Load::rate`.
    rate: f64,
    /// Share in the body's `Load::mobility`.
    mobility: f64,
    /// Whether they touch.
    touching: bool,
}

/// Contact between points and bodies by the law `L`.
#[derive(Debug)]
pub struct PointContacts<L: Law> {
    law: L,
    skin: f64,
    set: Vec<ImpInfo>,
    /// Ids by slot at the time of the last list, where the set was replaced since.
    replaced: Option<Vec<ImpInfo>>,
    list: PointList,
    outcomes: Vec<Outcome>,
    history: Vec<L::History>,
    next: Vec<L::History>,
    /// Positions of the points one step before; empty if the law does not look at motion or there was no step.
    previous: Vec<Vec2>,
    built_at: Vec<Vec2>,
    built_with: Reference,
}

impl<L: Law> PointContacts<L> {
    /// No points yet.
    pub fn new(law: L, skin: f64) -> Self {
        Self {
            law,
            skin,
            set: Vec::new(),
            replaced: None,
            list: PointList::default(),
            outcomes: Vec::new(),
            history: Vec::new(),
            next: Vec::new(),
            previous: Vec::new(),
            built_at: Vec::new(),
            built_with: Reference::default(),
        }
    }

    /// Builds the list; history and previous positions follow the ids.
    fn build(&mut self, bodies: &Bodies, states: &[ImpState]) {
        let old_pairs = std::mem::take(&mut self.list.pairs);
        self.list.build(bodies, &self.set, states, self.skin);
        if size_of::<L::History>() > 0 {
            self.carry_history(&old_pairs, states);
        } else {
            self.history
                .resize(self.list.pairs.len(), L::History::default());
        }
        self.replaced = None;
        self.next
            .resize(self.list.pairs.len(), L::History::default());
        self.outcomes
            .resize(self.list.pairs.len(), Outcome::default());
        self.built_at.clear();
        self.built_at
            .extend(states.iter().map(|s| Vec2::from(s.position)));
        self.built_with.set(bodies);
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
                let key = old_slot(pair.slot as usize).map(|slot| (slot, pair.body));
                let index = key.and_then(|k| {
                    old_pairs
                        .binary_search_by_key(&k, |p| (p.slot, p.body))
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

    /// One pair: geometry, law, contact point.
    #[inline]
    fn pair(
        &self,
        bodies: &Bodies,
        states: &[ImpState],
        dt_before: f64,
        k: usize,
    ) -> (Outcome, L::History) {
        let PointPair { slot, body, .. } = self.list.pairs[k];
        let (state, info) = (&states[slot as usize], &self.set[slot as usize]);
        let rigid = &bodies.state[body as usize];
        let x = Vec2::from(state.position);
        let (overlap, normal) = self.overlap(bodies, x, k);
        let before = &self.history[k];
        let mut outcome = Outcome::default();
        if overlap <= -REACH * info.radius {
            return (outcome, L::History::default());
        }
        let tangent = Vec2::new(-normal.y, normal.x);
        let p = contact_point(x, info.radius, overlap.max(0.0), normal);
        let r = p - rigid.center;
        let (r_n, r_t) = (cross(r, normal), cross(r, tangent));
        let mut touch = Touch {
            overlap,
            ..Touch::default()
        };
        if L::MOTION {
            let was = self.previous.get(slot as usize).copied().unwrap_or(x);
            let moved = if dt_before > 0.0 {
                x - was - rigid.turn.displacement(r)
            } else {
                Vec2::zeros()
            };
            let velocity = Vec2::from(state.velocity) - rigid.velocity_at(r);
            touch.moved = [moved.dot(&normal), moved.dot(&tangent)];
            touch.velocity = [velocity.dot(&normal), velocity.dot(&tangent)];
            touch.mass = 1.0 / (1.0 / info.mass + rigid.inverse_mass);
        }
        if overlap > -REACH * info.radius {
            let [k_n, k_t] = self.law.stiffness(overlap);
            outcome.stiffness = k_n;
            let (m, i) = (rigid.inverse_mass, rigid.inverse_inertia);
            outcome.mobility = m + i * r_n * r_n;
            outcome.rate = k_n * outcome.mobility + k_t * (m + i * r_t * r_t);
        }
        if overlap <= 0.0 {
            return (outcome, self.law.part(&touch, before));
        }
        let press = self.law.press(&touch, before);
        outcome.force = normal * press.normal + tangent * press.tangential;
        outcome.torque = -(r_n * press.normal + r_t * press.tangential);
        outcome.touching = true;
        (outcome, press.history)
    }

    /// Overlap (eq. 44 with the signed distance) and normal of pair `k` for a point at `x`.
    #[inline]
    fn overlap(&self, bodies: &Bodies, x: Vec2, k: usize) -> (f64, Vec2) {
        let PointPair { slot, body, edges } = self.list.pairs[k];
        let candidates = &self.list.edges[edges[0] as usize..edges[1] as usize];
        let outline = bodies.outline_of(body as usize);
        let seen = see(outline, candidates.iter().map(|&i| i as usize), x);
        let contact_distance = bodies.state[body as usize].radius + self.set[slot as usize].radius;
        (contact_distance - seen.distance, seen.normal)
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
        if self.set.is_empty() && self.replaced.is_none() {
            return;
        }
        let moved = || {
            let points = states.iter().zip(&self.built_at);
            let points = points.map(|(s, at)| (Vec2::from(s.position) - at).norm_squared());
            points.fold(0.0, f64::max).sqrt() + self.built_with.travelled(bodies)
        };
        if self.replaced.is_some() || moved() >= self.skin {
            self.build(bodies, states);
        }
    }

    fn evaluate(
        &mut self,
        bodies: &Bodies,
        states: &[ImpState],
        dt_before: f64,
        threads: &Threads,
    ) {
        let mut outcomes = std::mem::take(&mut self.outcomes);
        let mut next = std::mem::take(&mut self.next);
        threads.fill(&mut outcomes, &mut next, |k| {
            self.pair(bodies, states, dt_before, k)
        });
        self.outcomes = outcomes;
        self.next = next;
    }

    fn gather(&self, forces: &mut [ImpForce], loads: &mut [Load]) {
        forces.fill(ImpForce::default());
        for (pair, outcome) in self.list.pairs.iter().zip(&self.outcomes) {
            if outcome.stiffness == 0.0 {
                continue;
            }
            let force = &mut forces[pair.slot as usize];
            force.force[0] += outcome.force.x;
            force.force[1] += outcome.force.y;
            force.stiffness += outcome.stiffness;
            let load = &mut loads[pair.body as usize];
            load.force -= outcome.force;
            load.torque += outcome.torque;
            load.rate += outcome.rate;
            load.mobility += outcome.mobility;
            load.in_reach = true;
            load.contacts += u32::from(outcome.touching);
        }
    }

    fn loss(&self) -> Loss {
        let mut sum = Loss::default();
        if size_of::<L::History>() > 0 {
            for loss in self.next.iter().map(History::loss) {
                sum.friction += loss.friction;
                sum.viscous += loss.viscous;
            }
        }
        sum
    }

    fn energy(&self, bodies: &Bodies, states: &[ImpState]) -> f64 {
        let energy = |k: usize| {
            let x = states[self.list.pairs[k].slot as usize].position.into();
            self.law.energy(self.overlap(bodies, x, k).0, &self.next[k])
        };
        (0..self.list.pairs.len()).map(energy).sum()
    }

    fn commit(&mut self, states: &[ImpState]) {
        std::mem::swap(&mut self.history, &mut self.next);
        if L::MOTION {
            self.previous.clear();
            self.previous
                .extend(states.iter().map(|s| Vec2::from(s.position)));
        }
    }

    fn damping_ratio(&self) -> f64 {
        self.law.damping_ratio()
    }

    fn bytes(&self) -> usize {
        self.list.pairs.capacity() * size_of::<PointPair>()
            + self.list.edges.capacity() * 4
            + self.outcomes.capacity() * size_of::<Outcome>()
            + 2 * self.history.capacity() * size_of::<L::History>()
            + self.set.capacity() * size_of::<ImpInfo>()
    }
}
