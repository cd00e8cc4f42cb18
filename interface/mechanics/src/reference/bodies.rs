//! The oracle of the bodies' side: what PROTOCOL.md and docs/physics.md say of a step, term by term, without lists, trees
//! or chunks. Only what is farther apart than a law reaches is left out. It shares with the built-in solver the
//! configuration's types and the mass properties of a shape.

mod area;
mod body;
mod chain;
mod own;
mod sound;

use std::collections::BTreeMap;

use interface::Vec2;
use interface::config::{ContactLaw, DemConfig, Interface, OverlapMeasure};
use interface::message::wire::{BodyState, ContactState, ImpInfo, ImpState, Ledger};
use interface::step::Step;
use nalgebra::{DMatrix, DVector};

use super::law::{Exerted, History, Law, Motion, Pair};
use crate::mass::cross;
use crate::outline::{Feature, nearest, nearest_on_edge};
pub use area::{Shared, shared};
pub use body::{Body, Vec3};
use body::{Side, edges, left};
pub use own::{Reported, Rubbed};
pub use sound::MOVES;

/// Distances (m) below this share of a point's radius count as the same: rounding, and its growth over a run.
pub const BLUR: f64 = 1e-8;

/// Who touch: a body and a point (part of the body, id), two bodies, or two points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Who {
    /// Id of the point, body, part of the body.
    Point(u64, usize, usize),
    /// The owner of the vertex and its vertex, the owner of the edge and its edge; 0 where that is the nearest one.
    Bodies(usize, usize, usize, usize),
    /// Ids of the two points.
    Points(u64, u64),
}

/// A contact of a step.
#[derive(Debug, Clone, Copy)]
pub struct Touch {
    /// Who.
    pub who: Who,
    /// In m; negative: a gap.
    pub overlap: f64,
    /// Where, in m.
    pub at: Vec2,
    /// On the point, the first point, or the owner of the vertex, in N/m.
    pub force: Vec2,
    /// From the body, or the second of two, to the point or the first.
    normal: Vec2,
    /// Most that friction may be, in N/m.
    limit: f64,
    /// In the tangential and the rolling spring, in J/m.
    held: f64,
    /// On the owner of the vertex against rolling, in N.
    moment: f64,
    /// Displacement over the last step of one side relative to the other, in m.
    pub moved: f64,
    /// How far the force may be off by rounding, in N/m.
    pub blur: f64,
    /// By how much the normal may be turned by rounding, in rad.
    pub turns: f64,
}

impl Touch {
    /// The same as in a frame, with the force on the body, the first body or the first point.
    pub fn state(&self) -> ContactState {
        let (with, body, other, sign) = match self.who {
            Who::Point(id, b, _) => (1, b as u64, id, -1.0),
            Who::Bodies(i, _, j, _) => (0, i as u64, j as u64, 1.0),
            Who::Points(p, q) => (2, p, q, 1.0),
        };
        ContactState {
            body,
            other,
            with,
            position: self.at.into(),
            force: (self.force * sign).into(),
        }
    }
}

/// What a point feels.
#[derive(Debug, Clone, Copy, Default)]
pub struct OnPoint {
    /// In N/m.
    pub force: Vec2,
    /// Moment of the force about the point in N.
    pub couple: f64,
    /// Tangential stiffness in N/m.
    pub tangential: f64,
    /// Least stiffness that may be reported, in N/m, and whether it is the only one.
    pub stiffness: f64,
    /// Whether every law that counts has a constant stiffness.
    pub exact: bool,
    /// How far the force may be off by rounding, in N/m.
    pub blur: f64,
    /// Whether any overlap is positive.
    pub touched: bool,
    /// Whether a contact is at the edge of reach, so that its stiffness may count or not.
    pub at_the_edge: bool,
}

/// Force, torque and number of contacts on a body.
#[derive(Debug, Clone, Copy, Default)]
pub struct OnBody {
    /// Of points, in N/m and N.
    points: Vec3,
    /// Of bodies.
    bodies: Vec3,
    /// Points that press.
    pub contacts: u64,
    /// `sum k (1/m + (r x n)^2 / I)` in 1/s^2, L-2.
    pub rate: f64,
    /// How far a force may be off by rounding, in N/m.
    pub blur: f64,
}

