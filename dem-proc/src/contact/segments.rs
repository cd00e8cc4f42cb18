//! Contact between discs and the segments of a boundary chain (Singer 2022): one contact for each local minimum of the distance
//! along the chain ([`crate::contact::chain`]), by the laws of points.
//!
//! The foot of a contact is a place between two markers, `(1 - s) x_a + s x_b`. It takes the part of a point with the
//! markers' contact radius, and turns with the mean of their spins. The two markers get force and couple in the proportion
//! `1 - s` to `s`. So momentum is exact, and the work on the markers equals that on the foot. The history of a contact belongs to the
//! span of the chain that presses ([`crate::contact::span`]), and moves with it.
//!
//! An evaluation does not change what is kept: [`Side::keep_list`] takes over `fresh`, and [`Side::commit`] `next`. The list
//! of segments near each disc has no effect on the results.

use interface::Vec2;
use interface::message::wire::{ContactState, ImpForce, ImpInfo, ImpState};
use interface::saved::{pack, unpack};
use interface::solver::Refusal;
use serde::{Deserialize, Serialize};

use crate::body::bodies::Bodies;
use crate::body::load::Load;
use crate::contact::chain::{Extremum, Foot, Links, came_through, extrema, shares_within};
use crate::contact::engine::Listing;
use crate::contact::frame_contacts::{POINT, between};
use crate::contact::impact::Pressing;
use crate::contact::near::{Near, NearSegments};
use crate::contact::passage::{Passage, Passed, admissible_depth};
use crate::contact::point_body::PointBody;
use crate::contact::points::PointWatch;
use crate::contact::side::{Interval, Side, Sums, Targets};
use crate::contact::span::{Held, Memory, Place, Transferred};
use crate::law::history::Numbers;
use crate::law::{Kinematics, LastStep, Law, Loss, PairProperties};
use crate::lists::neighbours::REACH;
use crate::lists::now::{Now, Sets, Slots};
use crate::lists::watch::Watching;
use crate::threads::Threads;
use mechanics::mass::cross;
use mechanics::outline::contact_point;

/// What an evaluation finds.
#[derive(Debug, Default)]
struct Results {
    sums: Sums,
    energy: f64,
    /// Smallest reduced mass of a pair in reach in kg/m.
    lightest: Option<f64>,
    /// The contacts that press, for frames; the force at a maximum of the distance is negated.
    pressing: Vec<ContactState>,
}

/// What is kept from one step to the next.
#[derive(Debug, Serialize, Deserialize)]
#[serde(bound = "H: Numbers")]
struct State<H> {
    watch: PointWatch,
    memory: Memory<H>,
}

/// Contact between discs and segments by the law `L`.
#[derive(Debug)]
pub struct SegmentContacts<L: Law> {
    law: L,
    /// Surface of each point group; empty if the scene has no table of laws.
    surfaces: Vec<u32>,
    state: State<L::History>,
    /// Replaces the watch of the state if the last evaluation built a list.
    fresh: PointWatch,
    rebuilt: bool,
    set: Vec<ImpInfo>,
    links: Links,
    next: Memory<L::History>,
    near: NearSegments,
    results: Results,
    room: Room<L>,
}

/// Buffers for the contacts of a disc. They are kept from disc to disc, so that no step allocates.
#[derive(Debug)]
struct Room<L: Law> {
    found: Vec<Extremum>,
    successors: Vec<Option<usize>>,
    transferred: Transferred<L::History>,
    places: Vec<Place<L::Pair>>,
}

impl<L: Law> Default for Room<L> {
    fn default() -> Self {
        Self {
            found: Vec::new(),
            successors: Vec::new(),
            transferred: Transferred::default(),
            places: Vec::new(),
        }
    }
}

/// Groups of extrema that are connected.
fn spans(found: &[Extremum]) -> impl Iterator<Item = &[Extremum]> {
    found.chunk_by(|a, b| a.span == b.span)
}

impl<L: Law> SegmentContacts<L> {
    /// No markers yet.
    pub fn new(law: L, surfaces: Vec<u32>, skin: f64) -> Self {
        Self {
            law,
            surfaces,
            state: State {
                watch: PointWatch::new(skin),
                memory: Memory::default(),
            },
            fresh: PointWatch::new(skin),
            rebuilt: false,
            set: Vec::new(),
            links: Links::default(),
            next: Memory::default(),
            near: NearSegments::default(),
            results: Results::default(),
            room: Room::default(),
        }
    }

