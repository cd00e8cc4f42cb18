//! Discs and the segments between markers (section 7 with `interface` = `segments`; docs/physics.md, "The laws").

use std::collections::BTreeMap;

use interface::Vec2;
use interface::message::wire::{ImpInfo, ImpState};
use interface::step::Step;

use super::{OnPoint, Oracle, Place, Span, Sums, Touch, Who, along, inverse, left};
use crate::mass::cross;
use crate::outline;
use crate::reference::law::{History, Law, Motion, Pair};

/// Markers in the order of their segments. Of a ring the first one is also the last.
struct Chain<'a> {
    is_ring: bool,
    /// What they are.
    markers: Vec<&'a ImpInfo>,
    slots: Vec<usize>,
    states: Vec<&'a ImpState>,
    /// Where, in m.
    x: Vec<Vec2>,
}

impl<'a> Chain<'a> {
    /// Those of a set.
    fn all(set: &'a [ImpInfo], states: &'a [ImpState]) -> Vec<Self> {
        let next = |slot: usize| (set[slot].next as usize).checked_sub(1);
        let is_begin = |slot: &usize| (0..set.len()).all(|other| next(other) != Some(*slot));
        let mut left: Vec<usize> = (0..set.len()).collect();
        // What no chain with two ends has is in rings, which begin anywhere.
        left.sort_by_key(|slot| !is_begin(slot));
        let mut whole = Vec::new();
        while let Some(&first) = left.first() {
            let (mut slots, mut at) = (Vec::new(), Some(first));
            while let Some(slot) = at.filter(|slot| left.contains(slot)) {
                left.retain(|other| *other != slot);
                slots.push(slot);
                at = next(slot);
            }
            let is_ring = at == Some(first);
            slots.extend(is_ring.then_some(first));
            whole.push(Self {
                is_ring,
                markers: slots.iter().map(|&slot| &set[slot]).collect(),
                states: slots.iter().map(|&slot| &states[slot]).collect(),
                x: slots
                    .iter()
                    .map(|&slot| states[slot].position.into())
                    .collect(),
                slots,
            });
        }
        whole.retain(|chain| chain.slots.len() > 1);
        whole
    }

    /// Contact radius in m, which all have.
    fn radius(&self) -> f64 {
        self.markers[0].radius
    }

    /// Length of a segment in m.
    fn length(&self, segment: usize) -> f64 {
        (self.x[segment + 1] - self.x[segment]).norm()
    }

    /// The largest share that a marker has of a foot that is this far (m) away at most; round a ring there are two ways.
    fn share_within(&self, marker: usize, foot: &Foot, far: f64) -> f64 {
        let segments = self.x.len() - 1;
        let place = |k: usize| (0..k).map(|k| self.length(k)).sum::<f64>();
        let on = place(foot.segment) + foot.share * self.length(foot.segment);
        let round = f64::from(u8::from(self.is_ring)) * place(segments);
        let share = |round: f64| {
            let own = place(marker) + round;
            let nearest = own.clamp(on - far, on + far);
            let side = marker + if nearest > own { 0 } else { segments - 1 };
            1.0 - (nearest - own).abs() / self.length(side % segments)
        };
        let ways = [-round, 0.0, round].map(share);
        ways.into_iter().fold(0.0, f64::max)
    }

