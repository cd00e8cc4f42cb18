//! Contact between discs and the segments of a boundary chain (Singer 2022): one contact for each local minimum of the distance
//! along the chain ([`crate::contact::chain`]), by the laws of points.
//!
//! The foot of a contact is a place between two markers, `(1 - s) x_a + s x_b`, and takes the part of a point of their contact
//! radius. Its force is shared by the same shares, so that momentum is exact and the work of the force on the markers is that
//! on the foot. What a contact remembers belongs to the chain and the disc: it is handed to whichever place of the chain the
//! contact has come to.
//!
//! An evaluation commits nothing: `next` and `positions` are taken over by [`PointSide::commit`]. The list of segments near each
//! disc does not change what comes out, so it is made where it is needed, and is not saved.

use core::ops::Range;

use interface::Vec2;
use interface::message::wire::{ContactState, ImpForce, ImpInfo, ImpState};
use interface::solver::Refusal;

use crate::body::bodies::Bodies;
use crate::body::load::Load;
use crate::body::odometer::Odometer;
use crate::contact::chain::{Extremum, Foot, Links, came_through, extrema, shares_within};
use crate::contact::passage::{Passage, Passed, admissible_depth};
use crate::contact::point_side::{Interval, PointSide, SavedPoints};
use crate::contact::set::{SavedChain, restored_set, save_set};
use crate::contact::told::POINT;
use crate::law::history::SavedHistories;
use crate::law::{Law, Loss, Mates, Past, Touch};
use crate::lists::neighbours::REACH;
use crate::saved::{count, finite, refusal};
use crate::threads::Threads;
use mechanics::mass::cross;
use mechanics::outline::contact_point;

/// The segments near a disc.
#[derive(Debug, Clone, Default)]
struct Near {
    body: u32,
    part: u32,
    /// Slots at which they begin, ascending.
    segments: Vec<u32>,
}

/// A contact that pressed in the last step.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Held<H> {
    body: u32,
    part: u32,
    /// Identities of the markers between which it was, and the share of the second.
    ids: [u64; 2],
    s: f64,
    least: bool,
    history: H,
}

/// What an evaluation finds.
#[derive(Debug, Default)]
struct Sums {
    loss: Loss,
    energy: f64,
    /// Smallest reduced mass in reach in kg/m; infinite where there is none.
    lightest: f64,
    passed: Option<Passed>,
    /// Those that press, for frames; a maximum of the distance with its force taken back.
    told: Vec<ContactState>,
}

/// Contact between discs and segments by the law `L`.
#[derive(Debug)]
pub struct SegmentContacts<L: Law> {
    law: L,
    /// Surface of each point group; empty where the scene has no table of laws.
    surfaces: Vec<u32>,
    skin: f64,
    set: Vec<ImpInfo>,
    links: Links,
    /// Positions one step before in m, slot by slot; none where a marker is new or there was no step.
    previous: Vec<Option<Vec2>>,
    held: Vec<Held<L::History>>,
    next: Vec<Held<L::History>>,
    positions: Vec<Vec2>,
    near: Vec<Near>,
    built_at: Vec<Vec2>,
    listed: bool,
    odometer: Odometer,
    sums: Sums,
    found: Vec<Extremum>,
}

impl<L: Law> SegmentContacts<L> {
    /// No markers yet.
    pub fn new(law: L, surfaces: Vec<u32>, skin: f64) -> Self {
        Self {
            law,
            surfaces,
            skin,
            set: Vec::new(),
            links: Links::default(),
            previous: Vec::new(),
            held: Vec::new(),
            next: Vec::new(),
            positions: Vec::new(),
            near: Vec::new(),
            built_at: Vec::new(),
            listed: false,
            odometer: Odometer::default(),
            sums: Sums::default(),
            found: Vec::new(),
        }
    }