/// What a solver shall answer to the states of a step.
#[derive(Debug, Clone, Default)]
pub struct Expected {
    /// Point by point.
    pub points: Vec<OnPoint>,
    /// Body by body.
    pub loads: Vec<OnBody>,
    /// Everything that touches.
    pub touches: Vec<Touch>,
    /// Who touch no more, and their displacement over the last step in m.
    parted: Vec<(Who, f64)>,
    /// What is exactly at the edge between two answers, so that rounding decides: nothing can be compared from here on.
    pub doubtful: Option<&'static str>,
    /// Whether a point is on a corner, so that only the forces can be compared, and nothing after them.
    pub is_last: bool,
    /// Largest squared frequency in 1/s^2 that the bodies have by contact with one another, at least.
    pub own_omega_sq: f64,
    /// The same of contacts that have begun since the last step; in the opening step, if anything moves, of any that could.
    pub begun_omega_sq: f64,
    /// The same by which a step must not bring two bodies through one another, nor turn one that rubs too far.
    pub kinematic_omega_sq: f64,
    /// Largest damping ratio of a contact of points in reach.
    pub damping: f64,
    /// Largest eigenvalue of `M^-1 C` in 1/s that the bodies have by contact with one another, at least.
    pub own_damping: f64,
    /// Farthest place of a body from the origin in m.
    pub far: f64,
    /// Fastest point of a surface at `t_{n+1/2}`, in m/s.
    pub speed: f64,
    /// Displacement of the fastest surface since the last envelopes at `t_{n+1}`, in m; `None` before the first.
    pub travel: Option<f64>,
    /// The ledger as measured in this step; of `viscous_work` the least, [`Expected::viscous_most`] has the most.
    pub ledger: Ledger,
    /// In J/m.
    pub viscous_most: f64,
    /// So far: how far impulses may be off by rounding, in N s/m.
    pub loose: f64,
    /// The bodies as measured in this step.
    pub bodies: Vec<BodyState>,
}

/// Places of a chain that a disc presses, with their spring.
#[derive(Debug, Clone)]
struct Span {
    /// Body and disc of it.
    disc: (usize, usize),
    /// Of its markers.
    group: u32,
    /// The minima that press: ids of two markers, share of the second, and force of the normal spring in N/m.
    minima: Vec<([u64; 2], f64, f64)>,
    history: History,
}

/// The bodies and what they remember.
#[derive(Debug, Clone)]
pub struct Oracle {
    config: DemConfig,
    /// At `t_n`.
    pub bodies: Vec<Body>,
    history: BTreeMap<Who, History>,
    /// What presses of chains.
    spans: Vec<Span>,
    /// Position in m of each point one step before.
    previous: BTreeMap<u64, Vec2>,
    /// Poses at the last envelopes.
    published: Option<Vec<Vec3>>,
    friction: f64,
    loose: f64,
    viscous: [f64; 2],
    driven: f64,
    applied: Vec3,
    contact: Vec3,
    /// Force and torque of points on each body in N/m and N, by which the next step is taken in place of its own.
    given: Option<Vec<Vec3>>,
}

/// What a step adds up while it looks at contacts.
#[derive(Default)]
struct Sums {
    expected: Expected,
    history: BTreeMap<Who, History>,
    spans: Vec<Span>,
    stored: f64,
    friction: f64,
    viscous: [f64; 2],
    /// Of bodies that did not touch in the step before.
    begun: Vec<Spring>,
}

/// A normal spring and its dashpot: their constants in N/m and N s/m, and by how much sqrt(m) u, sqrt(m) v, sqrt(I) theta of each body stretch it.
type Spring = ([f64; 2], DVector<f64>);

/// Where two may touch.
#[derive(Clone, Copy)]
struct Place {
    overlap: f64,
    /// From the second to the first.
    normal: Vec2,
    at: Vec2,
    /// R* in m.
    radius: f64,
    /// Distances (m) below this count as the same.
    blur: f64,
    /// How much the normal turns (rad) by a shift of a metre.
    curvature: f64,
    /// How much the overlap grows by a shift of a metre along N: the law gets motions times this, and forces are times this.
    gain: f64,
    /// By how much the overlap has fallen over the last step in m, if that is known; else it is by the material at the place.
    fallen: Option<f64>,
}

impl Place {
    /// Between `x`, with a surface of radius `a` around it, and what is nearest to it of the other, `away` from there, with a
    /// surface of radius `b`. The distance is negative inside of the other. All in m; what is far below `least` is not
    /// distinguished.
    fn between(x: Vec2, [a, b]: [f64; 2], away: Vec2, distance: f64, least: f64) -> Self {
        let (overlap, blur) = (a + b - distance, BLUR * least);
        let normal = away / (distance.signum() * away.norm());
        Self {
            overlap,
            normal,
            at: x - normal * (a - 0.5 * overlap),
            // What has no radius is flat.
            radius: if a * b > 0.0 {
                a * b / (a + b)
            } else {
                a.max(b)
            },
            blur,
            curvature: 1.0 / distance.abs().max(blur),
            gain: 1.0,
            fallen: None,
        }
    }

    /// The least that the stiffness can be (N/m; the second is tangential), as a bound needs it. That of Hertz's law falls to 0
    /// with the overlap, as steeply as a root.
    fn least_stiffness(&self, law: &Law) -> [f64; 2] {
        let k_n = law.normal_stiffness(self.overlap - self.blur);
        [k_n, law.tangential_stiffness(k_n)]
    }
}

/// An edge of an outline around a vertex.
struct Face {
    /// Outwards.
    normal: Vec2,
    /// How deep the vertex and its whole body are behind it, in m.
    depth: f64,
    whole: f64,
}