    /// What a place of a chain does to its markers.
    fn press(
        &self,
        (foot, law): (&Foot, &Law),
        (force, blur): (Vec2, f64),
        points: &mut [OnPoint],
    ) {
        let (own, length) = (self.radius(), self.length(foot.segment));
        let Place {
            overlap,
            at,
            blur: least,
            ..
        } = foot.place;
        let [k_n, k_t] = foot.place.least_stiffness(law);
        let within = foot.share > 0.0 && foot.share < 1.0;
        let moves = if within {
            least * force.norm() / length
        } else {
            0.0
        };
        let count = self.slots.len() - usize::from(self.is_ring);
        for (k, &slot) in self.slots[..count].iter().enumerate() {
            let point = &mut points[slot];
            let share = match (k + count - foot.segment) % count {
                0 => 1.0 - foot.share,
                1 => foot.share,
                _ => 0.0,
            };
            if share > 0.0 {
                point.force += force * share;
                point.couple += cross(at - foot.at, force) * share;
                point.blur += blur + moves;
                point.touched |= overlap > 0.0;
            }
            let gap = overlap + 0.5 * own;
            let most = self.share_within(k, foot, 0.5 * own);
            if foot.least && most > 0.0 {
                point.at_the_edge |= gap.abs() <= least;
                if gap > 0.0 {
                    point.stiffness += k_n * most;
                    point.tangential += k_t * most;
                }
            }
        }
    }
}

/// An extremum of the distance from a disc's centre.
#[derive(Clone, Copy)]
struct Foot {
    /// The segment, by the place of its beginning in the chain, and the share of its end.
    segment: usize,
    share: f64,
    least: bool,
    /// Whether the centre is to the right of the chain.
    right: bool,
    place: Place,
    /// Its position in m.
    at: Vec2,
    /// How near it is to where it becomes another one, in m.
    margin: f64,
}

impl Foot {
    /// Its markers by their places in the chain. At a vertex that is one marker.
    fn ends(&self) -> [usize; 2] {
        let at_vertex = self.share.fract() == 0.0;
        let place = |k| if at_vertex { self.share as usize } else { k };
        [0, 1].map(|k| self.segment + place(k))
    }

    fn presses(&self) -> bool {
        self.right && self.place.overlap > 0.0
    }
}

/// The extrema of the distance of `center` (m), where a disc has the radius `a` (m), along a chain.
fn extrema(chain: &Chain, center: Vec2, a: f64) -> Vec<Foot> {
    let (x, own, segments) = (&chain.x, chain.radius(), chain.x.len() - 1);
    let way = |k: usize| x[k + 1] - x[k];
    let foot = |k: usize| (center - x[k]).dot(&way(k)) / way(k).norm_squared();
    // To the right.
    let normal = |k: usize| -left(way(k).normalize());
    let mut found = Vec::new();
    let mut add = |segment: usize, share: f64, least: bool, normal: Vec2, margin: f64| {
        let at = x[segment] + way(segment) * share;
        let away = at - center;
        let beside = -away.dot(&normal);
        let mut place = Place::between(at, [own, a], away, away.norm(), own);
        place.radius = a;
        found.push(Foot {
            segment,
            share,
            least,
            right: beside > 0.0,
            place,
            at,
            margin: margin.abs().min(beside.abs()),
        });
    };
    // How far the foot of the centre is beyond the beginning and before the end of a segment, in m.
    let past = |k: usize| foot(k) * way(k).norm();
    let before = |k: usize| (1.0 - foot(k)) * way(k).norm();
    for k in 0..segments {
        if k == 0 && foot(0) <= 0.0 && !chain.is_ring {
            add(0, 0.0, true, normal(0), past(0));
        }
        if foot(k) > 0.0 && foot(k) < 1.0 {
            add(k, foot(k), true, normal(k), past(k).min(before(k)));
        }
        let next = (k + 1) % segments;
        if next == 0 && !chain.is_ring {
            if foot(k) >= 1.0 {
                add(k, 1.0, true, normal(k), before(k));
            }
            continue;
        }
        let both = normal(k) + normal(next);
        let margin = past(next).abs().min(before(k).abs());
        match (foot(k) >= 1.0, foot(next) <= 0.0) {
            (true, true) => add(k, 1.0, true, both, margin),
            (false, false) => add(k, 1.0, false, both, margin),
            _ => {}
        }
    }
    found
}

