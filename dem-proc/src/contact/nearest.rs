//! Each vertex of a convex body against the nearest point of another one, once (docs/physics.md section 5, "nearest
//! edge per vertex").
//!
//! The distance is signed, as for points: a vertex that has crossed the outline itself is pushed back to the side from
//! which it came. The history of a contact belongs to the vertex and the other body, so it is kept around corners.
//!
//! Chen 2023 takes the edge that is nearest to the vertex. Where faces of two bodies are flush, the vertex at a corner may be nearest
//! to the face beside the one on which its body rests, and the bodies sink into one another. So for a vertex inside the outline the
//! edge is taken behind which its whole body is least deep. It is the nearest where the vertex is the deepest of its body.

use interface::Vec2;
use mechanics::mass::outward;
use mechanics::outline::{Seen, contact_point, nearest, see, thickness};

use crate::body::bodies::Bodies;
use crate::body::shape::edge_count;
use crate::contact::convex::{Candidate, Measure, Spot};
use crate::contact::passage::{
    Passage, TIP, TURN, admissible_depth, deeper, goes_through, leap, penetration,
};

/// Measures a contact by the distance of a vertex from the nearest edge.
#[derive(Debug, Default)]
pub struct NearestEdge;

impl Measure for NearestEdge {
    const STIFFENS: f64 = 1.0;

    fn list(bodies: &Bodies, pair: [u32; 2], margin: f64, candidates: &mut Vec<Candidate>) {
        let edges = |b: u32| bodies.properties[b as usize].shape.has_edges;
        let [i, j] = pair;
        if edges(i) && edges(j) {
            let length = cut_off(bodies, pair);
            // Until the next list the overlap in any direction grows by at most the margin.
            if crossed(bodies, pair, length - margin) {
                candidates.push(Candidate {
                    bodies: pair,
                    vertex: None,
                    length,
                });
            }
        }
        for [v, e] in [[i, j], [j, i]] {
            // Discs have no edges. Two of them have one contact; the centre of a disc is its vertex against a polygon.
            if !edges(e) && (edges(v) || v > e) {
                continue;
            }
            let [vertices, outline] = [v, e].map(|b| bodies.outline_of(b as usize));
            let radii = [v, e].map(|b| bodies.state[b as usize].radius);
            let first = bodies.state[v as usize].first_vertex();
            // The depth at the middle of the body that has the edges.
            let length = radii[0] + radii[1] + 0.5 * thickness(outline);
            for (k, p) in (first..).zip(vertices) {
                let seen = see(outline, 0..edge_count(outline.len()), *p);
                if seen.distance <= radii[0] + radii[1] + margin {
                    candidates.push(Candidate {
                        bodies: [v, e],
                        vertex: Some(k),
                        length,
                    });
                }
            }
        }
    }

    fn meet(&mut self, bodies: &Bodies, candidate: Candidate, closing: f64) -> Option<Spot> {
        let vertex = bodies.outline[candidate.vertex? as usize];
        let [v, e] = candidate.bodies.map(|b| &bodies.state[b as usize]);
        let outline = bodies.outline_of(candidate.bodies[1] as usize);
        let mut seen = see(outline, 0..edge_count(outline.len()), vertex);
        if seen.distance < 0.0 {
            let own = bodies.outline_of(candidate.bodies[0] as usize);
            seen = faced(own, outline, vertex, seen);
        }
        let depth = v.radius + e.radius - seen.distance;
        (depth > -closing).then(|| Spot {
            depth,
            gain: 1.0,
            normal: seen.normal,
            point: contact_point(vertex, v.radius, depth, seen.normal),
            half_width: 0.0,
        })
    }

    /// Of a vertex inside the outline it is measured from the line of the edge that pushes it.
    fn fallen(bodies: &Bodies, candidate: Candidate, spot: &Spot, _: f64) -> f64 {
        let Some(vertex) = candidate.vertex else {
            return 0.0; // It has no contact.
        };
        let (now, from) = (
            bodies.outline[vertex as usize],
            from(bodies, candidate.bodies, vertex),
        );
        let [v, e] = candidate.bodies.map(|b| b as usize);
        let distance = bodies.state[v].radius + bodies.state[e].radius - spot.depth;
        if distance < 0.0 {
            return (now - from).dot(&spot.normal);
        }
        let outline = bodies.outline_of(e);
        distance - see(outline, 0..edge_count(outline.len()), from).distance
    }