/// The edges of an outline, that first behind which a body with the corners `own`, of which one is at `x` (m), is least deep.
fn faces(own: &[Vec2], outline: &[Vec2], x: Vec2) -> Vec<Face> {
    let face = |[a, b]: [Vec2; 2]| {
        let normal = -left((b - a).normalize());
        let depth = |x: &Vec2| (a - x).dot(&normal);
        Face {
            normal,
            depth: depth(&x),
            whole: own.iter().map(depth).fold(f64::NEG_INFINITY, f64::max),
        }
    };
    let mut all: Vec<_> = edges(outline).map(face).collect();
    all.sort_by(|a, b| a.whole.total_cmp(&b.whole));
    all
}

impl Sums {
    /// Rounding decides about a contact whose place `x`, so far from an outline (m), is as near to one edge as to another.
    fn doubt(&mut self, outline: &[Vec2], (x, distance): (Vec2, f64), place: &Place) {
        let Place { overlap, blur, .. } = *place;
        if overlap > -blur && has_two_normals(outline, x, distance, blur) {
            self.expected.doubtful = Some("a place as near to one edge as to another");
        }
    }

    /// Adds up what a contact has stored and dissipated.
    fn book(&mut self, exerted: &Exerted, (law, before): (&Law, &History), place: &Place) {
        // Where contact begins, what is not a spring begins at once.
        let jumps = law.dashpots([1.0; 2]) != [0.0; 2] || *before != History::default();
        if place.overlap.abs() <= place.blur && jumps {
            self.expected.doubtful = Some("a contact that just begins or ends");
        }
        self.stored += exerted.stored;
        self.friction += exerted.friction;
        for (sum, viscous) in self.viscous.iter_mut().zip(exerted.viscous) {
            *sum += viscous;
        }
    }

    /// A contact presses on the point in a slot, this way, with stiffnesses (N/m; the second is tangential). The smallest radius of the two is `least`
    /// (m); F-6 counts what is within half of it.
    fn press(
        &mut self,
        slot: usize,
        (touch, sign): (&Touch, f64),
        (law, [stiffness, tangential]): (&Law, [f64; 2]),
        (least, blur): (f64, f64),
    ) {
        let point = &mut self.expected.points[slot];
        point.force += touch.force * sign;
        point.blur += touch.blur;
        point.touched |= touch.overlap > 0.0;
        let gap = touch.overlap + 0.5 * least;
        point.at_the_edge |= gap.abs() <= blur;
        if gap > 0.0 {
            point.stiffness += stiffness;
            point.tangential += tangential;
            point.exact &= law.is_linear();
            self.expected.damping = self.expected.damping.max(law.ratio());
        }
    }
}

impl Oracle {
    /// Bodies at their start.
    pub fn new(config: &DemConfig) -> Self {
        Self {
            config: config.clone(),
            bodies: config.bodies.iter().map(Body::new).collect(),
            history: BTreeMap::new(),
            spans: Vec::new(),
            previous: BTreeMap::new(),
            published: None,
            friction: 0.0,
            loose: 0.0,
            viscous: [0.0; 2],
            driven: 0.0,
            applied: Vec3::zeros(),
            contact: Vec3::zeros(),
            given: None,
        }
    }

    /// The law between two that carry these surfaces, where `common` holds for all others.
    fn law<'a>(&'a self, surfaces: [&str; 2], common: &'a ContactLaw) -> &'a ContactLaw {
        let [a, b] = surfaces;
        let pairs = self.config.contact_pairs.iter();
        let mut pairs = pairs.filter(|_| !a.is_empty() && !b.is_empty());
        let found = pairs.find(|pair| pair.is_of(a, b));
        found.map_or(common, |pair| &pair.law)
    }

    /// The law between the points of a group and a body.
    fn law_of_points(&self, group: u32, b: usize) -> &ContactLaw {
        let surfaces = &self.config.point_surfaces;
        let surface = surfaces.get(group as usize).map_or("", String::as_str);
        let surfaces = [surface, &self.bodies[b].surface];
        self.law(surfaces, &self.config.point_contact)
    }

    /// The outlines have been asked for.
    pub fn publish(&mut self) {
        self.published = Some(self.bodies.iter().map(|b| b.pose).collect());
    }

