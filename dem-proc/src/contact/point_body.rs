//! Geometry of a point and a body: one signed contact per point and body (Jiang 2020 section 4.1 as docs/physics.md
//! section 5 reads it). A cluster has one for each of its discs, so that the sum is smooth where the nearest disc changes.

use interface::Vec2;
use interface::message::wire::{ContactState, ImpForce, ImpInfo};
use mechanics::mass::cross;
use mechanics::outline::{contact_point, see};

use crate::body::bodies::Bodies;
use crate::body::load::Load;
use crate::body::shape::edge_count;
use crate::contact::engine::{Listing, On};
use crate::contact::frame_contacts::{POINT, between};
use crate::contact::passage::{
    CROSSING, Own, Passage, Passed, TURN, admissible_depth, goes_through,
};
use crate::contact::points::{Geometry, Outcome, PointWatch, add_to_point};
use crate::law::{PairProperties, Stiffness, reduced};
use crate::lists::neighbours::{PointList, PointPair, REACH};
use crate::lists::now::Among;

/// Pairs of points and bodies.
#[derive(Debug)]
pub struct PointBody {
    /// Surface of each point group; empty where the scene has no table of laws.
    pub surfaces: Vec<u32>,
}

/// The contact point from the centre of the body and from that of the point in m, and its lever arms on the body along normal
/// and tangent.
#[derive(Debug, Clone, Copy)]
pub struct Arms {
    r: Vec2,
    of_point: Vec2,
    /// Radius in m at which the surface of the point lies: `r_p - xi/2`.
    surface: f64,
    normal: f64,
    tangent: f64,
}

/// What a contact adds to the sums of a body, and its stiffness.
#[derive(Debug, Clone, Copy)]
pub struct Effect {
    slot: u32,
    body: u32,
    /// Torque on the body in N.
    torque: f64,
    /// On the point in N.
    couple: f64,
    /// `k_n` and `k_t`.
    stiffness: Stiffness,
    /// Its contribution to `Load::rate`.
    rate: f64,
    /// Its contributions to `Load::mobility` and `Load::along`.
    mobility: f64,
    along: f64,
}

type OnBodies<'a> = On<'a, PointBody>;

impl OnBodies<'_> {
    /// Contact radius of a pair's point in m.
    #[inline]
    fn radius(&self, pair: PointPair) -> f64 {
        self.set[pair.slot as usize].radius
    }

    /// Sphero-radius of a pair's body, or of its disc in a cluster, in m.
    #[inline]
    fn radius_of_body(&self, pair: PointPair) -> f64 {
        self.bodies.radius_at(pair.body as usize, pair.part)
    }

    /// The outline of a pair's body, or the centre of its disc in a cluster.
    #[inline]
    fn outline(&self, pair: PointPair) -> (&[Vec2], bool) {
        let (body, part) = (pair.body as usize, pair.part as usize);
        let outline = self.bodies.outline_of(body);
        let has_edges = self.bodies.properties[body].shape.has_edges;
        let disc = if has_edges {
            outline
        } else {
            &outline[part..=part]
        };
        (disc, has_edges)
    }

    /// Overlap in m and normal of a pair whose point is at `x` (m): eq. 44 with the signed distance.
    #[inline]
    fn overlap_at(&self, pair: PointPair, x: Vec2) -> (f64, Vec2) {
        let [from, to] = pair.edges.map(|i| i as usize);
        let candidates = self.extra.edges[from..to].iter().map(|&i| i as usize);
        let seen = see(self.outline(pair).0, candidates, x);
        let contact_distance = self.radius_of_body(pair) + self.radius(pair);
        (contact_distance - seen.distance, seen.normal)
    }

    /// Where the point of a pair was one step before, in the frame in which the body has not moved, in m.
    #[inline]
    fn from(&self, pair: PointPair) -> Option<Vec2> {
        let x = self.position(pair.slot);
        let frame = &self.bodies.frames[pair.body as usize];
        let moved = self.way(pair.slot)? - frame.displacement(x - frame.center);
        Some(x - frame.turned(moved))
    }

    /// Whether the path of a point over the last step, in the frame of the body, passes through the outline to a place
    /// with another normal.
    fn went_through(&self, x: Vec2, pair: PointPair, normal: Vec2) -> bool {
        let Some(from) = self.from(pair) else {
            return false;
        };
        let reach = self.radius_of_body(pair) + self.radius(pair);
        let (outline, has_edges) = self.outline(pair);
        let before = see(outline, 0..edge_count(outline.len()), from);
        before.normal.dot(&normal) < TURN && (!has_edges || goes_through(outline, from, x, reach))
    }
}

impl Listing for PointBody {
    const POINTS: u32 = 1;
    type Pair = PointPair;
    type Key = [u32; 3];
    type Extra = PointList;
    type Watch = PointWatch;

    fn list(
        &self,
        among: &Among,
        watch: &PointWatch,
        pairs: &mut Vec<PointPair>,
        list: &mut PointList,
    ) {
        list.build(among, &watch.built_at, watch.skin, pairs);
    }

    fn key(pair: PointPair, slot: impl Fn(u32) -> Option<u32>) -> Option<[u32; 3]> {
        Some([slot(pair.slot)?, pair.body, pair.part])
    }

    fn properties(&self, among: &Among, pair: PointPair) -> PairProperties {
        let Among { bodies, set, .. } = *among;
        let (info, body) = (&set[pair.slot as usize], pair.body as usize);
        let radius = reduced(info.radius, bodies.radius_at(body, pair.part));
        self.properties_of(bodies, info, body, radius)
    }