/// The spans of a chain beside a disc (its centre and its radius in m): a maximum that does not press parts what is before it from what
/// is behind.
fn spans(chain: &Chain, (center, a): (Vec2, f64), sums: &mut Sums) -> Vec<Vec<Foot>> {
    let mut spans: Vec<Vec<Foot>> = vec![Vec::new()];
    for foot in extrema(chain, center, a) {
        let Place { overlap, blur, .. } = foot.place;
        let parts = !foot.least && overlap.abs() <= blur;
        if overlap > -blur && foot.margin <= blur || foot.right && parts {
            sums.expected.doubtful = Some("an extremum that comes or goes");
        }
        if !foot.least && !foot.presses() {
            spans.push(Vec::new());
        } else if foot.right && overlap > -chain.radius() {
            spans.last_mut().expect("one at least").push(foot);
        }
    }
    if chain.is_ring && spans.len() > 1 {
        let last = spans.pop().expect("two at least");
        spans[0].splice(0..0, last);
    }
    spans
}

impl Oracle {
    /// Each disc at all chains.
    pub(super) fn discs_and_chains(
        &self,
        step: &Step,
        set: &[ImpInfo],
        states: &[ImpState],
        sums: &mut Sums,
    ) {
        for point in &mut sums.expected.points {
            point.exact = false;
        }
        let chains = Chain::all(set, states);
        let places = set.iter().zip(states);
        let places = places.map(|(i, s)| (i.id, s.position.into())).collect();
        for (b, body) in self.bodies.iter().enumerate() {
            for (part, disc) in body.outline().enumerate() {
                let spans = chains.iter().flat_map(|chain| {
                    let spans = spans(chain, disc, sums).into_iter();
                    spans.map(move |feet| (chain, feet))
                });
                let spans: Vec<_> = spans.collect();
                let histories = self.handed_on((b, part), &places, &spans, sums);
                for ((chain, feet), before) in spans.iter().zip(histories) {
                    self.span(step, (b, part), chain, (feet, before), sums);
                }
            }
        }
    }

    /// The springs with which the spans of a disc go on: each minimum hands on its part to the span of its group with the nearest
    /// one. What is lost where springs part, join and end is lost to friction. A spring has left with the markers of its last
    /// minimum that was left. The markers are at these places (m).
    fn handed_on(
        &self,
        disc: (usize, usize),
        places: &BTreeMap<u64, Vec2>,
        spans: &[(&Chain, Vec<Foot>)],
        sums: &mut Sums,
    ) -> Vec<History> {
        // What each spring brings to each span, in N/m.
        let mut springs = Vec::new();
        for old in self.spans.iter().filter(|span| span.disc == disc) {
            let mut brings = vec![0.0; spans.len()];
            let is_in = |id: &u64| {
                let mut markers = spans.iter().flat_map(|(chain, _)| &chain.markers);
                markers.any(|marker| marker.id == *id)
            };
            let mut kept = old.minima.clone();
            kept.retain(|(ids, ..)| ids.iter().all(is_in));
            for (ids, share, force) in &kept {
                let [p, q] = ids.map(|id| places[&id]);
                let at = p * (1.0 - share) + q * *share;
                let far = |(chain, feet): &(&Chain, Vec<Foot>)| {
                    let minima = feet.iter().filter(|foot| foot.least);
                    let minima = minima.filter(|_| chain.markers[0].group == old.group);
                    let far = minima.map(|foot| (foot.at - at).norm() / chain.radius());
                    far.fold(f64::INFINITY, f64::min)
                };
                let mut far: Vec<_> = spans.iter().map(far).zip(0..).collect();
                far.sort_by(|a, b| a.0.total_cmp(&b.0));
                let Some(&(nearest, to)) = far.first() else {
                    continue;
                };
                let even = far.len() > 1 && far[1].0 - nearest <= 1e-6;
                if (0.5..1.5).contains(&nearest) || even && nearest < 1.0 {
                    sums.expected.doubtful = Some("a minimum that goes far or either way");
                }
                if nearest < 1.0 {
                    brings[to] += force;
                }
            }
            if !kept.is_empty() {
                sums.friction += old.history.energy();
                springs.push((old.history, brings));
            }
        }
        let handed = spans.iter().enumerate().map(|(k, (chain, _))| {
            let law = self.law_of_points(chain.markers[0].group, disc.0);
            let law = Law::of(law, Pair::default());
            let mut history = History::default();
            let brought: f64 = springs.iter().map(|(_, brings)| brings[k]).sum();
            for (old, brings) in springs.iter().filter(|(_, brings)| brings[k] > 0.0) {
                let all: f64 = brings.iter().sum();
                history.add(brings[k] / all * (brings[k] / brought), old);
                let whole = brings[k] == all && brings[k] == brought;
                if !whole && old.energy() > 0.0 && !law.is_linear() {
                    sums.expected.doubtful = Some("a spring that parts whose stiffness changes");
                }
            }
            sums.friction -= history.energy();
            history
        });
        handed.collect()
    }