    /// Computes a step and takes it.
    pub fn step(&mut self, step: &Step, set: &[ImpInfo], states: &[ImpState]) -> Expected {
        let mut sums = Sums::default();
        let exact = OnPoint {
            exact: true,
            ..OnPoint::default()
        };
        sums.expected.points = vec![exact; set.len()];
        sums.expected.loads = vec![OnBody::default(); self.bodies.len()];
        if self.config.interface == Interface::Segments {
            self.discs_and_chains(step, set, states, &mut sums);
        } else {
            self.points_and_bodies(step, set, states, &mut sums);
        }
        self.pairs_of_points(step, set, states, &mut sums);
        self.bodies_and_bodies(step, &mut sums);
        self.kick(step, &mut sums);
        let mut expected = sums.expected;
        let rates = expected
            .touches
            .iter()
            .map(|touch| self.kinematic_rate(touch));
        expected.kinematic_omega_sq = rates.fold(0.0, f64::max).powi(2);
        if step.is_opening() && expected.speed > 0.0 {
            // Nobody knows yet how long the first step is, in which any two may meet.
            expected.begun_omega_sq = expected.begun_omega_sq.max(self.stiffest_pair());
        }
        let blur: f64 = expected.loads.iter().map(|load| load.blur).sum();
        expected.loose = self.loose + blur * step.kick();
        if step.dt_before > 0.0 || step.dt > 0.0 {
            self.loose = expected.loose;
            (self.history, self.spans) = (sums.history, sums.spans);
            let places = set.iter().zip(states);
            self.previous = places.map(|(i, s)| (i.id, s.position.into())).collect();
            for body in &mut self.bodies {
                body.last = body.velocity * step.dt;
                body.pose += body.last;
            }
        }
        let over = step.kick() * step.dt;
        expected.travel = self.published.as_ref().map(|poses| {
            let bodies = self.bodies.iter().zip(poses).zip(&expected.loads);
            // Where it is open on which edge a point presses, other forces are as right, and may move it less.
            let gone = bodies.map(|((b, then), load)| {
                b.gone_since(then) - load.blur * over * b.surface_mobility()
            });
            gone.fold(0.0, f64::max)
        });
        expected
    }

    /// Section 7: one contact for each point and body, or disc of a cluster.
    fn points_and_bodies(
        &self,
        step: &Step,
        set: &[ImpInfo],
        states: &[ImpState],
        sums: &mut Sums,
    ) {
        let bodies: Vec<_> = self.bodies.iter().map(Body::parts).collect();
        for (slot, point) in set.iter().zip(states).enumerate() {
            let (info, x) = (point.0, Vec2::from(point.1.position));
            for (b, parts) in bodies.iter().enumerate() {
                let body = &self.bodies[b];
                let gap = (x - body.pose.xy()).norm() - body.reach - info.radius;
                let with = |part| Who::Point(info.id, b, part);
                let met = || self.history.range(with(0)..with(parts.len())).next();
                // At 2 radii `point_and_body` looks no further; more, for rounding.
                if gap > 2.001 * info.radius && met().is_none() {
                    continue;
                }
                for (part, (outline, a)) in parts.iter().enumerate() {
                    let which = (slot, b, part);
                    self.point_and_body(step, which, point, (outline, *a), sums);
                }
            }
        }
    }

    /// A point and a part of a body.
    fn point_and_body(
        &self,
        step: &Step,
        (slot, b, part): (usize, usize, usize),
        (info, state): (&ImpInfo, &ImpState),
        (outline, a): (&[Vec2], f64),
        sums: &mut Sums,
    ) {
        let (x, body) = (Vec2::from(state.position), &self.bodies[b]);
        let near = nearest(outline, x);
        let (radii, mut away) = ([info.radius, a], x - near.point);
        let on_outline = near.distance.abs() <= BLUR * info.radius;
        // Which side of an edge it is on, rounding decides, and nothing rests on it. Near an edge the way from there has rounding,
        // and the normal of a polygon's edge is the same at any distance.
        if let Feature::Edge(e) = near.feature
            && (on_outline || outline.len() > 2)
        {
            let edge = outline[(e + 1) % outline.len()] - outline[e];
            away = -left(edge) * near.distance.signum();
        }
        let law = self.law_of_points(info.group, b);
        let corner = match near.feature {
            Feature::Vertex(v) if on_outline => corner(outline, v),
            _ => None,
        };
        if let Some([before, after]) = corner {
            away = (before + after) * near.distance.signum();
        }
        let mut place = Place::between(x, radii, away, near.distance, info.radius);
        if on_outline && matches!(near.feature, Feature::Edge(_)) {
            place.curvature = 1.0 / info.radius;
        }
        if let Some([before, after]) = corner {
            // A solver may take it for a corner only where rounding says no more than a thousandth of its direction.
            place.curvature = (0.5 * before.angle(&after) + 1e-3) / place.blur;
            sums.expected.is_last = true;
        }
        let was = self.previous.get(&info.id);
        place.fallen = was.map(|was| near.distance - nearest(outline, body.carried(*was)).distance);
        let Place { overlap, at, .. } = place;
        let who = Who::Point(info.id, b, part);
        if overlap < -2.0 * info.radius && !self.history.contains_key(&who) {
            return;
        }
        if corner.is_none() {
            sums.doubt(outline, (x, near.distance), &place);
        }
        let r = at - body.pose.xy();
        let sides = [self.point(step, info, state, at), body.side(r)];
        let (touch, law) = self.touch(step, (who, law), sides, place, sums);
        let [k_n, k_t] = place.least_stiffness(&law);
        let point = &mut sums.expected.points[slot];
        point.couple += cross(at - x, touch.force);
        let stiffness = [k_n, k_t];
        sums.press(
            slot,
            (&touch, 1.0),
            (&law, stiffness),
            (info.radius, place.blur),
        );
        let load = &mut sums.expected.loads[b];
        load.points -= touch.force.push(cross(r, touch.force));
        load.contacts += u64::from(overlap > 0.0);
        load.blur += touch.blur;
        // L-2 counts what is within half a radius, as F-6 does.
        if overlap + 0.5 * info.radius > 0.0 {
            load.rate += body.rate(r, place.normal, [k_n, k_t]);
        }
    }

