//! Discs and the segments between markers (section 7 with `interface` = `segments`; docs/physics.md, "The laws"), for chains with
//! two ends.

use interface::Vec2;
use interface::message::wire::{ImpInfo, ImpState};
use interface::step::Step;

use super::{OnPoint, Oracle, Place, Span, Sums, Touch, Who, along, left};
use crate::mass::cross;
use crate::reference::law::{History, Law, Motion, Pair};

/// Markers in the order of their segments.
struct Chain<'a> {
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
        let begins = (0..set.len()).filter(is_begin);
        let whole = begins.map(|slot| {
            let slots: Vec<_> = std::iter::successors(Some(slot), |slot| next(*slot)).collect();
            Self {
                markers: slots.iter().map(|&slot| &set[slot]).collect(),
                states: slots.iter().map(|&slot| &states[slot]).collect(),
                x: slots
                    .iter()
                    .map(|&slot| states[slot].position.into())
                    .collect(),
                slots,
            }
        });
        whole.filter(|chain| chain.slots.len() > 1).collect()
    }

    /// Contact radius in m, which all have.
    fn radius(&self) -> f64 {
        self.markers[0].radius
    }

    /// Length of a segment in m.
    fn length(&self, segment: usize) -> f64 {
        (self.x[segment + 1] - self.x[segment]).norm()
    }

    /// The largest share that a marker has of a foot that is this far (m) away at most.
    fn share_within(&self, marker: usize, foot: &Foot, far: f64) -> f64 {
        let place = |k: usize| (0..k).map(|k| self.length(k)).sum::<f64>();
        let (own, on) = (
            place(marker),
            place(foot.segment) + foot.share * self.length(foot.segment),
        );
        let nearest = own.clamp(on - far, on + far);
        let side = if nearest > own {
            marker
        } else {
            marker.wrapping_sub(1)
        };
        if nearest == own {
            return 1.0;
        }
        (1.0 - (nearest - own).abs() / self.length(side)).max(0.0)
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
        for (k, &slot) in self.slots.iter().enumerate() {
            let point = &mut points[slot];
            let share = match k.wrapping_sub(foot.segment) {
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

/// An extremum of the distance from a disc's centre, where that is to the right of the chain.
#[derive(Clone, Copy)]
struct Foot {
    /// The segment, by the place of its beginning in the chain, and the share of its end.
    segment: usize,
    share: f64,
    least: bool,
    place: Place,
    /// Its position in m.
    at: Vec2,
    /// How near it is to where it becomes another one, in m.
    margin: f64,
}

/// The extrema of the distance of `center` (m) along a chain of markers at `x` (m) with the radius `own` (m). The disc has the
/// radius `a` (m).
fn extrema(x: &[Vec2], own: f64, center: Vec2, a: f64) -> Vec<Foot> {
    let segments = x.len() - 1;
    let way = |k: usize| x[k + 1] - x[k];
    let foot = |k: usize| (center - x[k]).dot(&way(k)) / way(k).norm_squared();
    // To the right.
    let normal = |k: usize| -left(way(k).normalize());
    let mut found = Vec::new();
    let mut add = |segment: usize, share: f64, least: bool, normal: Vec2, margin: f64| {
        let at = x[segment] + way(segment) * share;
        let away = at - center;
        if away.dot(&normal) >= 0.0 {
            return;
        }
        let mut place = Place::between(at, [own, a], away, away.norm(), own);
        place.radius = a;
        let margin = margin.abs();
        found.push(Foot {
            segment,
            share,
            least,
            place,
            at,
            margin,
        });
    };
    // How far the foot of the centre is beyond the beginning and before the end of a segment, in m.
    let past = |k: usize| foot(k) * way(k).norm();
    let before = |k: usize| (1.0 - foot(k)) * way(k).norm();
    for k in 0..segments {
        if k == 0 && foot(0) <= 0.0 {
            add(0, 0.0, true, normal(0), past(0));
        }
        if foot(k) > 0.0 && foot(k) < 1.0 {
            add(k, foot(k), true, normal(k), past(k).min(before(k)));
        }
        if k + 1 == segments {
            if foot(k) >= 1.0 {
                add(k, 1.0, true, normal(k), before(k));
            }
            continue;
        }
        let both = normal(k) + normal(k + 1);
        let margin = past(k + 1).abs().min(before(k).abs());
        match (foot(k) >= 1.0, foot(k + 1) <= 0.0) {
            (true, true) => add(k, 1.0, true, both, margin),
            (false, false) => add(k, 1.0, false, both, margin),
            _ => {}
        }
    }
    found
}

impl Oracle {
    /// Each disc at each chain.
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
        for chain in Chain::all(set, states) {
            for (b, body) in self.bodies.iter().enumerate() {
                for (part, disc) in body.outline().enumerate() {
                    self.disc_and_chain(step, (b, part), disc, &chain, sums);
                }
            }
        }
    }

    fn disc_and_chain(
        &self,
        step: &Step,
        disc: (usize, usize),
        (center, a): (Vec2, f64),
        chain: &Chain,
        sums: &mut Sums,
    ) {
        let own = chain.radius();
        let mut found = extrema(&chain.x, own, center, a);
        found.retain(|foot| foot.place.overlap > -own);
        let changes = found.iter().any(|foot| {
            let Place { overlap, blur, .. } = foot.place;
            let parts = !foot.least && overlap.abs() <= blur;
            overlap > -blur && foot.margin <= blur || parts
        });
        if changes {
            sums.expected.doubtful = Some("an extremum that comes or goes");
        }
        // A maximum that does not press parts what is before it from what is behind.
        let mut spans: Vec<Vec<Foot>> = vec![Vec::new()];
        for foot in found {
            match (foot.least, foot.place.overlap > 0.0) {
                (false, false) => spans.push(Vec::new()),
                _ => spans.last_mut().expect("one at least").push(foot),
            }
        }
        let histories = self.handed_on(disc, chain, &spans, sums);
        for (feet, before) in spans.iter().zip(histories) {
            self.span(step, disc, chain, (feet, before), sums);
        }
    }

    /// The springs with which the spans of a disc and a chain go on: each minimum hands on its part to the span with the nearest
    /// one. What is lost where springs part, join and end is lost to friction.
    fn handed_on(
        &self,
        disc: (usize, usize),
        chain: &Chain,
        spans: &[Vec<Foot>],
        sums: &mut Sums,
    ) -> Vec<History> {
        let radius = chain.radius();
        let place = |id: u64| chain.markers.iter().position(|marker| marker.id == id);
        // What each spring brings to each span, in N/m.
        let mut springs = Vec::new();
        let own = |span: &&Span| span.disc == disc && place(span.minima[0].0[0]).is_some();
        for old in self.spans.iter().filter(own) {
            let mut brings = vec![0.0; spans.len()];
            for &(ids, share, force) in &old.minima {
                let [Some(p), Some(q)] = ids.map(place) else {
                    continue;
                };
                let at = chain.x[p] * (1.0 - share) + chain.x[q] * share;
                let far = |span: &Vec<Foot>| {
                    let minima = span.iter().filter(|foot| foot.least);
                    let far = minima.map(|foot| (foot.at - at).norm());
                    far.fold(f64::INFINITY, f64::min)
                };
                let mut far: Vec<_> = spans.iter().map(far).zip(0..).collect();
                far.sort_by(|a, b| a.0.total_cmp(&b.0));
                let even = far.len() > 1 && far[1].0 - far[0].0 <= 1e-6 * radius;
                if (0.5..1.5).contains(&(far[0].0 / radius)) || even && far[0].0 < radius {
                    sums.expected.doubtful = Some("a minimum that goes far or either way");
                }
                if far[0].0 < radius {
                    brings[far[0].1] += force;
                }
            }
            sums.friction += old.history.energy();
            springs.push((old.history, brings));
        }
        let law = Law::of(
            self.law_of_points(chain.markers[0].group, disc.0),
            Pair::default(),
        );
        let handed = (0..spans.len()).map(|k| {
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
        let spring = |foot: &Foot| law.spring(foot.place.overlap.max(0.0)).0;
        let minima = || feet.iter().filter(|foot| foot.least);
        let deeper = |a: &&Foot, b: &&Foot| a.place.overlap.total_cmp(&b.place.overlap);
        let Some(deepest) = minima().max_by(deeper) else {
            if feet
                .iter()
                .any(|foot| foot.place.overlap > -foot.place.blur)
            {
                sums.expected.doubtful = Some("a maximum without a minimum");
            }
            return;
        };
        let xi = deepest.place.overlap;
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
            ..self.motion(step, b, chain, shares)
        };
        let together: f64 = feet.iter().map(|foot| sign(foot) * spring(foot)).sum();
        let together = together.max(0.0);
        let exerted = law.exert_spring(&motion, together, &before);
        sums.book(&exerted, (&law, &before), &deepest.place);
        let [by_place, by_speed] = exerted.sensitivity;
        let per_dt = if step.dt_before > 0.0 {
            1.0 / step.dt_before
        } else {
            0.0
        };
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
                let shared = 2.0 * k_n * (1.0 + exerted.force[1].abs() / all) + pull / overlap;
                let turns = foot.place.curvature * (force.norm() + spring(foot));
                blur = foot.place.blur * (by_place + by_speed * per_dt + shared + turns);
            }
            chain.press((foot, &law), (force, blur), &mut sums.expected.points);
            self.press_body((b, part), chain, (foot, &law), (force, blur), sums);
        }
        if xi > 0.0 {
            let minima = minima().filter(|foot| foot.place.overlap > 0.0);
            let ids = |foot: &Foot| [0, 1].map(|k| chain.markers[foot.segment + k].id);
            let minima = minima.map(|foot| (ids(foot), foot.share, spring(foot)));
            sums.spans.push(Span {
                disc: (b, part),
                minima: minima.collect(),
                history: exerted.history,
            });
        }
    }

    /// How a chain moves past a disc: the mean over feet with their shares.
    fn motion<'a>(
        &self,
        step: &Step,
        b: usize,
        chain: &Chain,
        shares: impl Iterator<Item = (&'a Foot, f64)>,
    ) -> Motion {
        let mut motion = Motion::default();
        for (foot, share) in shares {
            let Place { at, normal, .. } = foot.place;
            let (_, gone, fast) = self.bodies[b].side(at - self.bodies[b].pose.xy());
            let mean = |a: Vec2, b: Vec2| a * (1.0 - foot.share) + b * foot.share;
            let [one, other] = [foot.segment, foot.segment + 1].map(|k| {
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
            let [moved, velocity] = [moved, velocity].map(|v| along(v, normal));
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
            expected.damping = expected.damping.max(law.damping_ratio);
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
            moment: 0.0,
            moved: 0.0,
            blur,
        });
    }
}