    fn passage(
        bodies: &Bodies,
        candidate: Candidate,
        spot: &Spot,
        turned: Option<f64>,
    ) -> Option<Passage> {
        let vertex = candidate.vertex?;
        let now = bodies.outline[vertex as usize];
        let [v, e] = candidate.bodies.map(|b| b as usize);
        let of_vertex = bodies.state[v].radius;
        let outlines = [v, e].map(|b| bodies.outline_of(b));
        let reach = || cut_off(bodies, candidate.bodies);
        let through = || {
            let from = from(bodies, candidate.bodies, vertex);
            goes_through(outlines[1], from, now, reach())
        };
        let sinks = || {
            let whole = behind(outlines[0], now, spot.normal);
            whole > TIP * candidate.length && penetration(outlines) > reach()
        };
        // Nearer to the other side than to the edge that pushes it.
        let to_edge = spot.depth - of_vertex - bodies.state[e].radius;
        let past_middle = || {
            let near = see(outlines[1], 0..edge_count(outlines[1].len()), now);
            let leaps = || {
                let places = [now + spot.normal * to_edge, now].map(|x| nearest(outlines[1], x));
                leap(outlines[1], &places) > reach()
            };
            near.normal.dot(&spot.normal) < TURN && leaps()
        };
        if turned.is_some() && through() || to_edge > 0.0 && past_middle() || sinks() {
            Some(Passage::Through)
        } else if spot.depth - of_vertex > admissible_depth(bodies, e, 0) {
            Some(Passage::Deep)
        } else {
            None
        }
    }

    fn across(bodies: &Bodies, candidate: Candidate) -> Option<f64> {
        if candidate.vertex.is_some() {
            return None;
        }
        let pair = candidate.bodies.map(|b| b as usize);
        let outlines = pair.map(|b| bodies.outline_of(b));
        let [own, other] = pair.map(|b| &bodies.state[b]);
        let presses = |vertices: &[Vec2], outline: &[Vec2]| {
            let seen = |x: &Vec2| see(outline, 0..edge_count(outline.len()), *x);
            (vertices.iter()).any(|x| seen(x).distance < own.radius + other.radius)
        };
        let across = crossed(bodies, candidate.bodies, candidate.length)
            && !presses(outlines[0], outlines[1])
            && !presses(outlines[1], outlines[0]);
        across.then(|| penetration(outlines))
    }
}

/// Where a vertex was one step before, in the frame in which the other body has not moved, in m.
fn from(bodies: &Bodies, pair: [u32; 2], vertex: u32) -> Vec2 {
    let now = bodies.outline[vertex as usize];
    let [own, other] = pair.map(|b| &bodies.frames[b as usize]);
    let moved = own.displacement(now - own.center) - other.displacement(now - other.center);
    now - other.turned(moved)
}

/// Whether the outlines of two bodies would have to move apart by more than `limit` (m).
fn crossed(bodies: &Bodies, pair: [u32; 2], limit: f64) -> bool {
    let [a, b] = pair.map(|b| bodies.state[b as usize].center);
    deeper(pair.map(|b| bodies.outline_of(b as usize)), a - b, limit)
}

/// Length in m of a tip of two bodies that may be cut off: small compared with both, and at least their contact distance.
fn cut_off(bodies: &Bodies, pair: [u32; 2]) -> f64 {
    let pair = pair.map(|b| b as usize);
    let thinner = pair.map(|b| thickness(bodies.outline_of(b)));
    let thinner = thinner.into_iter().filter(|t| *t > 0.0);
    let [a, b] = pair.map(|b| bodies.state[b].radius);
    (TIP * thinner.reduce(f64::min).unwrap_or(0.0)).max(a + b)
}

/// How far a body with the outline `own` reaches behind its vertex `p`, against a direction.
fn behind(own: &[Vec2], p: Vec2, direction: Vec2) -> f64 {
    let depths = own.iter().map(|x| (p - x).dot(&direction));
    depths.fold(0.0, f64::max)
}

/// Of the edges of an outline around a vertex at `p`, the one behind which the body of the vertex with the outline `own` is least deep;
/// `nearest` is nearest to the vertex.
fn faced(own: &[Vec2], outline: &[Vec2], p: Vec2, nearest: Seen) -> Seen {
    let whole = |seen: &Seen| behind(own, p, seen.normal) - seen.distance;
    let mut least = whole(&nearest);
    if least <= -nearest.distance {
        return nearest; // The vertex is the deepest of its body, and deeper behind all other edges.
    }
    least *= 1.0 - 1e-9; // Rounding is no reason to take another edge.
    let mut best = nearest;
    for (i, a) in outline.iter().enumerate() {
        let normal = outward(outline[(i + 1) % outline.len()] - a);
        let distance = (p - a).dot(&normal);
        let seen = Seen { distance, normal };
        let whole = whole(&seen);
        if whole < least {
            (least, best) = (whole, seen);
        }
    }
    best
}
