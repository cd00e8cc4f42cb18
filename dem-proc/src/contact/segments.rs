//! Geometry of discs and the segments of a boundary chain (Singer 2022): one contact for each local minimum of the distance
//! along the chain ([`crate::contact::chain`]), by the laws of points.
//!
//! The foot of a contact is a place between two markers, `(1 - s) x_a + s x_b`. It takes the part of a point with the
//! markers' contact radius, and turns with the mean of their spins. The two markers get force and couple in the proportion
//! `1 - s` to `s`. So momentum is exact, and the work on the markers equals that on the foot. The history of a contact belongs to the
//! span of the chain that presses ([`crate::contact::span`]), and moves with it. So what is listed is a disc with the
//! segments of a group near it, whose memory has all of its spans.

use interface::Vec2;
use interface::message::wire::{ContactState, ImpForce, ImpInfo};

use crate::body::bodies::Bodies;
use crate::body::load::Load;
use crate::contact::chain::{Extremum, Foot, Links, came_through, extrema, shares_within};
use crate::contact::engine::{Chunk, Listing, On, PairKind};
use crate::contact::frame_contacts::{POINT, between};
use crate::contact::passage::{Own, Passage, Passed, admissible_depth};
use crate::contact::point_body::PointBody;
use crate::contact::points::{PointWatch, add_to_point};
use crate::contact::side::{Sums, Targets};
use crate::contact::span::{Held, Memory, Place, Transferred};
use crate::law::history::{All, Numbers};
use crate::law::{Kinematics, Law, Loss, PairProperties};
use crate::lists::neighbours::REACH;
use crate::lists::now::Among;
use mechanics::mass::cross;
use mechanics::outline::{contact_point, foot};

/// Discs and the segments near them; with the surfaces of the points.
#[derive(Debug)]
pub struct Segments(pub PointBody);

/// A disc with segments of a group near it.
#[derive(Debug, Clone, Copy)]
pub struct Disc {
    /// Its body.
    body: u32,
    /// Index of its vertex in the outline of the body.
    part: u32,
    /// The group of the segments.
    group: u32,
    /// Its segments in [`Chain::segments`]: index of the first, and their number, at least one.
    segments: [u32; 2],
    /// The slot of the lightest marker of these segments.
    lightest: u32,
}

/// What belongs to a list of discs.
#[derive(Debug, Default)]
pub struct Chain {
    links: Links,
    /// Slots at which segments begin, ascending for each disc.
    segments: Vec<u32>,
    /// Buffer for the segments around a body. It is kept, so that no step allocates.
    around: Vec<u32>,
}

impl Listing for Segments {
    const POINTS: u32 = 1;
    type Pair = Disc;
    type Key = [u32; 3];
    type Extra = Chain;
    type Watch = PointWatch;

    /// Lists the segments up to the skin farther away than they can matter.
    fn list(&self, among: &Among, watch: &PointWatch, discs: &mut Vec<Disc>, chain: &mut Chain) {
        let Among { bodies, set, .. } = *among;
        let (positions, skin) = (&watch.built_at, watch.skin);
        let Chain {
            links,
            segments,
            around,
        } = chain;
        *links = Links::of(set);
        // Whether the segment that begins at a slot is near a disc of radius `r` (m) around `center` (m).
        let is_near = |from: u32, center: Vec2, r: f64| {
            links.next(from).is_some_and(|to| {
                let [a, b] = [from, to].map(|slot| positions[slot as usize]);
                let margin = (1.0 + REACH) * set[from as usize].radius + skin;
                (foot(a, b, center).0 - center).norm() <= r + margin
            })
        };
        discs.clear();
        segments.clear();
        for (body, state) in bodies.state.iter().enumerate() {
            let all = 0..set.len() as u32;
            around.clear();
            around.extend(all.filter(|&from| is_near(from, state.center, state.extent)));
            for (part, &at) in (0..).zip(bodies.outline_of(body)) {
                let radius = bodies.radius_at(body, part);
                let mut first = segments.len();
                segments.extend(around.iter().filter(|&&from| is_near(from, at, radius)));
                let group = |slot: &u32| set[*slot as usize].group;
                segments[first..].sort_by_key(group);
                for own in segments[first..].chunk_by(|a, b| group(a) == group(b)) {
                    let markers = own.iter().flat_map(|&from| [Some(from), links.next(from)]);
                    let mass = |slot: &u32| set[*slot as usize].mass;
                    let lightest = markers.flatten().min_by(|a, b| mass(a).total_cmp(&mass(b)));
                    discs.extend(lightest.map(|lightest| Disc {
                        body: body as u32,
                        part,
                        group: group(&lightest),
                        segments: [first, own.len()].map(|n| n as u32),
                        lightest,
                    }));
                    first += own.len();
                }
            }
        }
    }