    /// What a contact at a place (m) takes of a point: its surface turns with its spin.
    fn point(&self, step: &Step, info: &ImpInfo, state: &ImpState, at: Vec2) -> Side {
        let (x, was) = (Vec2::from(state.position), self.previous.get(&info.id));
        let turning = left(at - x) * state.spin;
        // Nothing resists the rolling of a point.
        let moved = was.map(|was| (x - was + turning * step.dt_before).push(0.0));
        (1.0 / info.mass, moved, Vec2::from(state.velocity) + turning)
    }

    /// Section 7: the points of two groups that touch.
    fn pairs_of_points(&self, step: &Step, set: &[ImpInfo], states: &[ImpState], sums: &mut Sums) {
        for p in 0..set.len() {
            for q in 0..p {
                // The first point of a pair is the one in the lower slot; N goes to it.
                let (first, second) = (&set[q], &set[p]);
                let groups = [first.group as usize, second.group as usize];
                let pairs = &mut self.config.group_pairs.iter();
                let Some(pair) = pairs.find(|pair| {
                    let [a, b] = pair.between;
                    [a, b] == groups || [b, a] == groups
                }) else {
                    continue;
                };
                let at = |slot: usize| Vec2::from(states[slot].position);
                let (away, radii) = (at(q) - at(p), [first.radius, second.radius]);
                let least = first.radius.min(second.radius);
                let mut place = Place::between(at(q), radii, away, away.norm(), least);
                let were = [first, second].map(|info| self.previous.get(&info.id));
                if let [Some(one), Some(other)] = were {
                    place.fallen = Some(away.norm() - (one - other).norm());
                }
                let overlap = place.overlap;
                let who = Who::Points(first.id, second.id);
                if overlap < -2.0 * least && !self.history.contains_key(&who) {
                    continue;
                }
                let sides = [(first, q), (second, p)]
                    .map(|(info, k)| self.point(step, info, &states[k], place.at));
                let (touch, law) = self.touch(step, (who, &pair.law), sides, place, sums);
                let [k_n, k_t] = place.least_stiffness(&law);
                let stiffness = [2.0 * k_n.max(k_t), 2.0 * k_t];
                for (slot, sign) in [(q, 1.0), (p, -1.0)] {
                    let point = &mut sums.expected.points[slot];
                    point.couple += cross(place.at - at(slot), touch.force) * sign;
                    sums.press(slot, (&touch, sign), (&law, stiffness), (least, place.blur));
                }
            }
        }
    }

    /// Every vertex at every edge, both ways (Jiang 2020 eq. 39 read literally), or at the nearest one. Two discs count once.
    fn bodies_and_bodies(&self, step: &Step, sums: &mut Sums) {
        if self.config.body_contact.is_none() {
            return;
        }
        let mut springs = Vec::new();
        for (i, one) in self.bodies.iter().enumerate() {
            for (j, other) in self.bodies.iter().enumerate() {
                // A corner and a disc are an end of the disc at an edge.
                let again = other.is_round() && (i > j || !one.is_round());
                let moves = one.is_moved_by_forces() || other.is_moved_by_forces();
                if i == j || again || !moves || self.are_apart(i, j) {
                    continue;
                }
                if self.config.overlap == OverlapMeasure::Area {
                    // The pair is one contact.
                    let once = (i < j).then(|| self.area(step, [i, j], sums));
                    springs.extend(once.flatten());
                    continue;
                }
                let (own, outline) = (one.corners(), other.corners());
                for (v, (x, _)) in one.outline().enumerate() {
                    let places = self.places(x, [&own, &outline], other.is_round());
                    for (e, y) in places.into_iter().enumerate() {
                        let spring = self.vertex_and_edge(step, [(i, v), (j, e)], x, y, sums);
                        springs.extend(spring);
                    }
                }
            }
        }
        let eigenvalue = |part: usize| largest(&springs, part);
        (sums.expected.own_omega_sq, sums.expected.own_damping) = (eigenvalue(0), eigenvalue(1));
        sums.expected.begun_omega_sq = largest(&sums.begun, 0);
    }

    /// Squared frequency in 1/s^2 of the stiffest two bodies, at least, wherever and however they touch.
    fn stiffest_pair(&self) -> f64 {
        let Some(common) = &self.config.body_contact else {
            return 0.0;
        };
        let pair = Pair::default();
        let rate = |one: &Body, other: &Body| {
            let law = self.law([&one.surface, &other.surface], common);
            let light = [one, other].map(|body| body.mobility().xy().min());
            Law::of(law, pair).normal_stiffness(0.0) * (light[0] + light[1])
        };
        let pairs = self.bodies.iter().enumerate();
        let pairs = pairs.flat_map(|(i, one)| self.bodies[..i].iter().map(move |b| rate(one, b)));
        pairs.fold(0.0, f64::max)
    }