    /// Where markers and bodies were, for the last evaluation.
    fn watch(&self) -> &PointWatch {
        if self.rebuilt {
            &self.fresh
        } else {
            &self.state.watch
        }
    }

    /// Present position in m of a minimum of the last step; `None` if its markers are no longer in the set.
    fn place(&self, held: &Held) -> Option<Vec2> {
        let slots = [self.slot(held.ids[0])?, self.slot(held.ids[1])?];
        let slots = slots.map(|slot| slot as u32);
        Some(Foot { slots, s: held.s }.of(&self.watch().positions))
    }

    /// Slot of a marker, by its id.
    fn slot(&self, id: u64) -> Option<usize> {
        self.set.binary_search_by_key(&id, |info| info.id).ok()
    }

    /// The minima at which a disc pressed in the last step.
    fn held_by(&self, near: &Near) -> &[Held] {
        let disc = (near.body, near.part);
        let all = &self.state.memory.held;
        let first = all.partition_point(|h| (h.body, h.part) < disc);
        let rest = &all[first..];
        &rest[..rest.partition_point(|h| (h.body, h.part) == disc)]
    }

    /// For each minimum of the last step, the span whose minimum is nearest to it, within the distance that a foot
    /// can move in a step.
    fn successors(&self, held: &[Held], found: &[Extremum], successors: &mut Vec<Option<usize>>) {
        let successor = |held: &Held| {
            let (at, old) = (self.place(held)?, self.slot(held.ids[0])?);
            let mut nearest: Option<(usize, f64)> = None;
            for (i, span) in spans(found).enumerate() {
                for e in span.iter().filter(|e| e.least) {
                    let info = self.set[e.foot.slots[0] as usize];
                    let far = (at - e.point).norm();
                    let may = info.group == self.set[old].group && far <= info.radius;
                    if may && nearest.is_none_or(|(_, least)| far < least) {
                        nearest = Some((i, far));
                    }
                }
            }
            nearest.map(|(i, _)| i)
        };
        successors.clear();
        successors.extend(held.iter().map(successor));
    }

    /// Computes the histories with which the spans of a disc continue. Energy of springs that end, part or join,
    /// and that no span takes over, is lost to friction.
    fn continue_springs(&self, bodies: &Bodies, near: &Near, room: &mut Room<L>, to: &mut Results) {
        let held = self.held_by(near);
        let Room {
            found,
            successors,
            transferred,
            ..
        } = room;
        self.successors(held, found, successors);
        transferred.transfer(
            held,
            &self.state.memory.springs,
            successors,
            spans(found).count(),
        );
        let ended = transferred.ended.iter().map(|spring| (1.0, spring));
        let begun = transferred.begun.iter().map(|spring| (-1.0, spring));
        for (sign, (from, history)) in ended.chain(begun) {
            // Markers leave the set only where no disc is near, so those of a contact that pressed are still in it.
            let Some(slot) = self.slot(held[*from].ids[0]) else {
                continue;
            };
            let constants = self.law.pair(&self.pair_properties(bodies, near, slot));
            let kinematics = Kinematics::default();
            to.add_loss(sign, self.law.separate(&constants, &kinematics, history));
        }
    }

    /// Overlap of a disc with the chain at an extremum in m.
    fn overlap(&self, bodies: &Bodies, near: &Near, e: &Extremum) -> f64 {
        let own = self.set[e.foot.slots[0] as usize].radius;
        bodies.radius_at(near.body as usize, near.part) + own - e.distance
    }

    /// The constants of a disc and the marker of a slot.
    fn pair_properties(&self, bodies: &Bodies, near: &Near, slot: usize) -> PairProperties {
        let (info, body) = (&self.set[slot], near.body as usize);
        let of_group = self.surfaces.get(info.group as usize).copied().unwrap_or(0);
        PairProperties {
            mass: 1.0 / (1.0 / info.mass + bodies.state[body].inverse_mass),
            radius: bodies.radius_at(body, near.part), // the chain is flat
            surfaces: [of_group, bodies.properties[body].surface],
        }
    }