    /// A span that a disc may press, with the spring that it had.
    fn span(
        &self,
        step: &Step,
        (b, part): (usize, usize),
        chain: &Chain,
        (feet, before): (&[Foot], History),
        sums: &mut Sums,
    ) {
        let pair = Pair {
            mass: 1.0 / (1.0 / chain.markers[0].mass + self.bodies[b].mobility().xy().max()),
            radius: self.bodies[b].vertices[part].1,
        };
        let law = Law::of(self.law_of_points(chain.markers[0].group, b), pair);
        let disc = self.bodies[b].corners()[part];
        let spring = |foot: &Foot| law.spring(foot.place.overlap.max(0.0)).0;
        let minima = || feet.iter().filter(|foot| foot.least);
        let deeper = |a: &&Foot, b: &&Foot| a.place.overlap.total_cmp(&b.place.overlap);
        let deepest = minima().max_by(deeper);
        let xi = deepest.map_or(0.0, |foot| foot.place.overlap);
        let all: f64 = minima().map(spring).sum();
        let share = |foot: &Foot| match (foot.least, all > 0.0) {
            (false, _) => 0.0,
            (true, true) => spring(foot) / all,
            (true, false) => f64::from(u8::from(foot.place.overlap == xi)),
        };
        let sign = |foot: &Foot| if foot.least { 1.0 } else { -1.0 };
        let shares = minima().map(|foot| (foot, share(foot)));
        let motion = Motion {
            overlap: xi,
            ..self.motion(step, (b, disc), chain, shares)
        };
        let together: f64 = feet.iter().map(|foot| sign(foot) * spring(foot)).sum();
        let together = together.max(0.0);
        let exerted = law.exert_spring(&motion, together, &before);
        if let Some(deepest) = deepest {
            sums.book(&exerted, (&law, &before), &deepest.place);
        }
        let [by_place, by_speed] = exerted.sensitivity;
        let per_dt = inverse(step.dt_before);
        for foot in feet {
            let Place {
                overlap, normal, ..
            } = foot.place;
            let (mut force, mut blur) = (Vec2::zeros(), 0.0);
            if overlap > 0.0 {
                let ((_, stored), (pull, pulled)) = (law.spring(overlap), law.pull(overlap));
                sums.stored += sign(foot) * (stored - pulled);
                let own = sign(foot) * (spring(foot) - pull) - share(foot) * together;
                let [f_n, f_t] = exerted.force.map(|f| f * share(foot));
                force = normal * (f_n + own) + left(normal) * f_t;
                let k_n = law.normal_stiffness(overlap);
                // The share of a minimum changes by its stiffness over all of the force.
                let shared =
                    2.0 * k_n * (1.0 + exerted.force[1].abs() / all.max(f64::MIN_POSITIVE))
                        + pull / overlap;
                let turns = foot.place.curvature * (force.norm() + spring(foot));
                blur = foot.place.blur * (by_place + by_speed * per_dt + shared + turns);
            }
            chain.press((foot, &law), (force, blur), &mut sums.expected.points);
            self.press_body((b, part), chain, (foot, &law), (force, blur), sums);
        }
        if xi > 0.0 {
            let minima = minima().filter(|foot| foot.place.overlap > 0.0);
            let ids = |foot: &Foot| foot.ends().map(|k| chain.markers[k].id);
            let minima = minima.map(|foot| (ids(foot), foot.share, spring(foot)));
            sums.spans.push(Span {
                disc: (b, part),
                group: chain.markers[0].group,
                minima: minima.collect(),
                history: exerted.history,
            });
        }
    }