    /// L-2's 4 v/l of two bodies that touch and approach, and 8 w where they rub, in 1/s. The length in which a force has the right
    /// sign is that of the radii for discs and with every edge; with other measures it is longer.
    fn kinematic_rate(&self, touch: &Touch) -> f64 {
        let Who::Bodies(i, v, j, e) = touch.who else {
            return 0.0;
        };
        let pair = [&self.bodies[i], &self.bodies[j]];
        let [one, other] = pair.map(|body| body.side(touch.at - body.pose.xy()).2);
        let approach = (other - one).dot(&touch.normal).max(0.0);
        let rubs = if touch.limit > 0.0 { 8.0 } else { 0.0 };
        let turning = pair.map(|body| rubs * body.velocity.z.abs());
        let each_edge = self.config.overlap == OverlapMeasure::EachEdge;
        let length = pair[0].vertices[v].1 + pair[1].vertices[e].1;
        let passing = if each_edge || pair.iter().all(|body| body.is_round()) {
            4.0 * approach / length
        } else {
            0.0
        };
        turning.into_iter().fold(passing, f64::max)
    }

    /// Whether the circles around two bodies are so far apart that no law reaches across, and nothing is remembered of the pair.
    fn are_apart(&self, i: usize, j: usize) -> bool {
        let (one, other) = (&self.bodies[i], &self.bodies[j]);
        let gap = (one.pose - other.pose).xy().norm() - one.reach - other.reach;
        let pairs = Who::Bodies(i, 0, 0, 0)..Who::Bodies(i + 1, 0, 0, 0);
        let with = |who: &Who| matches!(who, Who::Bodies(_, _, with, _) if *with == j);
        // At 0.5 `vertex_and_edge` looks no further; more, for rounding.
        gap > 0.501 * (one.largest_radius() + other.largest_radius())
            && !self.history.range(pairs).any(|(who, _)| with(who))
    }

    /// Where a vertex at `x` may touch an outline, or discs at its vertices: places, each with its distance from `x`, in m.
    fn places(&self, x: Vec2, [own, outline]: [&[Vec2]; 2], round: bool) -> Vec<(Vec2, f64)> {
        let apart = |y: Vec2| (y, (x - y).norm());
        if round {
            return outline.iter().map(|y| apart(*y)).collect();
        }
        if self.config.overlap == OverlapMeasure::NearestEdge {
            let near = nearest(outline, x);
            if near.distance >= 0.0 {
                return vec![(near.point, near.distance)];
            }
            let faced = faces(own, outline, x).remove(0);
            return vec![(x + faced.normal * faced.depth, -faced.depth)];
        }
        let nearest_on = |[a, b]: [Vec2; 2]| apart(nearest_on_edge(a, b, x, 0, 1).0);
        edges(outline).map(nearest_on).collect()
    }

    /// A vertex of one body at `x`, and the place `y` of an edge of another one that is nearest to it, `apart`, which is
    /// negative if the vertex is inside. Returns the spring.
    fn vertex_and_edge(
        &self,
        step: &Step,
        [(i, v), (j, e)]: [(usize, usize); 2],
        x: Vec2,
        (y, apart): (Vec2, f64),
        sums: &mut Sums,
    ) -> Option<Spring> {
        let (one, other) = (&self.bodies[i], &self.bodies[j]);
        let (a, b) = (one.vertices[v].1, other.vertices[e].1);
        let away = x - y;
        let who = Who::Bodies(i, v, j, e);
        if apart > (1.5 + BLUR) * (a + b) && !self.history.contains_key(&who) {
            return None;
        }
        let mut place = Place::between(x, [a, b], away, apart, a + b);
        let from = other.carried(one.was(x));
        let outline = other.corners();
        let edge = [0, 1].map(|k| outline[(e + k) % outline.len()]);
        place.fallen = Some(if other.is_round() {
            apart - (from - outline[e]).norm()
        } else if self.config.overlap == OverlapMeasure::EachEdge {
            apart - (from - nearest_on_edge(edge[0], edge[1], from, 0, 1).0).norm()
        } else if apart < 0.0 {
            (x - from).dot(&place.normal)
        } else {
            apart - nearest(&outline, from).distance
        });
        if self.config.overlap == OverlapMeasure::NearestEdge && !other.is_round() {
            let faces = faces(&one.corners(), &other.corners(), x);
            let tie = faces.len() > 1 && faces[1].whole - faces[0].whole <= 4.0 * place.blur;
            if apart >= 0.0 {
                sums.doubt(&other.corners(), (x, apart), &place);
            } else if tie {
                sums.expected.doubtful = Some("a body as deep behind one edge as behind another");
            }
        }
        self.pair(step, who, [i, j], place, sums)
    }

