//! Contact between the material points of two groups (Chen 2023 section 3.3). Each point has a circle for contact. Two
//! circles that overlap press on one another, by the same laws as a point and a body.
//!
//! ```text
//! N = (x_a - x_b) / |x_a - x_b|,   xi = r_a + r_b - |x_a - x_b|,   f_a = F_n N + F_t T,   f_b = -f_a
//! ```
//!
//! The surfaces move as the points do. Points have no rotation, so a rotation of the continuum within a step counts as
//! motion along the contact, as in the paper.
//!
//! An evaluation does not change what is kept, as in [`crate::contact::points`].

use std::fmt::Debug;

use interface::Vec2;
use interface::message::wire::{ContactState, ImpForce, ImpInfo, ImpState};
use interface::solver::{Fault, Refusal};
use mechanics::outline::contact_point;
use serde::{Deserialize, Serialize};

use crate::contact::frame_contacts::between_points;
use crate::contact::passage::DEEP;
use crate::contact::point_side::Interval;
use crate::contact::set::{restored_set, save_set};
use crate::contact::versions::Versions;
use crate::law::history::SavedHistories;
use crate::law::{Kinematics, LastStep, Law, Loss, PairProperties, reduced};
use crate::lists::cells::Cells;
use crate::lists::neighbours::REACH;
use crate::parry::Bounds;
use crate::saved::{count, finite, refusal};
use crate::threads::{CHUNK, Threads};

/// What a step needs from the contact between points, for any law.
pub trait PairSide: Debug + Send {
    /// The set was replaced: slots are now in the order of `set`.
    fn imp_set(&mut self, set: &[ImpInfo]);
    /// The points are now at `states`. Builds a new list if a pair that is not in the present one could touch.
    fn update_list(&mut self, states: &[ImpState]);
    /// Evaluates every pair of the list. Adds the forces, slot by slot, and twice the stiffness at both points (F-6).
    fn evaluate(
        &mut self,
        states: &[ImpState],
        interval: Interval,
        threads: &Threads,
        forces: &mut [ImpForce],
    );
    /// The first pair, in the order of the list, that was too deep in the last evaluation.
    fn passed(&self) -> Option<Fault>;
    /// Energy dissipated over the last step.
    fn loss(&self) -> Loss;
    /// Energy in the contact springs in J/m.
    fn energy(&self, states: &[ImpState]) -> f64;
    /// Appends the pairs of the last evaluation that press, with the points at `states`, in the order of the list.
    fn tell(&self, states: &[ImpState], last_step: LastStep, found: &mut Vec<ContactState>);
    /// Keeps the list that was evaluated.
    fn keep_list(&mut self);
    /// Makes the result of the evaluation the history of the next step, and keeps the list.
    fn commit(&mut self);
    /// Largest damping ratio of a contact in reach; 0 if there is none.
    fn damping_ratio(&self) -> f64;
    /// Bytes of memory.
    fn bytes(&self) -> usize;
    /// The data for a saved state.
    fn save(&self) -> SavedPointPairs;
    /// Restores a saved state. A refusal leaves everything unchanged.
    ///
    /// # Errors
    /// A refusal if it was not saved with this configuration.
    fn restore(&mut self, saved: &SavedPointPairs) -> Result<(), Refusal>;
}

/// Which groups touch one another.
#[derive(Debug, Clone, Default)]
pub struct Touching {
    /// One more than the largest index of a group that touches another one.
    groups: usize,
    /// For every two groups, whether they touch.
    pairs: Vec<bool>,
    /// Surface of each group; empty if there is no table of laws.
    surfaces: Vec<u32>,
}

impl Touching {
    /// The groups of `pairs`; `surface` gives the number of a group's surface in the table of laws.
    pub fn new(
        pairs: impl Iterator<Item = [usize; 2]> + Clone,
        surface: impl Fn(usize) -> u32,
    ) -> Self {
        let groups = pairs.clone().flatten().max().map_or(0, |last| last + 1);
        let mut touching = vec![false; groups * groups];
        for [a, b] in pairs {
            (touching[a * groups + b], touching[b * groups + a]) = (true, true);
        }
        Self {
            groups,
            pairs: touching,
            surfaces: (0..groups).map(surface).collect(),
        }
    }