    /// How a chain moves past a disc, with its centre there (m): the mean over feet with their shares.
    fn motion<'a>(
        &self,
        step: &Step,
        (b, disc): (usize, Vec2),
        chain: &Chain,
        shares: impl Iterator<Item = (&'a Foot, f64)>,
    ) -> Motion {
        let mut motion = Motion::default();
        for (foot, share) in shares {
            let Place { at, normal, .. } = foot.place;
            let (_, gone, fast) = self.bodies[b].side(at - self.bodies[b].pose.xy());
            let mean = |a: Vec2, b: Vec2| a * (1.0 - foot.share) + b * foot.share;
            let [one, other] = foot.ends().map(|k| {
                let state = chain.states[k];
                // The surface turns with the mean spin, about the foot.
                let turning = left(at - foot.at) * state.spin;
                let (_, moved, fast) = self.point(step, chain.markers[k], state, chain.x[k]);
                let moved = moved.map(|moved| moved.xy() + turning * step.dt_before);
                (moved, fast + turning)
            });
            let (moved, velocity) = match (one.0, other.0, gone) {
                _ if step.dt_before == 0.0 => (Vec2::zeros(), mean(one.1, other.1) - fast),
                (Some(a), Some(b), Some(gone)) => {
                    let moved = mean(a, b) - gone.xy();
                    (moved, moved / step.dt_before)
                }
                _ => (Vec2::zeros(), Vec2::zeros()),
            };
            let [mut moved, mut velocity] = [moved, velocity].map(|v| along(v, normal));
            let were = foot.ends().map(|k| self.previous.get(&chain.markers[k].id));
            if let ([Some(p), Some(q)], true) = (were, step.dt_before > 0.0) {
                let center = self.bodies[b].was(disc);
                let before = (center - outline::foot(*p, *q, center).0).norm();
                moved[0] = (foot.at - disc).norm() - before;
                velocity[0] = moved[0] / step.dt_before;
            }
            for k in [0, 1] {
                motion.moved[k] += share * moved[k];
                motion.velocity[k] += share * velocity[k];
            }
        }
        motion
    }

    /// What a place of a chain does to the body.
    fn press_body(
        &self,
        (b, part): (usize, usize),
        chain: &Chain,
        (foot, law): (&Foot, &Law),
        (force, blur): (Vec2, f64),
        sums: &mut Sums,
    ) {
        let Place {
            overlap,
            at,
            normal,
            blur: least,
            ..
        } = foot.place;
        let expected = &mut sums.expected;
        let r = at - self.bodies[b].pose.xy();
        if foot.least && overlap + 0.5 * chain.radius() > 0.0 {
            expected.loads[b].rate +=
                self.bodies[b].rate(r, normal, foot.place.least_stiffness(law));
            expected.damping = expected.damping.max(law.ratio());
        }
        if overlap <= 0.0 {
            return;
        }
        let between = foot.share > 0.0 && foot.share < 1.0;
        if between && (foot.share - 0.5).abs() * chain.length(foot.segment) <= least {
            expected.doubtful = Some("a place as near to one marker as to another");
        }
        let load = &mut expected.loads[b];
        load.points -= force.push(cross(r, force));
        load.contacts += u64::from(foot.least);
        load.blur += blur;
        let nearer = foot.segment + usize::from(foot.share > 0.5);
        expected.touches.push(Touch {
            who: Who::Point(chain.markers[nearer].id, b, part),
            overlap,
            at,
            force,
            normal,
            limit: 0.0,
            held: 0.0,
            moment: 0.0,
            moved: 0.0,
            blur,
            turns: least * foot.place.curvature,
        });
    }
}