    /// A contact between two bodies, booked. Returns the spring.
    fn pair(
        &self,
        step: &Step,
        who: Who,
        [i, j]: [usize; 2],
        place: Place,
        sums: &mut Sums,
    ) -> Option<Spring> {
        let common = self.config.body_contact.as_ref()?;
        let (one, other) = (&self.bodies[i], &self.bodies[j]);
        let Place { at, normal, .. } = place;
        let (r, s) = (at - one.pose.xy(), at - other.pose.xy());
        let law = self.law([&one.surface, &other.surface], common);
        let mut sides = [one.side(r), other.side(s)];
        for (side, body) in sides.iter_mut().zip([one, other]) {
            side.0 = f64::from(u8::from(body.is_moved_by_forces())) / body.inertia.x;
        }
        let (touch, law) = self.touch(step, (who, law), sides, place, sums);
        let mut row = DVector::zeros(3 * self.bodies.len());
        for (b, sign, r) in [(i, 1.0, r), (j, -1.0, s)] {
            let load = &mut sums.expected.loads[b];
            let moment = cross(r, touch.force) + touch.moment;
            load.bodies += touch.force.push(moment) * sign;
            load.blur += touch.blur;
            let roots = self.bodies[b].mobility().map(f64::sqrt);
            let stretch = normal.push(cross(r, normal)).component_mul(&roots) * sign;
            row.fixed_rows_mut::<3>(3 * b).copy_from(&stretch);
        }
        if place.overlap <= 0.0 {
            return None;
        }
        let stiffness = law.normal_stiffness(place.overlap);
        let [dashpot, _] = law.dashpots([stiffness; 2]);
        let spring = ([stiffness, dashpot], row * place.gain);
        let begun = (!self.history.contains_key(&who)).then(|| spring.clone());
        sums.begun.extend(begun);
        Some(spring)
    }

    /// What a contact exerts, booked, and its law.
    fn touch(
        &self,
        step: &Step,
        (who, law): (Who, &ContactLaw),
        [(light, gone, fast), (other_light, other_gone, other_fast)]: [Side; 2],
        place: Place,
        sums: &mut Sums,
    ) -> (Touch, Law) {
        let Place {
            overlap,
            normal,
            at,
            radius,
            gain,
            ..
        } = place;
        let mass = inverse(light + other_light);
        let law = Law::of(law, Pair { mass, radius });
        let per_dt = inverse(step.dt_before);
        let moved = match (gone, other_gone) {
            (Some(gone), Some(other)) if per_dt > 0.0 => gone - other,
            _ => Vec3::zeros(),
        };
        let (moved, rolled) = (moved.xy(), moved.z);
        let velocity = if per_dt > 0.0 {
            moved * per_dt
        } else {
            fast - other_fast
        };
        let mut motion = Motion {
            overlap,
            moved: along(moved * gain, normal),
            velocity: along(velocity * gain, normal),
            rolled,
        };
        if let Some(fallen) = place.fallen.filter(|_| per_dt > 0.0) {
            (motion.moved[0], motion.velocity[0]) = (fallen, fallen * per_dt);
        }
        let before = self.history.get(&who).copied().unwrap_or_default();
        let exerted = law.exert(&motion, &before);
        let [f_n, f_t] = exerted.force;
        let [by_place, by_speed] = exerted.sensitivity;
        let force = (normal * f_n + left(normal) * f_t) * gain;
        // A turn of the normal turns the force, and motions along it into motions across.
        let motions = 2.0 * (by_place * moved.norm() + by_speed * velocity.norm());
        let steep = (by_place + by_speed * per_dt) * gain
            + place.curvature * (force.norm() + motions * gain);
        sums.book(&exerted, (&law, &before), &place);
        let touch = Touch {
            who,
            overlap,
            at,
            force,
            normal,
            limit: exerted.limit * gain,
            held: exerted.history.energy(),
            moment: exerted.moment,
            moved: moved.norm(),
            blur: place.blur * steep,
            turns: place.blur * place.curvature,
        };
        if overlap > 0.0 {
            sums.history.insert(who, exerted.history);
            sums.expected.touches.push(touch);
        } else if self.history.contains_key(&who) {
            sums.expected.parted.push((who, moved.norm()));
        }
        (touch, law)
    }

