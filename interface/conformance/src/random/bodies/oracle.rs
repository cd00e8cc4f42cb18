//! The oracle of the bodies' side: what PROTOCOL.md and docs/physics.md say of a step, term by term, without lists, trees
//! or chunks. It shares with the built-in solver the configuration's types and the mass properties of a shape.

use std::collections::BTreeMap;

use interface::Vec2;
use interface::config::{BodyConfig, BodyShape, ContactLaw, DemConfig, Motion as Drive};
use interface::message::wire::{BodyState, ContactState, ImpInfo, ImpState, Ledger};
use interface::step::Step;
use mechanics::mass::{cross, swept, union_of_discs};
use mechanics::outline::{nearest, nearest_on_edge};

use super::law::{History, Law, Motion, Pair};

/// Distances (m) below this share of a point's radius are not told apart: rounding, and its growth over a run.
pub const BLUR: f64 = 1e-8;

/// A body at `t_n`, with the velocities of `t_{n-1/2}`.
#[derive(Debug, Clone)]
pub struct Body {
    /// In kg/m.
    pub mass: f64,
    /// In kg m.
    pub inertia: f64,
    drive: Drive,
    surface: String,
    /// Vertices from the centre of mass at an angle of 0, in m.
    vertices: Vec<Vec2>,
    /// Sphero-radius of each vertex in m.
    radii: Vec<f64>,
    /// A cluster: every vertex is a disc of its own.
    cluster: bool,
    /// Centre of mass in m.
    pub center: Vec2,
    /// In rad.
    pub angle: f64,
    /// In m/s.
    pub velocity: Vec2,
    /// In rad/s.
    pub spin: f64,
    /// Translation (m) and rotation (rad) of the last drift.
    last: (Vec2, f64),
}

fn turned(v: Vec2, angle: f64) -> Vec2 {
    let (s, c) = angle.sin_cos();
    Vec2::new(c * v.x - s * v.y, s * v.x + c * v.y)
}

fn left(v: Vec2) -> Vec2 {
    Vec2::new(-v.y, v.x)
}

impl Body {
    fn new(config: &BodyConfig) -> Self {
        let mut vertices: Vec<Vec2> = config.shape.vertices().iter().map(|&v| v.into()).collect();
        let first = vertices[0];
        let corner = |w: &[Vec2]| cross(w[0] - first, w[1] - first);
        let cluster = matches!(config.shape, BodyShape::Cluster { .. });
        if !cluster && vertices.windows(2).map(corner).sum::<f64>() < 0.0 {
            vertices.reverse();
        }
        let mut radii = vec![config.sphero_radius; vertices.len()];
        if let BodyShape::Cluster { radii: own, .. } = &config.shape
            && !own.is_empty()
        {
            radii.clone_from(own);
        }
        let moments = if cluster {
            union_of_discs(&vertices, &radii)
        } else {
            swept(&vertices, config.sphero_radius)
        };
        let (mass, inertia) = moments.mass(config.inertia);
        Self {
            mass,
            inertia,
            drive: config.motion,
            surface: config.surface.clone(),
            vertices: vertices.iter().map(|v| v - moments.centroid).collect(),
            radii,
            cluster,
            center: Vec2::from(config.position) + turned(moments.centroid, config.angle),
            angle: config.angle,
            velocity: config.velocity.into(),
            spin: config.spin,
            last: (Vec2::zeros(), 0.0),
        }
    }

    /// The outline in m.
    pub fn outline(&self) -> Vec<Vec2> {
        let at = |v: &Vec2| self.center + turned(*v, self.angle);
        self.vertices.iter().map(at).collect()
    }

    /// The outlines that a point touches one by one, each with its sphero-radius: one, or the discs of a cluster.
    pub fn parts(&self) -> Vec<(Vec<Vec2>, f64)> {
        let outline = self.outline();
        if self.cluster {
            let discs = outline.into_iter().zip(&self.radii);
            discs.map(|(v, a)| (vec![v], *a)).collect()
        } else {
            vec![(outline, self.radii[0])]
        }
    }