    /// Lists the segments near each disc.
    fn list(&mut self, bodies: &Bodies) {
        self.near.clear();
        let ends: Vec<(u32, [Vec2; 2], f64)> = (0..self.set.len() as u32)
            .filter_map(|a| {
                let b = self.links.next(a)?;
                let ends = [a, b].map(|slot| self.positions[slot as usize]);
                let margin = (1.0 + REACH) * self.set[a as usize].radius + self.skin;
                Some((a, ends, margin))
            })
            .collect();
        for body in 0..bodies.len() {
            let (center, extent) = (bodies.state[body].center, bodies.state[body].extent);
            let within = |at: Vec2, &(_, [a, b], margin): &(u32, [Vec2; 2], f64), r: f64| {
                (mechanics::outline::foot(a, b, at).0 - at).norm() <= r + margin
            };
            let around: Vec<_> = ends.iter().filter(|e| within(center, e, extent)).collect();
            if around.is_empty() {
                continue;
            }
            for (part, &at) in (0..).zip(bodies.outline_of(body)) {
                let radius = bodies.radius_at(body, part);
                let near = around.iter().filter(|e| within(at, e, radius));
                let segments: Vec<u32> = near.map(|e| e.0).collect();
                if !segments.is_empty() {
                    self.near.push(Near {
                        body: body as u32,
                        part,
                        segments,
                    });
                }
            }
        }
        self.built_at.clone_from(&self.positions);
        self.odometer.reset(bodies);
        self.listed = true;
    }

    /// Where a contact of the last step is now in m; `None` if its markers are no more in the set.
    fn place(&self, held: &Held<L::History>) -> Option<Vec2> {
        let slot = |id: u64| {
            let found = self.set.binary_search_by_key(&id, |info| info.id);
            found.ok().map(|slot| slot as u32)
        };
        let slots = [slot(held.ids[0])?, slot(held.ids[1])?];
        Some(Foot { slots, s: held.s }.of(&self.positions))
    }

    /// Contacts of the last step of a disc, in [`Self::held`].
    fn held_by(&self, near: &Near) -> Range<usize> {
        let of = |h: &Held<L::History>| (h.body, h.part);
        let disc = (near.body, near.part);
        let first = self.held.partition_point(|h| of(h) < disc);
        first..first + self.held[first..].partition_point(|h| of(h) == disc)
    }

    /// For each extremum of a disc the contact of the last step that it goes on from, if any: that of the same kind nearest to
    /// it, within the way that a foot goes in a step; else what its stretch of the chain goes on from. One that does not press
    /// only ends what nobody else goes on from.
    fn predecessors(&self, bodies: &Bodies, near: &Near, found: &[Extremum]) -> Vec<Option<usize>> {
        let olds: Vec<(usize, Vec2)> = self
            .held_by(near)
            .filter_map(|k| Some((k, self.place(&self.held[k])?)))
            .collect();
        let nearest = |e: &Extremum, taken: &[Option<usize>]| {
            let info = self.set[e.foot.slots[0] as usize];
            let fits = |k: usize| {
                let held = &self.held[k];
                let slot = self.set.binary_search_by_key(&held.ids[0], |info| info.id);
                let same = slot.is_ok_and(|slot| self.set[slot].group == info.group);
                same && held.least == e.least && !taken.contains(&Some(k))
            };
            let far = |at: &Vec2| (at - e.point).norm();
            let olds = olds.iter();
            let olds = olds.filter(|(k, at)| fits(*k) && far(at) <= info.radius);
            olds.min_by(|a, b| far(&a.1).total_cmp(&far(&b.1)))
                .map(|(k, _)| *k)
        };
        let presses: Vec<bool> = found
            .iter()
            .map(|e| self.overlap(bodies, near, e) > 0.0)
            .collect();
        let pressing = found.iter().zip(&presses);
        let mut before: Vec<Option<usize>> = pressing
            .map(|(e, presses)| presses.then(|| nearest(e, &[])).flatten())
            .collect();
        for (i, e) in found.iter().enumerate() {
            if !presses[i] {
                before[i] = nearest(e, &before);
            } else if before[i].is_none() {
                // What has just come apart of another contact of its stretch.
                let mut others = found.iter().zip(&before);
                let of_stretch = others.find_map(|(o, k)| k.filter(|_| o.stretch == e.stretch));
                before[i] = of_stretch;
            }
        }
        before
    }