    fn key(disc: Disc, _: impl Fn(u32) -> Option<u32>) -> Option<[u32; 3]> {
        Some([disc.body, disc.part, disc.group])
    }

    /// Those with the lightest marker, whose group has one law: what a contact adds depends on where it is.
    fn properties(&self, among: &Among, disc: Disc) -> PairProperties {
        self.of_marker(among.bodies, &among.set[disc.lightest as usize], disc)
    }

    fn bodies(disc: Disc) -> [Option<u32>; 2] {
        [Some(disc.body), None]
    }
}

impl Segments {
    /// The constants of a marker and a disc. The chain is flat.
    fn of_marker(&self, bodies: &Bodies, info: &ImpInfo, disc: Disc) -> PairProperties {
        let body = disc.body as usize;
        (self.0).properties_of(bodies, info, body, bodies.radius_at(body, disc.part))
    }
}

/// The results of a chunk.
#[derive(Debug, Default)]
pub struct Results {
    sums: Sums,
    /// What is added to markers and to bodies, in order.
    on_markers: Vec<(u32, ImpForce)>,
    on_bodies: Vec<(u32, Load)>,
    /// The contacts that press, for frames; the force at a maximum of the distance is negated.
    pressing: Vec<ContactState>,
}

impl Results {
    fn clear(&mut self) {
        self.sums = Sums::default();
        self.on_markers.clear();
        self.on_bodies.clear();
        self.pressing.clear();
    }

    fn add_loss(&mut self, sign: f64, loss: Loss) {
        self.sums.loss += Loss {
            friction: sign * loss.friction,
            viscous: sign * loss.viscous,
        };
    }
}

/// Buffers for the contacts of a disc. They are kept from disc to disc, so that no step allocates.
#[derive(Debug)]
pub struct Room<P> {
    found: Vec<Extremum>,
    successors: Vec<Option<usize>>,
    transferred: Transferred,
    places: Vec<Place<P>>,
}

impl<P> Default for Room<P> {
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

impl PairKind for Segments {
    type Memory = Memory;
    type Found = ();
    type Added = Results;
    type Room<L: Law> = Room<L::Pair>;

    fn evaluate<L: Law>(
        chunk: &Chunk<Self, L>,
        room: &mut Room<L::Pair>,
        next: &mut [(L::History, Memory)],
        ((), added): (&mut (), &mut Results),
    ) {
        added.clear();
        for ((disc, (_, before)), (_, next)) in chunk.pairs.iter().zip(chunk.history).zip(next) {
            next.clear();
            let (on, law) = (&chunk.on, chunk.law);
            let disc = OfDisc {
                on,
                law,
                disc: *disc,
            };
            disc.evaluate(before, room, added, next);
        }
    }

    fn add(_: &On<Self>, added: &Results, to: &mut Targets, sums: &mut Sums) {
        for (slot, part) in &added.on_markers {
            add_to_point(&mut to.forces[*slot as usize], part);
        }
        for (body, part) in &added.on_bodies {
            to.by_points[*body as usize] += *part;
        }
        sums.loss += added.sums.loss;
        for (sum, energy) in sums.energy.iter_mut().zip(added.sums.energy) {
            *sum += energy;
        }
        to.contacts.extend_from_slice(&added.pressing);
        sums.in_reach += added.sums.in_reach;
        sums.passed = sums.passed.or(added.sums.passed);
    }
}

/// The contacts of one disc.
struct OfDisc<'a, L> {
    on: &'a On<'a, Segments>,
    law: &'a L,
    disc: Disc,
}