    fn bodies(pair: PointPair) -> [Option<u32>; 2] {
        [Some(pair.body), None]
    }
}

impl PointBody {
    /// The constants of a point and a body with this reduced radius of curvature (m) for a law.
    pub fn properties_of(
        &self,
        bodies: &Bodies,
        info: &ImpInfo,
        body: usize,
        radius: f64,
    ) -> PairProperties {
        let of_point = self.surfaces.get(info.group as usize).copied().unwrap_or(0);
        PairProperties {
            mass: 1.0 / (1.0 / info.mass + bodies.state[body].inverse_mass),
            radius,
            surfaces: [of_point, bodies.properties[body].surface],
        }
    }
}

impl Geometry for PointBody {
    type Arms = Arms;
    type Effect = Effect;

    #[inline]
    fn reach(on: &OnBodies, pair: PointPair) -> f64 {
        REACH * on.radius(pair)
    }

    #[inline]
    fn overlap(on: &OnBodies, pair: PointPair) -> (f64, Vec2) {
        on.overlap_at(pair, on.position(pair.slot))
    }

    #[inline]
    fn arms(on: &OnBodies, pair: PointPair, (overlap, normal): (f64, Vec2)) -> Arms {
        let x = on.position(pair.slot);
        let radius = on.radius(pair);
        let p = contact_point(x, radius, overlap, normal);
        let r = p - on.bodies.frames[pair.body as usize].center;
        Arms {
            r,
            of_point: p - x,
            surface: radius - 0.5 * overlap,
            normal: cross(r, normal),
            tangent: cross(r, Vec2::new(-normal.y, normal.x)),
        }
    }

    #[inline]
    fn overlap_before(on: &OnBodies, pair: PointPair) -> Option<f64> {
        let from = on.from(pair)?;
        // A list of this step holds the edges that are nearest within the skin.
        if (from - on.position(pair.slot)).norm_squared() <= on.watch.skin * on.watch.skin {
            return Some(on.overlap_at(pair, from).0);
        }
        let outline = on.outline(pair).0;
        let seen = see(outline, 0..edge_count(outline.len()), from);
        Some(on.radius_of_body(pair) + on.radius(pair) - seen.distance)
    }

    #[inline]
    fn moved(on: &OnBodies, pair: PointPair, arms: &Arms) -> Option<Vec2> {
        let of_body = on.moves.frame(pair.body).displacement(arms.r);
        Some(on.moved(pair.slot, arms.of_point)? - of_body)
    }

    #[inline]
    fn effect(
        on: &OnBodies,
        pair: PointPair,
        arms: &Arms,
        stiffness: Stiffness,
        [normal, tangential]: [f64; 2],
    ) -> Effect {
        let frame = &on.bodies.frames[pair.body as usize];
        let (m, i) = (frame.inverse_mass, frame.inverse_inertia);
        let mobility = m + i * arms.normal * arms.normal;
        let along = m + i * arms.tangent * arms.tangent;
        Effect {
            slot: pair.slot,
            body: pair.body,
            torque: -(arms.normal * normal + arms.tangent * tangential),
            couple: -arms.surface * tangential,
            stiffness,
            rate: stiffness.normal * mobility + stiffness.tangential * along,
            mobility,
            along,
        }
    }

    #[inline]
    fn add(outcome: &Outcome<Effect>, forces: &mut [ImpForce], loads: &mut [Load]) {
        let effect = &outcome.effect;
        let on_point = ImpForce {
            force: outcome.force.into(),
            couple: effect.couple,
            stiffness: effect.stiffness.normal,
            tangential: effect.stiffness.tangential,
        };
        add_to_point(&mut forces[effect.slot as usize], &on_point);
        loads[effect.body as usize] += Load {
            force: -outcome.force,
            torque: effect.torque,
            rate: effect.rate,
            mobility: effect.mobility,
            along: effect.along,
            contacts: u32::from(outcome.overlap > 0.0),
        };
    }

    #[inline]
    fn is_deep(on: &OnBodies, pair: PointPair, overlap: f64) -> bool {
        let (radius, own) = (on.radius(pair), on.radius_of_body(pair));
        overlap > radius.min(own + (1.0 - CROSSING) * radius)
    }

    #[cold]
    fn passed(on: &OnBodies, pair: PointPair, overlap: f64) -> Option<Passed> {
        let (_, normal) = Self::overlap(on, pair);
        let body = pair.body as usize;
        let passage = if on.went_through(on.position(pair.slot), pair, normal) {
            Passage::Through
        } else if overlap - on.radius(pair) > admissible_depth(on.bodies, body, pair.part) {
            Passage::Deep
        } else {
            return None;
        };
        let of_both = |other: &&PointPair| (other.slot, other.body) == (pair.slot, pair.body);
        let overlaps = on.pairs.iter().filter(of_both);
        let overlaps = overlaps.map(|other| Self::overlap(on, *other).0);
        Some(Passed::Body {
            own: Own::Point(on.set[pair.slot as usize].id),
            body: pair.body,
            passage,
            overlap: overlaps.fold(f64::NEG_INFINITY, f64::max),
        })
    }

    fn contact_state(
        on: &OnBodies,
        pair: PointPair,
        (overlap, normal): (f64, Vec2),
        force: Vec2,
    ) -> ContactState {
        let x = on.position(pair.slot);
        let at = contact_point(x, on.radius(pair), overlap, normal);
        let ids = [pair.body.into(), on.set[pair.slot as usize].id];
        between(ids, POINT, at, -force)
    }
}