    /// Overlap of a disc with the chain at an extremum in m.
    fn overlap(&self, bodies: &Bodies, near: &Near, e: &Extremum) -> f64 {
        let own = self.set[e.foot.slots[0] as usize].radius;
        bodies.radius_at(near.body as usize, near.part) + own - e.distance
    }

    /// Adds what becomes of the energy of springs across where contacts of a disc end, and where several go on from one: friction
    /// takes what nobody goes on from, and gives what is counted twice. A maximum counts less than nothing, so a minimum and a
    /// maximum that come together take nothing of one, but for what they have slipped apart.
    fn add_ended(
        &self,
        bodies: &Bodies,
        near: &Near,
        found: &[Extremum],
        before: &[Option<usize>],
        sums: &mut Sums,
    ) {
        let counts = |least: bool| if least { 1 } else { -1 };
        for k in self.held_by(near) {
            let held = &self.held[k];
            let heirs = found.iter().zip(before).filter(|(_, b)| **b == Some(k));
            let go_on: i32 = heirs.map(|(e, _)| counts(e.least)).sum();
            let ended = counts(held.least) - go_on;
            // Markers leave the set where no disc is near, so those of a contact that pressed are there.
            let slot = self.set.binary_search_by_key(&held.ids[0], |info| info.id);
            if let (1.. | ..=-1, Ok(slot)) = (ended, slot) {
                let constants = self.law.pair(&self.mates(bodies, near, slot));
                let loss = self
                    .law
                    .separate(&constants, &Touch::default(), &held.history);
                sums.add_loss(f64::from(ended), loss);
            }
        }
    }

    /// A disc and the marker of a slot.
    fn mates(&self, bodies: &Bodies, near: &Near, slot: usize) -> Mates {
        let (info, body) = (&self.set[slot], near.body as usize);
        let of_group = self.surfaces.get(info.group as usize).copied().unwrap_or(0);
        Mates {
            mass: 1.0 / (1.0 / info.mass + bodies.state[body].inverse_mass),
            radius: bodies.radius_at(body, near.part), // on a flat
            surfaces: [of_group, bodies.properties[body].surface],
        }
    }

    /// What two surfaces have moved relative to one another at a foot, along the normal and across.
    fn motion(
        &self,
        bodies: &Bodies,
        states: &[ImpState],
        (body, past): (usize, Past),
        (e, normal, r): (&Extremum, Vec2, Vec2),
        touch: &mut Touch,
    ) {
        let tangent = Vec2::new(-normal.y, normal.x);
        let [a, b] = e.foot.slots.map(|slot| slot as usize);
        if past.dt > 0.0 {
            // As of points: from positions. A marker that is new touched nothing a step ago.
            let was = |slot: usize| self.previous[slot].unwrap_or(self.positions[slot]);
            let [first, second] = e.foot.shares();
            let was = was(a) * first + was(b) * second;
            let moved = e.point - was - bodies.frames[body].displacement(r);
            touch.moved = [moved.dot(&normal), moved.dot(&tangent)];
            touch.velocity = touch.moved.map(|u| u * past.per_dt);
        } else {
            let [va, vb] = [a, b].map(|slot| Vec2::from(states[slot].velocity));
            let [first, second] = e.foot.shares();
            let of_body = bodies.state[body].velocity_at(r);
            let velocity = va * first + vb * second - of_body;
            touch.velocity = [velocity.dot(&normal), velocity.dot(&tangent)];
        }
    }