    fn touch(&self, a: u32, b: u32) -> bool {
        let [a, b] = [a as usize, b as usize];
        a.max(b) < self.groups && self.pairs[a * self.groups + b]
    }
}

/// Contact between points in a saved state. The list follows from the positions at which it was built.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct SavedPointPairs {
    /// The records as on the wire.
    set: Vec<u8>,
    replaced: Option<Vec<u8>>,
    /// In m.
    previous: Vec<[f64; 2]>,
    /// In m.
    built_at: Vec<[f64; 2]>,
    histories: SavedHistories,
}

/// Two slots whose points may touch, in ascending order.
type Pair = [u32; 2];

/// One evaluated pair in reach.
#[derive(Debug, Clone, Copy)]
struct Outcome {
    pair: Pair,
    /// On the first point, in N/m; the second one has its negative.
    force: Vec2,
    /// Stiffness in N/m of the stiffer of the normal and the tangential spring.
    stiffness: f64,
    /// Dissipated over the last step.
    loss: Loss,
    /// In m.
    overlap: f64,
}

/// What is kept from one step to the next.
#[derive(Debug)]
struct Kept<L: Law> {
    /// The pairs of the list, in ascending order.
    list: Vec<Pair>,
    constants: Vec<L::Pair>,
    history: Vec<L::History>,
    /// Smallest reduced mass of a pair in kg/m; infinite if there is none.
    lightest: f64,
    /// Positions of the points one step before in m; empty if there was no step.
    previous: Vec<Vec2>,
    /// Positions of the points when the list was built in m.
    built_at: Vec<Vec2>,
}

impl<L: Law> Default for Kept<L> {
    fn default() -> Self {
        Self {
            list: Vec::new(),
            constants: Vec::new(),
            history: Vec::new(),
            lightest: f64::INFINITY,
            previous: Vec::new(),
            built_at: Vec::new(),
        }
    }
}

impl<L: Law> Kept<L> {
    /// Takes history and previous positions from an `old` list, which belongs to the set `was`. They are assigned to
    /// the points of `set` by id.
    fn carry(&mut self, old: &Self, was: &[ImpInfo], set: &[ImpInfo]) {
        // In both sets the slots are ordered by id.
        let slot_of = |id: u64| was.binary_search_by_key(&id, |info| info.id).ok();
        let history = |&[a, b]: &Pair| {
            let [a, b] = [a, b].map(|slot| slot_of(set[slot as usize].id));
            let pair = [a? as u32, b? as u32];
            old.list.binary_search(&pair).ok().map(|i| old.history[i])
        };
        let histories = self
            .list
            .iter()
            .map(|pair| history(pair).unwrap_or_default());
        self.history.clear();
        self.history.extend(histories);
        self.previous.clear();
        if !old.previous.is_empty() {
            // A point that is new to the set touched nothing one step ago, so its previous position has no effect.
            let was_at = |(info, now): (&ImpInfo, &Vec2)| {
                slot_of(info.id).map_or(*now, |slot| old.previous[slot])
            };
            self.previous
                .extend(set.iter().zip(&self.built_at).map(was_at));
        }
    }
}

/// Contact between points by the law `L`.
#[derive(Debug)]
pub struct PointPairs<L: Law> {
    law: L,
    touching: Touching,
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
    /// The first pair that is too deep, and its overlap in m.
    deep: Option<(Pair, f64)>,
    loss: Loss,
}

impl<L: Law> PointPairs<L> {
    /// No points yet.
    pub fn new(law: L, touching: Touching, skin: f64) -> Self {
        Self {
            law,
            touching,
            skin,
            set: Vec::new(),
            replaced: None,
            lists: Versions::default(),
            next: Vec::new(),
            positions: Vec::new(),
            buffers: Vec::new(),
            any_in_reach: false,
            deep: None,
            loss: Loss::default(),
        }
    }