    fn yields(&self) -> [f64; 3] {
        self.drive.yielding()
    }

    /// `1/m` along x and y, and `1/I`; 0 in directions in which forces do not move it.
    fn mobility(&self) -> [f64; 3] {
        let [x, y, turn] = self.yields();
        [x / self.mass, y / self.mass, turn / self.inertia]
    }

    /// The larger of `1/m` along x and y.
    fn lightness(&self) -> f64 {
        self.mobility()[0].max(self.mobility()[1])
    }

    /// What a contact at `r` (m) from the centre of mass takes of it.
    fn side(&self, r: Vec2) -> Side {
        (self.lightness(), Some(self.moved(r)), self.velocity_at(r))
    }

    /// Displacement in m, in the last drift, of the material that is now at `r` (m) from the centre of mass.
    pub fn moved(&self, r: Vec2) -> Vec2 {
        self.last.0 + r - turned(r, -self.last.1)
    }

    /// Velocity in m/s at `r` (m) from the centre of mass.
    fn velocity_at(&self, r: Vec2) -> Vec2 {
        self.velocity + left(r) * self.spin
    }

    /// The fastest point of the surface in m/s.
    pub fn speed(&self) -> f64 {
        let corners = self.vertices.iter().zip(&self.radii);
        let speed = |(v, a): (&Vec2, &f64)| {
            self.velocity_at(turned(*v, self.angle)).norm() + a * self.spin.abs()
        };
        corners.map(speed).fold(0.0, f64::max)
    }

    /// Displacement in m of the point of the surface that has gone farthest since `then`, as far as 16 directions around
    /// every vertex show it.
    fn gone_since(&self, (center, angle): (Vec2, f64)) -> f64 {
        let mut gone = 0.0_f64;
        for (v, a) in self.vertices.iter().zip(&self.radii) {
            for k in 0..16 {
                let way = f64::from(k) * std::f64::consts::TAU / 16.0;
                let at = v + Vec2::new(way.cos(), way.sin()) * *a;
                let now = self.center + turned(at, self.angle);
                // Less what rounding makes of a body that does not move.
                let rounding = 1e-14 * (now.norm() + at.norm());
                gone = gone.max((now - center - turned(at, angle)).norm() - rounding);
            }
        }
        gone
    }
}

/// Who touch: a body and a point (part of the body, id), two bodies, or two points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Who {
    /// Id of the point, body, part of the body.
    Point(u64, usize, usize),
    /// The owner of the vertex and its vertex, the owner of the edge and its edge.
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
    /// Displacement over the last step of one side relative to the other, in m.
    pub moved: f64,
    /// How far the force may be off by rounding, in N/m.
    pub blur: f64,
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
    /// Least stiffness that may be said, in N/m, and whether it is the only one.
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
    pub points: (Vec2, f64),
    /// Of bodies.
    pub bodies: (Vec2, f64),
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
    /// What is exactly at the edge between two answers, so that rounding decides: nothing can be compared from here on.
    pub doubtful: Option<&'static str>,
    /// Largest squared frequency in 1/s^2 that the bodies have by contact with one another, at least.
    pub own_omega_sq: f64,
    /// Largest damping ratio of a contact in reach.
    pub damping: f64,
    /// Fastest point of a surface at `t_{n+1/2}`, in m/s.
    pub speed: f64,
    /// Displacement of the fastest surface since the last envelopes at `t_{n+1}`, in m; `None` before the first.
    pub travel: Option<f64>,
    /// The ledger as measured in this step; of `viscous_work` the least, [`Expected::viscous_most`] has the most.
    pub ledger: Ledger,
    /// In J/m.
    pub viscous_most: f64,
    /// The bodies as measured in this step.
    pub bodies: Vec<BodyState>,
}