    /// Evaluates one extremum of the distance of one disc, and adds what it does. Returns what it remembers if it presses.
    fn press(
        &self,
        on: &Evaluation,
        near: &Near,
        e: &Extremum,
        before: Option<usize>,
        to: &mut Targets,
    ) -> Option<Held<L::History>> {
        let Evaluation {
            bodies,
            states,
            interval: Interval { past, closing },
        } = *on;
        let body = near.body as usize;
        let info = &self.set[e.foot.slots[0] as usize];
        let overlap = self.overlap(bodies, near, e);
        let rigid = &bodies.frames[body];
        let normal = (e.point - bodies.outline_of(body)[near.part as usize]) / e.distance;
        let tangent = Vec2::new(-normal.y, normal.x);
        let r = contact_point(e.point, info.radius, overlap, normal) - rigid.center;
        let (r_n, r_t) = (cross(r, normal), cross(r, tangent));
        let mut touch = Touch {
            overlap,
            ..Touch::default()
        };
        if L::MOTION {
            self.motion(bodies, states, (body, past), (e, normal, r), &mut touch);
        }
        let mates = self.mates(bodies, near, e.foot.slots[0] as usize);
        let constants = self.law.pair(&mates);
        to.sums.lightest = to.sums.lightest.min(mates.mass);
        let k = self.law.stiffness(&constants, overlap + closing);
        if e.least || e.alone {
            let way = 0.5 * info.radius;
            shares_within(&self.links, &self.positions, &e.foot, way, |slot, share| {
                to.forces[slot as usize].stiffness += k.normal * share;
            });
        }
        let load = &mut to.loads[body];
        if e.least {
            let (m, i) = (rigid.inverse_mass, rigid.inverse_inertia);
            let mobility = m + i * r_n * r_n;
            load.rate += k.normal * mobility + k.tangential * (m + i * r_t * r_t);
            load.mobility += mobility;
        }
        let sign = if e.least { 1.0 } else { -1.0 };
        let history = before.map_or_else(L::History::default, |k| self.held[k].history);
        if overlap <= 0.0 {
            to.sums
                .add_loss(sign, self.law.separate(&constants, &touch, &history));
            return None;
        }
        let press = self.law.press(&constants, &touch, &history);
        let force = (normal * press.normal + tangent * press.tangential) * sign;
        load.torque -= sign * (r_n * press.normal + r_t * press.tangential);
        load.contacts += u32::from(e.least);
        self.share(near, e, force, r + rigid.center, to);
        to.sums.add_loss(sign, press.loss);
        to.sums.energy += sign * self.law.energy(&constants, overlap, &press.history);
        let id = |slot: u32| self.set[slot as usize].id;
        Some(Held {
            body: near.body,
            part: near.part,
            ids: e.foot.slots.map(id),
            s: e.foot.s,
            least: e.least,
            history: press.history,
        })
    }

    /// Shares a force (N/m) at `at` (m) by the foot, and takes it from the body.
    fn share(&self, near: &Near, e: &Extremum, force: Vec2, at: Vec2, to: &mut Targets) {
        let load = &mut to.loads[near.body as usize];
        for (slot, share) in e.foot.slots.into_iter().zip(e.foot.shares()) {
            let part = force * share;
            let own = &mut to.forces[slot as usize].force;
            (own[0], own[1]) = (own[0] + part.x, own[1] + part.y);
            load.force -= part;
        }
        let nearer = e.foot.slots[usize::from(e.foot.s > 0.5)];
        to.sums.told.push(ContactState {
            body: near.body.into(),
            other: self.set[nearer as usize].id,
            with: POINT,
            position: at.into(),
            force: (-force).into(),
        });
    }