impl<L: Law> OfDisc<'_, L> {
    /// Evaluates them.
    fn evaluate(
        &self,
        before: &Memory,
        room: &mut Room<L::Pair>,
        to: &mut Results,
        next: &mut Memory,
    ) {
        let On { bodies, extra, .. } = *self.on;
        let (body, of_disc) = (self.disc.body as usize, self.radius());
        let [first, count] = self.disc.segments.map(|n| n as usize);
        let segments = &extra.segments[first..first + count];
        let own = |slot: u32| self.info(slot).radius;
        let contact = |slot: u32| of_disc + own(slot);
        let (x, found) = (&self.on.watch.positions, &mut room.found);
        extrema(&extra.links, x, segments, self.center(), &contact, found);
        found.retain(|e| e.distance < of_disc + (1.0 + REACH) * own(e.foot.slots[0]));
        let depth = admissible_depth(bodies, body, self.disc.part);
        for e in found.iter().filter(|e| e.least) {
            let own = own(e.foot.slots[0]);
            let through = came_through(e, own);
            let deep = e.outside && of_disc - e.distance > depth;
            if (through || deep) && to.sums.passed.is_none() {
                to.sums.passed = Some(Passed::Body {
                    own: Own::Point(self.info(e.foot.slots[0]).id),
                    body: self.disc.body,
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
        to.sums.in_reach += found.len();
        self.continue_springs(before, room, to);
        let Room {
            found,
            transferred,
            places,
            ..
        } = room;
        for (span, history) in spans(found).zip(&transferred.histories) {
            places.clear();
            places.extend(span.iter().map(|e| self.seen(e, to)));
            self.press(places, &L::History::take(history), to, next);
        }
    }

    /// The marker of a slot.
    fn info(&self, slot: u32) -> &ImpInfo {
        &self.on.set[slot as usize]
    }

    /// Slots of the markers between which a minimum was, if both are still ends of segments.
    fn slots(&self, held: &Held) -> Option<[u32; 2]> {
        let (set, links) = (self.on.set, &self.on.extra.links);
        let slot = |id: u64| {
            let slot = set.binary_search_by_key(&id, |info| info.id).ok()? as u32;
            links.next(slot).or(links.previous(slot)).map(|_| slot)
        };
        let [a, b] = held.ids;
        Some([slot(a)?, slot(b)?])
    }

    /// Radius of the disc in m.
    fn radius(&self) -> f64 {
        (self.on.bodies).radius_at(self.disc.body as usize, self.disc.part)
    }

    /// Its centre in m.
    fn center(&self) -> Vec2 {
        self.on.bodies.outline_of(self.disc.body as usize)[self.disc.part as usize]
    }

    /// The constants of the disc and the marker of a slot.
    fn properties(&self, slot: u32) -> PairProperties {
        let On { kind, bodies, .. } = *self.on;
        kind.of_marker(bodies, self.info(slot), self.disc)
    }

    /// For each minimum of the last step, the span whose minimum is nearest to it, within the distance that a foot
    /// can move in a step.
    fn successors(&self, held: &[Held], found: &[Extremum], successors: &mut Vec<Option<usize>>) {
        let successor = |held: &Held| {
            let slots = self.slots(held)?;
            let foot = Foot { slots, s: held.s };
            let at = foot.mean(slots.map(|slot| self.on.watch.positions[slot as usize]));
            let mut nearest: Option<(usize, f64)> = None;
            for (i, span) in spans(found).enumerate() {
                for e in span.iter().filter(|e| e.least) {
                    let info = self.info(e.foot.slots[0]);
                    let far = (at - e.point).norm();
                    let may = info.group == self.info(slots[0]).group && far <= info.radius;
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

    /// Computes the histories with which the spans continue. Energy of springs that end, part or join, and that no span
    /// takes over, is lost to friction.
    fn continue_springs(&self, before: &Memory, room: &mut Room<L::Pair>, to: &mut Results) {
        let Room {
            found,
            successors,
            transferred,
            ..
        } = room;
        self.successors(&before.held, found, successors);
        transferred.transfer(before, successors, spans(found).count());
        let ended = transferred.ended.iter().map(|spring| (1.0, spring));
        let begun = transferred.begun.iter().map(|spring| (-1.0, spring));
        for (sign, (from, history)) in ended.chain(begun) {
            // A spring has left with the markers of all its minima.
            let spring = before.held[*from].spring;
            let mut minima = before.held.iter().filter(|held| held.spring == spring);
            let Some([slot, _]) = minima.find_map(|held| self.slots(held)) else {
                continue;
            };
            let constants = self.law.pair(&self.properties(slot));
            let (kinematics, history) = (Kinematics::default(), L::History::take(history));
            to.add_loss(sign, self.law.separate(&constants, &kinematics, &history));
        }
    }

    /// Adds `share` of the motion of the two surfaces at a foot: by how much the overlap has fallen, and the relative
    /// displacement along the tangent.
    fn add_motion(&self, place: &Place<L::Pair>, share: f64, kinematics: &mut Kinematics) {
        let On {
            watch,
            states,
            moves,
            ..
        } = self.on;
        let (dt, here) = (self.on.interval.last_step, &place.e.foot);
        let spin = here.mean(here.slots.map(|slot| states[slot as usize].spin));
        let turning = place.tangent * (-place.surface * spin);
        let frame = moves.frame(self.disc.body);
        let of_body = frame.displacement(place.r);
        let (fallen, moved) = if dt > 0.0 {
            // From positions, as for points. A marker that is new touched nothing one step ago.
            let [Some(a), Some(b)] = here.slots.map(|slot| watch.was(slot)) else {
                return;
            };
            let center = self.center() - frame.displacement(self.center() - frame.center);
            let before = (center - foot(a, b, center).0).norm();
            let moved = place.e.point - here.mean([a, b]) - of_body + turning * dt;
            (place.e.distance - before, moved)
        } else {
            let velocity = |slot: u32| Vec2::from(states[slot as usize].velocity);
            let moved = here.mean(here.slots.map(velocity)) + turning - of_body;
            (moved.dot(&place.normal), moved)
        };
        let [way, speed] = moves.scaled([fallen, moved.dot(&place.tangent)]);
        for i in 0..2 {
            kinematics.moved[i] += share * way[i];
            kinematics.velocity[i] += share * speed[i];
        }
    }

    /// The geometry and the constants of an extremum. Also adds the stiffness that it may have until the next exchange.
    fn seen(&self, e: &Extremum, to: &mut Results) -> Place<L::Pair> {
        let info = self.info(e.foot.slots[0]);
        let overlap = self.radius() + info.radius - e.distance;
        let frame = &self.on.bodies.frames[self.disc.body as usize];
        let normal = (e.point - self.center()) / e.distance;
        let tangent = Vec2::new(-normal.y, normal.x);
        let r = contact_point(e.point, info.radius, overlap, normal) - frame.center;
        let (r_n, r_t) = (cross(r, normal), cross(r, tangent));
        let properties = self.properties(e.foot.slots[0]);
        let constants = self.law.pair(&properties);
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
            center: frame.center,
            arms: [r_n, r_t],
            constants,
            elastic,
        };
        let interval = &self.on.interval;
        let k = (self.law).stiffness(&place.constants, overlap + interval.closing);
        let mut kinematics = Kinematics::default();
        self.add_motion(&place, 1.0, &mut kinematics);
        let (velocity, mobility) = (kinematics.velocity[0], 1.0 / properties.mass);
        let k = (interval.impacts).counted(k, [overlap, elastic[0]], velocity, mobility);
        if e.least || e.alone {
            let (links, x) = (&self.on.extra.links, &self.on.watch.positions);
            shares_within(links, x, &e.foot, 0.5 * info.radius, |slot, share| {
                let of_slot = ImpForce {
                    stiffness: k.normal * share,
                    tangential: k.tangential * share,
                    ..ImpForce::default()
                };
                to.on_markers.push((slot, of_slot));
            });
        }
        if e.least {
            let (m, i) = (frame.inverse_mass, frame.inverse_inertia);
            let [across, along] = [m + i * r_n * r_n, m + i * r_t * r_t];
            let load = Load {
                rate: k.normal * across + k.tangential * along,
                mobility: across,
                along,
                contacts: u32::from(overlap > 0.0),
                ..Load::default()
            };
            to.on_bodies.push((self.disc.body, load));
        }
        place
    }

    /// Evaluates the contact with a span of the chain whose extrema are `places`, and adds the results
    /// ([`crate::contact::span`]).
    fn press(
        &self,
        places: &[Place<L::Pair>],
        history: &L::History,
        to: &mut Results,
        next: &mut Memory,
    ) {
        let minima = || places.iter().filter(|p| p.e.least);
        let deeper = |a: &&Place<L::Pair>, b: &&Place<L::Pair>| a.overlap.total_cmp(&b.overlap);
        let Some(deepest) = minima().max_by(deeper) else {
            // All minima are on the inside. What the maxima subtract has no part in friction.
            for place in places.iter().filter(|p| p.overlap > 0.0) {
                let [spring, pull] = place.elastic;
                self.exert(place, [pull - spring, 0.0], to);
                let none = L::History::default();
                (to.sums).hold(-self.law.energy(&place.constants, place.overlap, &none));
            }
            return;
        };
        let mut kinematics = Kinematics {
            overlap: deepest.overlap,
            ..Kinematics::default()
        };
        if deepest.overlap <= 0.0 {
            self.add_motion(deepest, 1.0, &mut kinematics);
            let loss = (self.law).separate(&deepest.constants, &kinematics, history);
            to.add_loss(1.0, loss);
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
            self.add_motion(place, share(place), &mut kinematics);
        }
        let springs: f64 = places.iter().map(|p| p.sign() * p.elastic[0]).sum();
        let springs = springs.max(0.0);
        let response =
            (self.law).response_to_spring(&deepest.constants, springs, &kinematics, history);
        let (mut history, mut energy) = (response.history, 0.0);
        for place in places.iter().filter(|p| p.overlap > 0.0) {
            let (share, sign, [spring, pull]) = (share(place), place.sign(), place.elastic);
            // This extremum has its share of the law's normal force, and the difference between its own spring and its
            // share of all springs.
            let normal = share * response.normal + (sign * spring - share * springs) - sign * pull;
            self.exert(place, [normal, share * response.tangential], to);
            // The energy of the tangential spring is added once, with the first minimum.
            let own = if place.e.least {
                core::mem::take(&mut history)
            } else {
                L::History::default()
            };
            energy += sign * self.law.energy(&place.constants, place.overlap, &own);
            if place.e.least {
                next.held.push(Held {
                    ids: place.e.foot.slots.map(|slot| self.info(slot).id),
                    s: place.e.foot.s,
                    force: place.elastic[0],
                    spring: next.springs.len() as u32,
                });
            }
        }
        to.sums.hold(energy);
        to.add_loss(1.0, response.loss);
        next.springs.push(All::of(&response.history));
    }

    /// Divides a force (N/m, along the normal and the tangent) and its moment about the foot between the markers of the foot, and
    /// applies the reaction to the body.
    fn exert(&self, place: &Place<L::Pair>, [n, t]: [f64; 2], to: &mut Results) {
        let force = place.normal * n + place.tangent * t;
        let couple = -place.surface * t;
        let ([r_n, r_t], foot) = (place.arms, &place.e.foot);
        let mut torque = -(r_n * n + r_t * t);
        for (slot, share) in foot.slots.into_iter().zip(foot.shares()) {
            let part = force * share;
            let own = ImpForce {
                force: part.into(),
                couple: couple * share,
                ..ImpForce::default()
            };
            to.on_markers.push((slot, own));
            let load = Load {
                force: -part,
                torque: core::mem::take(&mut torque),
                ..Load::default()
            };
            to.on_bodies.push((self.disc.body, load));
        }
        if self.on.interval.measured {
            let nearer = foot.slots[usize::from(foot.s > 0.5)];
            let ids = [self.disc.body.into(), self.info(nearer).id];
            (to.pressing).push(between(ids, POINT, place.r + place.center, -force));
        }
    }
}