    /// T-1's kick, and what is measured of it (section 9).
    fn kick(&mut self, step: &Step, sums: &mut Sums) {
        let given = self.given.take().into_iter().flatten();
        for (load, given) in sums.expected.loads.iter_mut().zip(given) {
            load.points = given;
        }
        let (kick, w) = (step.kick(), step.centring());
        let keeps = step.dt_before > 0.0 || step.dt > 0.0;
        let gravity = Vec2::from(self.config.gravity);
        let viscous = [0, 1].map(|k| self.viscous[k] + sums.viscous[k]);
        let (mut driven, mut applied, mut contact) = (0.0, self.applied, self.contact);
        let mut turning = 0.0;
        let (mut momentum, mut pressing) = (Vec2::zeros(), Vec2::zeros());
        let expected = &mut sums.expected;
        let mut ledger = Ledger {
            contact: sums.stored,
            friction_work: self.friction + sums.friction,
            viscous_work: viscous[0],
            ..Ledger::default()
        };
        for (body, load) in self.bodies.iter_mut().zip(&expected.loads) {
            let free = f64::from(u8::from(body.is_moved_by_forces()));
            let weight = (gravity * body.inertia.x * free).push(0.0);
            let (push, torque) = body.drive.push(step.span());
            let push = push.push(torque);
            let total = load.points + load.bodies + weight + push;
            let before = body.velocity;
            let after = before + total.component_mul(&body.mobility()) * kick;
            // What supports and guides take up.
            let guide = total.component_mul(&body.yields) - total;
            driven += (push + guide).dot(&(before + after)) * 0.5 * kick;
            let place = body.pose.xy();
            expected.far = expected.far.max(place.norm() + body.reach);
            let about_origin = |of: Vec3| of.xy().push(cross(place, of.xy()) + of.z);
            applied += about_origin(weight + push + guide) * kick;
            contact += about_origin(load.points) * kick;
            turning += about_origin(after.component_mul(&body.inertia)).z * free;
            let squares =
                before.component_mul(&before) * (1.0 - w) + after.component_mul(&after) * w;
            let kinetic = squares.component_mul(&body.inertia) * 0.5 * free;
            ledger.kinetic += kinetic.x + kinetic.y;
            ledger.kinetic_rotation += kinetic.z;
            ledger.gravity -= weight.dot(&body.pose);
            ledger.contacts += u64::from(load.contacts > 0);
            momentum += after.xy() * body.inertia.x * free;
            pressing += load.points.xy();
            let velocity = before * (1.0 - w) + after * w;
            expected.bodies.push(BodyState {
                position: body.pose.xy().into(),
                velocity: velocity.xy().into(),
                angle: body.pose.z,
                spin: velocity.z,
                mass: body.inertia.x,
                inertia: body.inertia.z,
                point_force: load.points.xy().into(),
                point_torque: load.points.z,
                body_force: load.bodies.xy().into(),
                body_torque: load.bodies.z,
                contacts: load.contacts,
            });
            expected.speed = expected.speed.max(body.speed(after));
            if keeps {
                body.velocity = after;
            }
        }
        ledger.driven_work = self.driven + w * driven;
        ledger.applied_impulse = applied.xy().into();
        ledger.contact_impulse = contact.xy().into();
        (ledger.applied_moment, ledger.contact_moment) = (applied.z, contact.z);
        ledger.angular_momentum = turning;
        ledger.momentum = momentum.into();
        ledger.contact_force = pressing.into();
        expected.ledger = ledger;
        expected.viscous_most = viscous[1];
        if keeps {
            (self.friction, self.viscous) = (ledger.friction_work, viscous);
            (self.applied, self.contact) = (applied, contact);
            self.driven += driven;
        }
    }
}

/// The largest eigenvalue of the bodies on their normal springs (1/s^2), or on their dashpots (1/s).
fn largest(springs: &[Spring], part: usize) -> f64 {
    let both = |i: usize, j: usize| {
        let [(k, row), (other_k, other)] = [&springs[i], &springs[j]];
        (k[part] * other_k[part]).sqrt() * row.dot(other)
    };
    match springs.len() {
        0 => 0.0,
        n => DMatrix::from_fn(n, n, both).symmetric_eigenvalues().max(),
    }
}

/// 0 of what is not above 0.
fn inverse(x: f64) -> f64 {
    if x > 0.0 { 1.0 / x } else { 0.0 }
}

/// Parts along N and T.
fn along(v: Vec2, normal: Vec2) -> [f64; 2] {
    [v.dot(&normal), v.dot(&left(normal))]
}

/// The normals between which a point on a corner of a polygon is pushed.
fn corner(outline: &[Vec2], v: usize) -> Option<[Vec2; 2]> {
    let n = outline.len();
    let edge = |k: usize| outline[(k + 1) % n] - outline[k % n];
    (n > 2).then(|| [v + n - 1, v].map(|k| -left(edge(k).normalize())))
}

/// Whether two places of an outline, more than a little apart, are both nearest to `x` within `blur` (m), or it is on a corner
/// or a segment: then rounding decides which way a point is pushed. `distance` is that of the nearest (m).
fn has_two_normals(outline: &[Vec2], x: Vec2, distance: f64, blur: f64) -> bool {
    if outline.len() == 1 {
        return distance <= blur;
    }
    let feet = edges(outline).map(|[a, b]| nearest_on_edge(a, b, x, 0, 1).0);
    let near = |y: &Vec2| (x - y).norm() - distance.abs() <= 2.0 * blur;
    let nearest: Vec<Vec2> = feet.filter(near).collect();
    let apart = |a: &Vec2, b: &Vec2| (a - b).norm() > 1e-4 * blur.sqrt();
    let on_it = distance.abs() <= blur;
    on_it && (outline.len() == 2 || nearest.len() > 1)
        || nearest.iter().any(|a| nearest.iter().any(|b| apart(a, b)))
}