    /// One disc.
    fn disc(
        &self,
        on: &Evaluation,
        near: &Near,
        found: &mut Vec<Extremum>,
        to: &mut Targets,
        next: &mut Vec<Held<L::History>>,
    ) {
        let body = near.body as usize;
        let center = on.bodies.outline_of(body)[near.part as usize];
        let radius = self.set[near.segments[0] as usize].radius;
        let of_disc = on.bodies.radius_at(body, near.part);
        let contact = of_disc + radius;
        let x = &self.positions;
        extrema(&self.links, x, &near.segments, center, contact, found);
        found.retain(|e| {
            let own = self.set[e.foot.slots[0] as usize].radius;
            e.distance < of_disc + (1.0 + REACH) * own
        });
        let depth = admissible_depth(on.bodies, body, near.part);
        for e in found.iter().filter(|e| e.least) {
            let own = self.set[e.foot.slots[0] as usize].radius;
            let through = came_through(e, own);
            let deep = e.outside && of_disc - e.distance > depth;
            if (through || deep) && to.sums.passed.is_none() {
                to.sums.passed = Some(Passed {
                    id: self.set[e.foot.slots[0] as usize].id,
                    body,
                    passage: if through {
                        Passage::Through
                    } else {
                        Passage::Deep
                    },
                    overlap: of_disc + own - e.distance,
                });
            }
        }
        found.retain(|e| e.outside && e.distance > 0.0);
        let before = self.predecessors(on.bodies, near, found);
        self.add_ended(on.bodies, near, found, &before, &mut to.sums);
        for (e, before) in found.iter().zip(before) {
            next.extend(self.press(on, near, e, before, to));
        }
    }
}

/// What an evaluation looks at.
struct Evaluation<'a> {
    bodies: &'a Bodies,
    states: &'a [ImpState],
    interval: Interval,
}

/// Where an evaluation adds what it finds.
struct Targets<'a> {
    forces: &'a mut [ImpForce],
    loads: &'a mut [Load],
    sums: Sums,
}

impl Sums {
    fn add_loss(&mut self, sign: f64, loss: Loss) {
        self.loss += Loss {
            friction: sign * loss.friction,
            viscous: sign * loss.viscous,
        };
    }
}

impl<L: Law> PointSide for SegmentContacts<L> {
    fn imp_set(&mut self, set: &[ImpInfo]) {
        let was = |id: u64| {
            let slot = self.set.binary_search_by_key(&id, |info| info.id).ok()?;
            self.previous.get(slot).copied().flatten()
        };
        self.previous = set.iter().map(|info| was(info.id)).collect();
        self.set = set.to_vec();
        self.links = Links::of(set);
        self.listed = false;
    }

    fn set(&self) -> &[ImpInfo] {
        &self.set
    }

    fn update_list(&mut self, bodies: &Bodies, states: &[ImpState]) {
        self.positions.clear();
        self.positions
            .extend(states.iter().map(|s| Vec2::from(s.position)));
        if self.listed {
            let moved = self.positions.iter().zip(&self.built_at);
            let moved = moved.map(|(now, at)| (now - at).norm_squared());
            let left = self.skin - moved.fold(0.0, f64::max).sqrt();
            if self.set.is_empty() || left > 0.0 && self.odometer.stays_below(left, bodies) {
                return;
            }
        }
        self.list(bodies);
    }

    fn evaluate(
        &mut self,
        bodies: &Bodies,
        states: &[ImpState],
        interval: Interval,
        _: &Threads,
        forces: &mut [ImpForce],
        loads: &mut [Load],
    ) {
        forces.fill(ImpForce::default());
        let on = Evaluation {
            bodies,
            states,
            interval,
        };
        let mut to = Targets {
            forces,
            loads,
            sums: Sums {
                lightest: f64::INFINITY,
                ..Sums::default()
            },
        };
        let (mut next, mut found) = (
            std::mem::take(&mut self.next),
            std::mem::take(&mut self.found),
        );
        next.clear();
        for near in &self.near {
            self.disc(&on, near, &mut found, &mut to, &mut next);
        }
        let sums = to.sums;
        (self.next, self.found, self.sums) = (next, found, sums);
    }

    fn passed(&self, _: &Bodies, _: &[ImpState]) -> Option<Passed> {
        self.sums.passed
    }