    /// Adds `share` of the relative displacement of the two surfaces at a foot, along the normal and the tangent.
    fn add_motion(
        &self,
        on: &Evaluation,
        body: usize,
        place: &Place<L::Pair>,
        share: f64,
        kinematics: &mut Kinematics,
    ) {
        let Evaluation {
            bodies,
            states,
            interval: Interval { last_step, .. },
        } = *on;
        let Place {
            e,
            normal,
            tangent,
            r,
            surface,
            ..
        } = place;
        let [a, b] = e.foot.slots.map(|slot| slot as usize);
        let [first, second] = e.foot.shares();
        let spin = states[a].spin * first + states[b].spin * second;
        let turning = tangent * (-surface * spin);
        let (moved, [way, speed]) = if last_step.dt > 0.0 {
            // From positions, as for points. A marker that is new touched nothing one step ago.
            let [Some(was_a), Some(was_b)] = e.foot.slots.map(|slot| self.watch().was(slot)) else {
                return;
            };
            let was = was_a * first + was_b * second;
            let moved = e.point - was - bodies.frames[body].displacement(*r);
            (moved + turning * last_step.dt, [1.0, last_step.per_dt])
        } else {
            let [va, vb] = [a, b].map(|slot| Vec2::from(states[slot].velocity));
            let of_body = bodies.state[body].velocity_at(*r);
            (va * first + vb * second + turning - of_body, [0.0, 1.0])
        };
        let along = [moved.dot(normal), moved.dot(tangent)];
        for (i, moved) in along.into_iter().enumerate() {
            kinematics.moved[i] += share * (moved * way);
            kinematics.velocity[i] += share * (moved * speed);
        }
    }

    /// The geometry and the constants of an extremum. Also adds the stiffness that it may have until the next exchange.
    fn seen(&self, on: &Evaluation, near: &Near, e: &Extremum, to: &mut Target) -> Place<L::Pair> {
        let (bodies, body) = (on.bodies, near.body as usize);
        let info = &self.set[e.foot.slots[0] as usize];
        let overlap = self.overlap(bodies, near, e);
        let rigid = &bodies.frames[body];
        let normal = (e.point - bodies.outline_of(body)[near.part as usize]) / e.distance;
        let tangent = Vec2::new(-normal.y, normal.x);
        let r = contact_point(e.point, info.radius, overlap, normal) - rigid.center;
        let (r_n, r_t) = (cross(r, normal), cross(r, tangent));
        let properties = self.pair_properties(bodies, near, e.foot.slots[0] as usize);
        let constants = self.law.pair(&properties);
        let lightest = to.results.lightest.unwrap_or(f64::INFINITY);
        to.results.lightest = Some(lightest.min(properties.mass));
        let elastic = if overlap > 0.0 {
            self.law.normal(&constants, overlap)
        } else {
            [0.0; 2]
        };
        let place = Place {
            e: *e,
            overlap,
            normal,
            tangent,
            r,
            surface: info.radius - 0.5 * overlap,
            center: rigid.center,
            arms: [r_n, r_t],
            constants,
            elastic,
        };
        let k = (self.law).stiffness(&place.constants, overlap + on.interval.closing);
        let mut kinematics = Kinematics::default();
        self.add_motion(on, body, &place, 1.0, &mut kinematics);
        let pressing = Pressing {
            overlap,
            force: elastic[0],
            stiffness: k.normal,
            width: 0.0,
        };
        let mobility = 1.0 / properties.mass;
        let k = k.times((on.interval.impacts).count(kinematics.velocity[0], mobility, &pressing));
        if e.least || e.alone {
            let way = 0.5 * info.radius;
            shares_within(
                &self.links,
                &self.watch().positions,
                &e.foot,
                way,
                |slot, share| {
                    let of_slot = &mut to.forces[slot as usize];
                    of_slot.stiffness += k.normal * share;
                    of_slot.tangential += k.tangential * share;
                },
            );
        }
        let load = &mut to.loads[body];
        if e.least {
            let (m, i) = (rigid.inverse_mass, rigid.inverse_inertia);
            let mobility = m + i * r_n * r_n;
            load.rate += k.normal * mobility + k.tangential * (m + i * r_t * r_t);
            load.mobility += mobility;
        }
        place
    }