    /// Builds a list for points of a set at these positions (m), with the constants of its pairs.
    fn listed(&self, fresh: &mut Kept<L>, set: &[ImpInfo], positions: &[Vec2]) {
        let mutual = |a: usize, b: usize| self.touching.touch(set[a].group, set[b].group);
        // Each of two points contributes half of the largest distance at which they are listed.
        let boxes: Vec<Bounds> = (set.iter().zip(positions))
            .map(|(info, &x)| {
                let half = (1.0 + 0.5 * REACH) * info.radius + 0.5 * self.skin;
                Bounds::around([x]).grown(half)
            })
            .collect();
        let cells = Cells::new(&boxes);
        fresh.list.clear();
        let mut found = Vec::new();
        for a in 0..set.len() {
            found.clear();
            cells.above(a as u32, &boxes, &mut found);
            let near = found.iter().filter(|&&b| {
                let b = b as usize;
                mutual(a, b)
                    && (positions[a] - positions[b]).norm()
                        <= contact_distance(&set[a], &set[b])
                            + REACH * set[a].radius.min(set[b].radius)
                            + self.skin
            });
            fresh.list.extend(near.map(|&b| [a as u32, b]));
        }
        fresh.constants.clear();
        fresh.constants.extend(fresh.list.iter().map(|&[a, b]| {
            let (a, b) = (&set[a as usize], &set[b as usize]);
            let surface = |info: &ImpInfo| self.touching.surfaces[info.group as usize];
            self.law.pair(&PairProperties {
                mass: reduced(a.mass, b.mass),
                radius: reduced(a.radius, b.radius),
                surfaces: [surface(a), surface(b)],
            })
        }));
        let masses = fresh.list.iter().map(|pair| {
            let [a, b] = pair.map(|slot| set[slot as usize].mass);
            reduced(a, b)
        });
        fresh.lightest = masses.fold(f64::INFINITY, f64::min);
        fresh.built_at.clear();
        fresh.built_at.extend_from_slice(positions);
    }

    /// The data that an evaluation reads.
    fn view<'a>(&'a self, states: &'a [ImpState]) -> View<'a, L> {
        View {
            law: &self.law,
            set: &self.set,
            now: self.lists.current(),
            states,
        }
    }
}

fn contact_distance(a: &ImpInfo, b: &ImpInfo) -> f64 {
    a.radius + b.radius
}

/// Points and their pairs as an evaluation sees them.
struct View<'a, L: Law> {
    law: &'a L,
    set: &'a [ImpInfo],
    now: &'a Kept<L>,
    states: &'a [ImpState],
}

impl<L: Law> View<'_, L> {
    /// Overlap of a pair, and the unit normal from its second point to the first; along x if both are at the same
    /// place.
    #[inline]
    fn overlap(&self, [a, b]: Pair) -> (f64, Vec2) {
        let [a, b] = [a as usize, b as usize];
        let [p, q] = [a, b].map(|slot| Vec2::from(self.states[slot].position));
        let distance = (p - q).norm();
        let normal = if distance > 0.0 {
            (p - q) / distance
        } else {
            Vec2::x()
        };
        (
            contact_distance(&self.set[a], &self.set[b]) - distance,
            normal,
        )
    }

    /// Evaluates one pair: geometry and law. `None` if it is out of reach.
    #[inline]
    fn pair(&self, interval: Interval, k: usize) -> Option<(Outcome, L::History)> {
        let Interval { last_step, closing } = interval;
        let pair = self.now.list[k];
        let [a, b] = pair.map(|slot| slot as usize);
        let (overlap, normal) = self.overlap(pair);
        if overlap <= -REACH * self.set[a].radius.min(self.set[b].radius) {
            return None;
        }
        let tangent = Vec2::new(-normal.y, normal.x);
        let mut kinematics = Kinematics {
            overlap,
            ..Kinematics::default()
        };
        // If there was a step, the velocity is computed from positions, as for a point and a body.
        let previous = &self.now.previous;
        if last_step.dt > 0.0 && !previous.is_empty() {
            let [now_a, now_b] = [a, b].map(|slot| Vec2::from(self.states[slot].position));
            let moved = (now_a - previous[a]) - (now_b - previous[b]);
            kinematics.moved = [moved.dot(&normal), moved.dot(&tangent)];
            kinematics.velocity = kinematics.moved.map(|u| u * last_step.per_dt);
        } else {
            let [v_a, v_b] = [a, b].map(|slot| Vec2::from(self.states[slot].velocity));
            kinematics.velocity = [(v_a - v_b).dot(&normal), (v_a - v_b).dot(&tangent)];
        }
        let (constants, before) = (&self.now.constants[k], &self.now.history[k]);
        let k = self.law.stiffness(constants, overlap + closing);
        let mut outcome = Outcome {
            pair,
            force: Vec2::zeros(),
            stiffness: k.normal.max(k.tangential),
            loss: Loss::default(),
            overlap,
        };
        if overlap <= 0.0 {
            outcome.loss = self.law.separate(constants, &kinematics, before);
            return Some((outcome, L::History::default()));
        }
        let response = self.law.response(constants, &kinematics, before);
        outcome.force = normal * response.normal + tangent * response.tangential;
        outcome.loss = response.loss;
        Some((outcome, response.history))
    }
}