/// The bodies and what they remember.
#[derive(Debug, Clone)]
pub struct Oracle {
    config: DemConfig,
    /// At `t_n`.
    pub bodies: Vec<Body>,
    history: BTreeMap<Who, History>,
    /// Position in m of each point one step before.
    previous: BTreeMap<u64, Vec2>,
    /// Poses at the last envelopes.
    published: Option<Vec<(Vec2, f64)>>,
    friction: f64,
    viscous: [f64; 2],
    driven: f64,
    applied: Vec2,
    contact: Vec2,
}

/// What a step adds up while it looks at contacts.
#[derive(Default)]
struct Sums {
    expected: Expected,
    history: BTreeMap<Who, History>,
    stored: f64,
    friction: f64,
    viscous: [f64; 2],
}

/// A normal spring: the body with the vertex and the arm in m, that with the edge, the normal, and the stiffness in N/m.
type Spring = (usize, Vec2, usize, Vec2, Vec2, f64);

/// One of two that may touch: 1/m in m/kg, and where they touch the displacement over the last step in m, if it is known, and
/// the velocity in m/s.
type Side = (f64, Option<Vec2>, Vec2);

/// Where two may touch.
#[derive(Clone, Copy)]
struct Place {
    overlap: f64,
    /// From the second to the first.
    normal: Vec2,
    at: Vec2,
    /// R* in m.
    radius: f64,
    /// Below this (m) nothing is told apart.
    blur: f64,
    /// How much the normal turns (rad) by a shift of a metre.
    curvature: f64,
}