    fn loss(&self) -> Loss {
        self.sums.loss
    }

    fn energy(&self, _: &Bodies, _: &[ImpState]) -> f64 {
        self.sums.energy
    }

    fn tell(&self, _: &Bodies, _: &[ImpState], _: Past, found: &mut Vec<ContactState>) {
        found.extend_from_slice(&self.sums.told);
    }

    fn keep_list(&mut self) {}

    fn commit(&mut self) {
        std::mem::swap(&mut self.held, &mut self.next);
        self.previous.clear();
        self.previous
            .extend(self.positions.iter().copied().map(Some));
    }

    fn damping_ratio(&self) -> f64 {
        if self.sums.lightest < f64::INFINITY {
            self.law.damping_ratio(self.sums.lightest)
        } else {
            0.0
        }
    }

    fn advance(&mut self, speed: f64, dt: f64) {
        self.odometer.advance(speed, dt);
    }

    fn bytes(&self) -> usize {
        let near = self.near.iter().map(|near| near.segments.capacity());
        near.sum::<usize>() * size_of::<u32>()
            + self.near.capacity() * size_of::<Near>()
            + (self.held.capacity() + self.next.capacity()) * size_of::<Held<L::History>>()
            + (self.positions.capacity() + self.built_at.capacity()) * size_of::<Vec2>()
            + self.previous.capacity() * size_of::<Option<Vec2>>()
            + self.set.capacity() * (size_of::<ImpInfo>() + 2 * size_of::<Option<u32>>())
    }

    fn save(&self) -> SavedPoints {
        let Self {
            set,
            previous,
            held,
            // Of the configuration.
            law: _,
            surfaces: _,
            skin: _,
            links: _, // of the set
            // Nothing that comes out depends on the list: it is made anew.
            near: _,
            built_at: _,
            listed: _,
            odometer: _,
            // Of an evaluation, which begins each of them anew.
            next: _,
            positions: _,
            sums: _,
            found: _,
        } = self;
        let histories: Vec<L::History> = held.iter().map(|h| h.history).collect();
        let contact = |h: &Held<L::History>| (h.body, h.part, h.ids, h.s, h.least);
        let chain = SavedChain {
            previous: previous.iter().map(|p| p.map(Into::into)).collect(),
            held: held.iter().map(contact).collect(),
            histories: SavedHistories::of(&histories),
        };
        SavedPoints::of_chain(save_set(set), chain)
    }

    fn restore(&mut self, saved: &SavedPoints, bodies: &Bodies) -> Result<(), Refusal> {
        let Some(chain) = &saved.chain else {
            return Err(refusal("contact with points, and not with segments"));
        };
        let set = restored_set(&saved.set)?;
        count(
            "markers of the step before",
            chain.previous.len(),
            set.len(),
        )?;
        let previous: Vec<[f64; 2]> = chain.previous.iter().flatten().copied().collect();
        finite(|| "a marker".into(), previous.as_flattened())?;
        let histories: Vec<L::History> = chain.histories.restored(chain.held.len())?;
        let mut held = Vec::new();
        for (&(body, part, ids, s, least), history) in chain.held.iter().zip(histories) {
            let of_body = bodies.properties.get(body as usize).map(|b| &b.shape);
            if of_body.is_none_or(|shape| part as usize >= shape.vertices.len()) {
                return Err(refusal(format!("a contact of disc {part} of body {body}")));
            }
            finite(|| "the place of a contact".into(), &[s])?;
            held.push(Held {
                body,
                part,
                ids,
                s,
                least,
                history,
            });
        }
        if !held.is_sorted_by_key(|h| (h.body, h.part)) {
            return Err(refusal("contacts with segments are not in order"));
        }
        self.previous = chain.previous.iter().map(|p| p.map(Into::into)).collect();
        (self.links, self.set, self.held) = (Links::of(&set), set, held);
        self.listed = false;
        Ok(())
    }
}