impl<L: Law> PairSide for PointPairs<L> {
    fn imp_set(&mut self, set: &[ImpInfo]) {
        let old = std::mem::replace(&mut self.set, set.to_vec());
        self.replaced.get_or_insert(old); // history still has the order of the first of several replacements
    }

    fn update_list(&mut self, states: &[ImpState]) {
        self.positions.clear();
        let positions = states.iter().map(|s| Vec2::from(s.position));
        self.positions.extend(positions);
        self.lists.rebuilt = false;
        if self.replaced.is_none() {
            let points = self.positions.iter().zip(&self.lists.kept.built_at);
            let points = points.map(|(now, at)| (now - at).norm_squared());
            // Both points of a pair may have moved by this much towards one another.
            if 2.0 * points.fold(0.0, f64::max).sqrt() <= self.skin {
                return;
            }
        }
        let mut fresh = std::mem::take(&mut self.lists.fresh);
        self.listed(&mut fresh, &self.set, &self.positions);
        let was = self.replaced.as_deref().unwrap_or(&self.set);
        fresh.carry(&self.lists.kept, was, &self.set);
        self.lists.fresh = fresh;
        self.lists.rebuilt = true;
    }

    fn evaluate(
        &mut self,
        states: &[ImpState],
        interval: Interval,
        threads: &Threads,
        forces: &mut [ImpForce],
    ) {
        let (mut loss, mut any_in_reach, mut deep) = (Loss::default(), false, None);
        let mut next = std::mem::take(&mut self.next);
        let mut buffers = std::mem::take(&mut self.buffers);
        let view = self.view(states);
        next.resize(view.now.list.len(), L::History::default());
        let chunk = |i: usize, next: &mut [L::History], outcomes: &mut Vec<Outcome>| {
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
        threads.chunks_in_passing(&mut next, &mut buffers, chunk, |outcomes: &Vec<Outcome>| {
            for outcome in outcomes {
                let [a, b] = outcome.pair.map(|slot| slot as usize);
                for (slot, force) in [(a, outcome.force), (b, -outcome.force)] {
                    forces[slot].force[0] += force.x;
                    forces[slot].force[1] += force.y;
                    forces[slot].stiffness += 2.0 * outcome.stiffness;
                }
                loss += outcome.loss;
                any_in_reach = true;
                let most = DEEP * contact_distance(&view.set[a], &view.set[b]);
                if outcome.overlap > most && deep.is_none() {
                    deep = Some((outcome.pair, outcome.overlap));
                }
            }
        });
        self.next = next;
        self.buffers = buffers;
        self.loss = loss;
        self.any_in_reach = any_in_reach;
        self.deep = deep;
    }

    fn passed(&self) -> Option<Fault> {
        let (pair, overlap) = self.deep?;
        let [a, b] = pair.map(|slot| &self.set[slot as usize]);
        Some(Fault::Other(format!(
            "points {} and {} of groups {} and {} overlap by {overlap:.3e} m, which is more than three quarters of \
             their contact distance of {:.3e} m: they would pass through one another; write a stiffer contact or \
             larger contact radii",
            a.id,
            b.id,
            a.group,
            b.group,
            contact_distance(a, b)
        )))
    }

    fn loss(&self) -> Loss {
        self.loss
    }

    fn energy(&self, states: &[ImpState]) -> f64 {
        let view = self.view(states);
        let energy = |k: usize| {
            let (overlap, _) = view.overlap(view.now.list[k]);
            if overlap > 0.0 {
                let constants = &view.now.constants[k];
                self.law.energy(constants, overlap, &self.next[k])
            } else {
                0.0
            }
        };
        (0..view.now.list.len()).map(energy).sum()
    }

    fn tell(&self, states: &[ImpState], last_step: LastStep, found: &mut Vec<ContactState>) {
        let view = self.view(states);
        // The closing distance of the next step affects only the stiffness, not the force.
        let interval = Interval {
            last_step,
            closing: 0.0,
        };
        for k in 0..view.now.list.len() {
            let in_reach = view.pair(interval, k);
            let Some((outcome, _)) = in_reach.filter(|(outcome, _)| outcome.overlap > 0.0) else {
                continue;
            };
            let [a, b] = outcome.pair.map(|slot| &self.set[slot as usize]);
            let (overlap, normal) = view.overlap(outcome.pair);
            let x = states[outcome.pair[0] as usize].position.into();
            let at = contact_point(x, a.radius, overlap, normal);
            found.push(between_points([a.id, b.id], at, outcome.force));
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

    fn bytes(&self) -> usize {
        let kept = |kept: &Kept<L>| {
            kept.list.capacity() * size_of::<Pair>()
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

    fn save(&self) -> SavedPointPairs {
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
            touching: _,
            skin: _,
            // Results of an evaluation; the next one overwrites them.
            next: _,
            positions: _,
            buffers: _,
            any_in_reach: _,
            deep: _,
            loss: _,
        } = self;
        let Kept {
            list: _,      // follows from `built_at` and the set of that time
            constants: _, // follow from the list
            lightest: _,  // likewise
            history,
            previous,
            built_at,
        } = kept;
        let plain = |v: &Vec<Vec2>| v.iter().map(|&v| v.into()).collect();
        SavedPointPairs {
            set: save_set(set),
            replaced: replaced.as_deref().map(save_set),
            previous: plain(previous),
            built_at: plain(built_at),
            histories: SavedHistories::of(history),
        }
    }

    fn restore(&mut self, saved: &SavedPointPairs) -> Result<(), Refusal> {
        let SavedPointPairs {
            set,
            replaced,
            previous,
            built_at,
            histories,
        } = saved;
        let set = restored_set(set)?;
        let replaced = replaced.as_deref().map(restored_set).transpose()?;
        let listed = replaced.as_ref().unwrap_or(&set);
        if !listed.is_sorted_by(|a, b| a.id < b.id) {
            return Err(refusal("the points of pairs are not ordered by id"));
        }
        finite(|| "a point of a pair".into(), previous.as_flattened())?;
        finite(|| "a point of a pair".into(), built_at.as_flattened())?;
        count("points in a list of pairs", built_at.len(), listed.len())?;
        if !previous.is_empty() {
            count("points of the step before", previous.len(), listed.len())?;
        }
        let vectors = |v: &[[f64; 2]]| -> Vec<Vec2> { v.iter().map(|&v| v.into()).collect() };
        let mut kept = Kept::default();
        self.listed(&mut kept, listed, &vectors(built_at));
        kept.history = histories.restored(kept.list.len())?;
        kept.previous = vectors(previous);
        self.lists.kept = kept;
        (self.set, self.replaced, self.lists.rebuilt) = (set, replaced, false);
        Ok(())
    }
}