impl Sums {
    /// A contact presses on the point in a slot, this way, with a stiffness (N/m). The smallest radius of the two is `least`
    /// (m); F-6 counts what is within half of it.
    fn press(
        &mut self,
        slot: usize,
        (touch, sign): (&Touch, f64),
        (law, stiffness): (&Law, f64),
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
            point.exact &= law.is_linear();
            self.expected.damping = self.expected.damping.max(law.damping_ratio);
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
            previous: BTreeMap::new(),
            published: None,
            friction: 0.0,
            viscous: [0.0; 2],
            driven: 0.0,
            applied: Vec2::zeros(),
            contact: Vec2::zeros(),
        }
    }

    /// The law between two that carry these surfaces, where `common` holds for all others.
    fn law<'a>(&'a self, surfaces: [&str; 2], common: &'a ContactLaw) -> &'a ContactLaw {
        let [a, b] = surfaces;
        let pairs = self.config.contact_pairs.iter();
        let mut pairs = pairs.filter(|_| !a.is_empty() && !b.is_empty());
        let found = pairs.find(|pair| {
            let [p, q] = [pair.between[0].as_str(), pair.between[1].as_str()];
            [p, q] == [a, b] || [q, p] == [a, b]
        });
        found.map_or(common, |pair| &pair.law)
    }

    /// The outlines have been asked for.
    pub fn publish(&mut self) {
        let poses = self.bodies.iter().map(|b| (b.center, b.angle));
        self.published = Some(poses.collect());
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
        self.points_and_bodies(step, set, states, &mut sums);
        self.pairs_of_points(step, set, states, &mut sums);
        self.bodies_and_bodies(step, &mut sums);
        self.kick(step, &mut sums);
        let mut expected = sums.expected;
        if step.dt_before > 0.0 || step.dt > 0.0 {
            self.history = sums.history;
            let places = set.iter().zip(states);
            self.previous = places.map(|(i, s)| (i.id, s.position.into())).collect();
            for body in &mut self.bodies {
                body.last = (body.velocity * step.dt, body.spin * step.dt);
                body.center += body.last.0;
                body.angle += body.last.1;
            }
        }
        expected.travel = self.published.as_ref().map(|poses| {
            let gone = self
                .bodies
                .iter()
                .zip(poses)
                .map(|(b, then)| b.gone_since(*then));
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
        for (slot, point) in set.iter().zip(states).enumerate() {
            for (b, body) in self.bodies.iter().enumerate() {
                for (part, (outline, a)) in body.parts().iter().enumerate() {
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
        let overlap = a + info.radius - near.distance;
        if overlap < -2.0 * info.radius {
            return;
        }
        let blur = BLUR * info.radius;
        if has_two_normals(outline, x, near.distance, blur) && overlap > -blur {
            sums.expected.doubtful = Some("a point as near to one edge as to another");
        }
        let away = x - near.point;
        let normal = away / (near.distance.signum() * away.norm());
        let at = x - normal * (info.radius - 0.5 * overlap);
        let r = at - body.center;
        let both = a * info.radius / (a + info.radius);
        let place = Place {
            overlap,
            normal,
            at,
            radius: if a > 0.0 { both } else { info.radius },
            blur,
            curvature: 1.0 / near.distance.abs().max(blur),
        };
        let surfaces = &self.config.point_surfaces;
        let surface = surfaces.get(info.group as usize).map_or("", String::as_str);
        let law = self.law([surface, &body.surface], &self.config.point_contact);
        let sides = [self.point(info, state), body.side(r)];
        let who = Who::Point(info.id, b, part);
        let (touch, law) = self.touch(step, (who, law), sides, place, sums);
        let k_n = law.normal_stiffness(overlap);
        sums.press(slot, (&touch, 1.0), (&law, k_n), (info.radius, blur));
        let load = &mut sums.expected.loads[b];
        load.points.0 -= touch.force;
        load.points.1 -= cross(r, touch.force);
        load.contacts += u64::from(overlap > 0.0);
        load.blur += touch.blur;
        // L-2 counts what is within half a radius, as F-6 does.
        if overlap + 0.5 * info.radius > 0.0 {
            let k_t = law.tangential_stiffness(k_n);
            let (light, turns) = (body.lightness(), body.mobility()[2]);
            let (n, t) = (cross(r, normal), cross(r, left(normal)));
            load.rate += k_n * (light + n * n * turns) + k_t * (light + t * t * turns);
        }
    }

    fn point(&self, info: &ImpInfo, state: &ImpState) -> Side {
        let was = self.previous.get(&info.id);
        let moved = was.map(|was| Vec2::from(state.position) - was);
        (1.0 / info.mass, moved, state.velocity.into())
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
                let (away, reach) = (at(q) - at(p), first.radius + second.radius);
                let overlap = reach - away.norm();
                let least = first.radius.min(second.radius);
                if overlap < -2.0 * least {
                    continue;
                }
                let normal = away.normalize();
                let place = Place {
                    overlap,
                    normal,
                    at: at(q) - normal * (first.radius - 0.5 * overlap),
                    radius: first.radius * second.radius / reach,
                    blur: BLUR * least,
                    curvature: 1.0 / away.norm(),
                };
                let sides = [(first, q), (second, p)].map(|(info, k)| self.point(info, &states[k]));
                let who = Who::Points(first.id, second.id);
                let (touch, law) = self.touch(step, (who, &pair.law), sides, place, sums);
                let k_n = law.normal_stiffness(overlap);
                let k = 2.0 * k_n.max(law.tangential_stiffness(k_n));
                for (slot, sign) in [(q, 1.0), (p, -1.0)] {
                    sums.press(slot, (&touch, sign), (&law, k), (least, place.blur));
                }
            }
        }
    }

    /// Jiang 2020 eq. 39 read literally: every vertex at every edge, both ways. Two discs count once.
    fn bodies_and_bodies(&self, step: &Step, sums: &mut Sums) {
        if self.config.body_contact.is_none() {
            return;
        }
        let mut springs = Vec::new();
        for (i, one) in self.bodies.iter().enumerate() {
            for (j, other) in self.bodies.iter().enumerate() {
                let free = |b: &Body| b.yields() != [0.0; 3];
                if i == j || !(free(one) || free(other)) {
                    continue;
                }
                let (vertices, edges) = (one.outline(), other.outline());
                let n = if other.cluster { 1 } else { edges.len() };
                let discs = |b: &Body| b.cluster || b.vertices.len() == 1;
                if discs(one) && discs(other) && i > j || discs(other) && !discs(one) {
                    continue;
                }
                for (v, x) in vertices.iter().enumerate() {
                    let count = match edges.len() {
                        _ if discs(other) => edges.len(),
                        2 => 1,
                        n => n,
                    };
                    for e in 0..count {
                        let y = if discs(other) {
                            edges[e]
                        } else {
                            nearest_on_edge(edges[e], edges[(e + 1) % n], *x, 0, 1).0
                        };
                        let spring = self.vertex_and_edge(step, [(i, v), (j, e)], *x, y, sums);
                        springs.extend(spring);
                    }
                }
            }
        }
        sums.expected.own_omega_sq = self.frequency(&springs);
    }

    /// A vertex of one body at `x`, and the place `y` of an edge of another one that is nearest to it. Returns the spring.
    fn vertex_and_edge(
        &self,
        step: &Step,
        [(i, v), (j, e)]: [(usize, usize); 2],
        x: Vec2,
        y: Vec2,
        sums: &mut Sums,
    ) -> Option<Spring> {
        let common = self.config.body_contact.as_ref()?;
        let (one, other) = (&self.bodies[i], &self.bodies[j]);
        let (a, b) = (one.radii[v], other.radii[e]);
        let away = x - y;
        let overlap = a + b - away.norm();
        let blur = BLUR * (a + b);
        if overlap < -blur - 0.5 * (a + b) {
            return None;
        }
        let normal = away.normalize();
        let at = x - normal * (a - 0.5 * overlap);
        let (r, s) = (at - one.center, at - other.center);
        let place = Place {
            overlap,
            normal,
            at,
            radius: if a > 0.0 && b > 0.0 {
                a * b / (a + b)
            } else {
                0.0
            },
            blur,
            curvature: 1.0 / away.norm(),
        };
        let law = self.law([&one.surface, &other.surface], common);
        let who = Who::Bodies(i, v, j, e);
        let sides = [one.side(r), other.side(s)];
        let (touch, law) = self.touch(step, (who, law), sides, place, sums);
        for (b, sign, r) in [(i, 1.0, r), (j, -1.0, s)] {
            let load = &mut sums.expected.loads[b];
            load.bodies.0 += touch.force * sign;
            load.bodies.1 += cross(r, touch.force) * sign;
            load.blur += touch.blur;
        }
        if overlap <= 0.0 {
            return None;
        }
        sums.expected.damping = sums.expected.damping.max(law.damping_ratio);
        Some((i, r, j, s, normal, law.normal_stiffness(overlap)))
    }

    /// The largest squared frequency in 1/s^2 of the bodies on their normal springs: a Rayleigh quotient, so never above it.
    fn frequency(&self, springs: &[Spring]) -> f64 {
        // Unknowns are sqrt(m) u, sqrt(m) v, sqrt(I) theta of each body, begun with what presses one spring.
        let row = |&(i, r, j, s, n, _): &Spring| {
            let mut row = vec![0.0; 3 * self.bodies.len()];
            for (b, arm, sign) in [(i, r, 1.0), (j, s, -1.0)] {
                let stretch = [n.x, n.y, cross(arm, n)];
                for (k, mobility) in self.bodies[b].mobility().into_iter().enumerate() {
                    row[3 * b + k] = sign * stretch[k] * mobility.sqrt();
                }
            }
            row
        };
        let rows: Vec<Vec<f64>> = springs.iter().map(row).collect();
        let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        let mut best = 0.0_f64;
        for start in &rows {
            let mut q = start.clone();
            for _ in 0..40 {
                let square = dot(&q, &q);
                if square == 0.0 {
                    break;
                }
                let (mut next, mut energy) = (vec![0.0; q.len()], 0.0);
                for (row, spring) in rows.iter().zip(springs) {
                    let stretch = dot(row, &q) / square.sqrt();
                    energy += spring.5 * stretch * stretch;
                    let pull = next.iter_mut().zip(row);
                    pull.for_each(|(next, w)| *next += spring.5 * stretch * w);
                }
                best = best.max(energy);
                q = next;
            }
        }
        best
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
            ..
        } = place;
        let lightness = light + other_light;
        let mass = if lightness > 0.0 {
            1.0 / lightness
        } else {
            0.0
        };
        let law = Law::of(law, Pair { mass, radius });
        let per_dt = if step.dt_before > 0.0 {
            1.0 / step.dt_before
        } else {
            0.0
        };
        let moved = match (gone, other_gone) {
            (Some(gone), Some(other)) if per_dt > 0.0 => gone - other,
            _ => Vec2::zeros(),
        };
        let velocity = if per_dt > 0.0 {
            moved * per_dt
        } else {
            fast - other_fast
        };
        let motion = Motion {
            overlap,
            moved: along(moved, normal),
            velocity: along(velocity, normal),
        };
        let before = self.history.get(&who).copied().unwrap_or_default();
        let exerted = law.exert(&motion, &before);
        let [f_n, f_t] = exerted.force;
        let [by_place, by_speed] = exerted.sensitivity;
        let force = normal * f_n + left(normal) * f_t;
        let steep = by_place + by_speed * per_dt + place.curvature * force.norm();
        // Where contact begins, what is not a spring begins at once.
        let jumps = law.dashpots([1.0; 2]) != [0.0; 2] || before != History::default();
        if overlap.abs() <= place.blur && jumps {
            sums.expected.doubtful = Some("a contact that just begins or ends");
        }
        sums.stored += exerted.stored;
        sums.friction += exerted.friction;
        for k in 0..2 {
            sums.viscous[k] += exerted.viscous[k];
        }
        let touch = Touch {
            who,
            overlap,
            at,
            force,
            moved: moved.norm(),
            blur: place.blur * steep,
        };
        if overlap > 0.0 {
            sums.history.insert(who, exerted.history);
            sums.expected.touches.push(touch);
        }
        (touch, law)
    }

    /// T-1's kick, and what is measured of it (section 9).
    fn kick(&mut self, step: &Step, sums: &mut Sums) {
        let (kick, w) = (step.kick(), step.centring());
        let keeps = step.dt_before > 0.0 || step.dt > 0.0;
        let gravity = Vec2::from(self.config.gravity);
        let share = if kick > 0.0 {
            0.5 * step.dt_before / kick
        } else {
            0.0
        };
        let friction = self.friction + sums.friction;
        let viscous = [0, 1].map(|k| self.viscous[k] + sums.viscous[k]);
        let (mut driven, mut applied, mut contact) = (0.0, Vec2::zeros(), Vec2::zeros());
        let expected = &mut sums.expected;
        let mut ledger = Ledger {
            contact: sums.stored,
            friction_work: friction,
            viscous_work: viscous[0],
            ..Ledger::default()
        };
        let mut kicked = Vec::new();
        for (body, load) in self.bodies.iter().zip(&expected.loads) {
            let yields = body.yields();
            let moves = yields != [0.0; 3];
            let weight = if moves {
                gravity * body.mass
            } else {
                Vec2::zeros()
            };
            let (push, push_torque) = body.drive.push(step.time);
            let inner = load.points.0 + load.bodies.0;
            let total = inner + weight + push;
            let torque = load.points.1 + load.bodies.1 + push_torque;
            let [x, y, turns] = body.mobility();
            let velocity = body.velocity + Vec2::new(total.x * x, total.y * y) * kick;
            let spin = body.spin + torque * turns * kick;
            // What supports and guides take up.
            let guide = -Vec2::new(total.x * (1.0 - yields[0]), total.y * (1.0 - yields[1]));
            let guide_torque = -torque * (1.0 - yields[2]);
            let (mean, mean_spin) = ((body.velocity + velocity) * 0.5, 0.5 * (body.spin + spin));
            driven += ((push + guide).dot(&mean) + (push_torque + guide_torque) * mean_spin) * kick;
            applied += (weight + push + guide) * kick;
            contact += load.points.0 * kick;
            let state = enter(&mut ledger, (gravity, w), body, load, (velocity, spin));
            expected.bodies.push(state);
            kicked.push((velocity, spin));
        }
        ledger.driven_work = self.driven + share * driven;
        ledger.applied_impulse = (self.applied + applied).into();
        ledger.contact_impulse = (self.contact + contact).into();
        expected.ledger = ledger;
        expected.viscous_most = viscous[1];
        let speeds = self
            .bodies
            .iter()
            .zip(&kicked)
            .map(|(body, &(velocity, spin))| {
                let after = Body {
                    velocity,
                    spin,
                    ..body.clone()
                };
                after.speed()
            });
        expected.speed = speeds.fold(0.0, f64::max);
        if keeps {
            (self.friction, self.viscous) = (friction, viscous);
            self.driven += driven;
            self.applied += applied;
            self.contact += contact;
            for (body, (velocity, spin)) in self.bodies.iter_mut().zip(kicked) {
                (body.velocity, body.spin) = (velocity, spin);
            }
        }
    }
}

/// Puts a body into the ledger (section 9), given gravity, the centring and its velocities after the kick; returns its state.
fn enter(
    ledger: &mut Ledger,
    (gravity, w): (Vec2, f64),
    body: &Body,
    load: &OnBody,
    (velocity, spin): (Vec2, f64),
) -> BodyState {
    let centred = |a: f64, b: f64| (1.0 - w) * a + w * b;
    if body.yields() != [0.0; 3] {
        let squares = centred(body.velocity.norm_squared(), velocity.norm_squared());
        ledger.kinetic += 0.5 * body.mass * squares;
        let squares = centred(body.spin.powi(2), spin.powi(2));
        ledger.kinetic_rotation += 0.5 * body.inertia * squares;
        ledger.gravity -= body.mass * gravity.dot(&body.center);
        for k in 0..2 {
            ledger.momentum[k] += body.mass * velocity[k];
        }
    }
    for k in 0..2 {
        ledger.contact_force[k] += load.points.0[k];
    }
    ledger.contacts += u64::from(load.contacts > 0);
    BodyState {
        position: body.center.into(),
        velocity: (body.velocity * (1.0 - w) + velocity * w).into(),
        angle: body.angle,
        spin: centred(body.spin, spin),
        mass: body.mass,
        inertia: body.inertia,
        point_force: load.points.0.into(),
        point_torque: load.points.1,
        body_force: load.bodies.0.into(),
        body_torque: load.bodies.1,
        contacts: load.contacts,
    }
}

/// Parts along N and T.
fn along(v: Vec2, normal: Vec2) -> [f64; 2] {
    [v.dot(&normal), v.dot(&left(normal))]
}

/// Whether two places of an outline, more than a little apart, are both nearest to `x` within `blur` (m): then rounding
/// decides which way a point is pushed. `distance` is that of the nearest (m).
fn has_two_normals(outline: &[Vec2], x: Vec2, distance: f64, blur: f64) -> bool {
    let n = outline.len();
    if n == 1 {
        return distance <= blur;
    }
    let edges = if n == 2 { 1 } else { n };
    let feet = (0..edges).map(|e| nearest_on_edge(outline[e], outline[(e + 1) % n], x, 0, 1).0);
    let nearest: Vec<Vec2> = feet
        .filter(|y| (x - y).norm() - distance.abs() <= 2.0 * blur)
        .collect();
    let apart = |a: &Vec2| {
        nearest
            .iter()
            .any(|b| (a - b).norm() > 1e-3 * blur.sqrt() * 1e-1)
    };
    distance.abs() <= blur || nearest.iter().any(apart)
}