    /// Evaluates the contact of a disc with a span of the chain whose extrema are `places`, and adds the results
    /// ([`crate::contact::span`]).
    fn press(
        &self,
        on: &Evaluation,
        near: &Near,
        (places, history): (&[Place<L::Pair>], &L::History),
        (to, next): (&mut Target, &mut Memory<L::History>),
    ) {
        let body = near.body as usize;
        let minima = || places.iter().filter(|p| p.e.least);
        let deeper = |a: &&Place<L::Pair>, b: &&Place<L::Pair>| a.overlap.total_cmp(&b.overlap);
        let Some(deepest) = minima().max_by(deeper) else {
            // All minima are on the inside. What the maxima subtract has no part in friction.
            for place in places.iter().filter(|p| p.overlap > 0.0) {
                let [spring, pull] = place.elastic;
                self.exert(near, place, [pull - spring, 0.0], to);
                let none = L::History::default();
                to.results.energy -= self.law.energy(&place.constants, place.overlap, &none);
            }
            return;
        };
        let mut kinematics = Kinematics {
            overlap: deepest.overlap,
            ..Kinematics::default()
        };
        if deepest.overlap <= 0.0 {
            self.add_motion(on, body, deepest, 1.0, &mut kinematics);
            let loss = self.law.separate(&deepest.constants, &kinematics, history);
            to.results.add_loss(1.0, loss);
            return;
        }
        let all: f64 = minima().map(|p| p.elastic[0]).sum();
        let share = |p: &Place<L::Pair>| {
            if !p.e.least {
                0.0
            } else if all > 0.0 {
                p.elastic[0] / all
            } else {
                f64::from(u8::from(core::ptr::eq(p, deepest)))
            }
        };
        for place in minima().filter(|p| share(p) > 0.0) {
            self.add_motion(on, body, place, share(place), &mut kinematics);
        }
        let springs: f64 = places.iter().map(|p| p.sign() * p.elastic[0]).sum();
        let springs = springs.max(0.0);
        let response =
            self.law
                .response_to_spring(&deepest.constants, springs, &kinematics, history);
        let mut history = response.history;
        for place in places.iter().filter(|p| p.overlap > 0.0) {
            let (share, sign, [spring, pull]) = (share(place), place.sign(), place.elastic);
            // This extremum has its share of the law's normal force, and the difference between its own spring and its
            // share of all springs.
            let normal = share * response.normal + (sign * spring - share * springs) - sign * pull;
            self.exert(near, place, [normal, share * response.tangential], to);
            to.loads[body].contacts += u32::from(place.e.least);
            // The energy of the tangential spring is added once, with the first minimum.
            let own = if place.e.least {
                core::mem::take(&mut history)
            } else {
                L::History::default()
            };
            let energy = self.law.energy(&place.constants, place.overlap, &own);
            to.results.energy += sign * energy;
            if place.e.least {
                let spring = next.springs.len() as u32;
                next.held.push(self.held(near, place, spring));
            }
        }
        to.results.add_loss(1.0, response.loss);
        next.springs.push(response.history);
    }

    /// The record of a minimum that presses, for the next step.
    fn held(&self, near: &Near, place: &Place<L::Pair>, spring: u32) -> Held {
        let foot = &place.e.foot;
        Held {
            body: near.body,
            part: near.part,
            ids: foot.slots.map(|slot| self.set[slot as usize].id),
            s: foot.s,
            force: place.elastic[0],
            spring,
        }
    }

    /// Divides a force (N/m, along the normal and the tangent) and its moment about the foot between the markers of the foot, and
    /// applies the reaction to the body.
    fn exert(&self, near: &Near, place: &Place<L::Pair>, [n, t]: [f64; 2], to: &mut Target) {
        let force = place.normal * n + place.tangent * t;
        let couple = -place.surface * t;
        let load = &mut to.loads[near.body as usize];
        let ([r_n, r_t], foot) = (place.arms, &place.e.foot);
        load.torque -= r_n * n + r_t * t;
        for (slot, share) in foot.slots.into_iter().zip(foot.shares()) {
            let part = force * share;
            let own = &mut to.forces[slot as usize];
            own.force = (Vec2::from(own.force) + part).into();
            own.couple += couple * share;
            load.force -= part;
        }
        let nearer = foot.slots[usize::from(foot.s > 0.5)];
        let ids = [near.body.into(), self.set[nearer as usize].id];
        let contact = between(ids, POINT, place.r + place.center, -force);
        to.results.pressing.push(contact);
    }

    /// Evaluates the contacts of one disc.
    fn disc(
        &self,
        on: &Evaluation,
        near: &Near,
        room: &mut Room<L>,
        to: &mut Target,
        next: &mut Memory<L::History>,
    ) {
        let body = near.body as usize;
        let center = on.bodies.outline_of(body)[near.part as usize];
        let segments = self.near.of(near);
        let of_disc = on.bodies.radius_at(body, near.part);
        let own = |slot: u32| self.set[slot as usize].radius;
        let (x, found) = (&self.watch().positions, &mut room.found);
        let contact = |slot: u32| of_disc + own(slot);
        extrema(&self.links, x, segments, center, &contact, found);
        found.retain(|e| e.distance < of_disc + (1.0 + REACH) * own(e.foot.slots[0]));
        let depth = admissible_depth(on.bodies, body, near.part);
        for e in found.iter().filter(|e| e.least) {
            let own = own(e.foot.slots[0]);
            let through = came_through(e, own);
            let deep = e.outside && of_disc - e.distance > depth;
            if (through || deep) && to.results.sums.passed.is_none() {
                to.results.sums.passed = Some(Passed::Body {
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
        self.continue_springs(on.bodies, near, room, &mut to.results);
        let Room {
            found,
            transferred,
            places,
            ..
        } = room;
        for (span, history) in spans(found).zip(&transferred.histories) {
            places.clear();
            places.extend(span.iter().map(|e| self.seen(on, near, e, to)));
            self.press(on, near, (places, history), (&mut *to, &mut *next));
        }
    }
}

/// The data that an evaluation reads.
struct Evaluation<'a> {
    bodies: &'a Bodies,
    states: &'a [ImpState],
    interval: Interval,
}

/// Where an evaluation adds its results.
struct Target<'a> {
    forces: &'a mut [ImpForce],
    loads: &'a mut [Load],
    results: Results,
}

impl Results {
    fn add_loss(&mut self, sign: f64, loss: Loss) {
        self.sums.loss += Loss {
            friction: sign * loss.friction,
            viscous: sign * loss.viscous,
        };
    }
}

impl<L: Law> Side for SegmentContacts<L> {
    fn update_list(&mut self, now: &Now, _: &Threads) {
        self.rebuilt = !PointBody::holds(&mut self.state.watch, now);
        if self.rebuilt {
            let watch = &mut self.fresh;
            watch.begin(&self.state.watch, now, &Slots::of(now.sets));
            if now.sets.replaced.is_some() {
                self.set.clone_from(&now.sets.now);
                self.links = Links::of(&self.set);
            }
            let chain = (&self.set[..], &self.links);
            (self.near).list(now.bodies, chain, &watch.built_at, watch.skin);
        }
    }

    fn evaluate(&mut self, now: &Now, interval: Interval, _: &Threads, to: &mut Targets) {
        let on = Evaluation {
            bodies: now.bodies,
            states: now.states,
            interval,
        };
        let mut pressing = std::mem::take(&mut self.results.pressing);
        pressing.clear();
        let mut to = Target {
            forces: &mut *to.forces,
            loads: &mut *to.by_points,
            results: Results {
                pressing,
                ..Results::default()
            },
        };
        let (mut next, mut room) = (
            std::mem::take(&mut self.next),
            std::mem::take(&mut self.room),
        );
        next.clear();
        for near in self.near.discs() {
            self.disc(&on, near, &mut room, &mut to, &mut next);
        }
        let results = to.results;
        (self.next, self.room, self.results) = (next, room, results);
    }

    fn sums(&self) -> &Sums {
        &self.results.sums
    }

    fn energy(&self, _: &Now) -> f64 {
        self.results.energy
    }

    fn collect_contacts(&self, _: &Now, _: LastStep, found: &mut Vec<ContactState>) {
        found.extend_from_slice(&self.results.pressing);
    }

    fn keep_list(&mut self) {
        if std::mem::replace(&mut self.rebuilt, false) {
            std::mem::swap(&mut self.state.watch, &mut self.fresh);
        }
    }

    fn commit(&mut self) {
        self.keep_list();
        std::mem::swap(&mut self.state.memory, &mut self.next);
        self.next.clear(); // steps without points evaluate nothing
        self.state.watch.commit();
    }

    fn damping_ratio(&self) -> f64 {
        let lightest = self.results.lightest;
        lightest.map_or(0.0, |mass| self.law.damping_ratio(mass))
    }

    fn advance(&mut self, speed: f64, dt: f64) {
        self.state.watch.advance(speed, dt);
    }

    fn save(&self) -> Vec<u8> {
        pack("segments", &self.state)
    }

    fn restore(&mut self, saved: &[u8], bodies: &Bodies, sets: &Sets) -> Result<(), Refusal> {
        self.state = unpack("segments", saved)?;
        self.rebuilt = false;
        let watch = &self.state.watch;
        if let Some(then) = watch.bodies_then(bodies) {
            self.set
                .clone_from(sets.replaced.as_ref().unwrap_or(&sets.now));
            self.links = Links::of(&self.set);
            let chain = (&self.set[..], &self.links);
            (self.near).list(&then, chain, &watch.built_at, watch.skin);
        }
        Ok(())
    }
}
