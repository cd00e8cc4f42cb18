//! Contact geometry and nothing else (Jiang 2020 section 3.1; PHYSICS.md section 5).

use interface::Vec2;
use interface::outline::{Feature, nearest_on_edge};

use crate::mass::{cross, outward};

/// The point of an outline nearest to a point, seen from there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen {
    /// Signed distance in m: negative inside a polygon.
    pub distance: f64,
    /// Unit normal `N` of the contact, from the outline to the outside: the way in which a point is pushed.
    pub normal: Vec2,
}

/// The nearest point of a closed, counter-clockwise outline among `edges`, seen from `p`.
///
/// The sign comes from the nearest feature alone, so only edges near `p` need be looked at: in a simple polygon the
/// nearest point is an edge (then its side tells), a convex corner (then `p` is outside) or a reflex one (inside).
/// Where `p` lies exactly on the outline the normal is the edge's, or bisects the corner; at the centre of a disc,
/// which has no direction, it is +y. Of features at the same distance the first counts.
#[inline]
pub fn see(outline: &[Vec2], edges: impl IntoIterator<Item = usize>, p: Vec2) -> Seen {
    let n = outline.len();
    if n == 1 {
        let d = p - outline[0];
        let distance = d.norm();
        let normal = if distance > 0.0 {
            d / distance
        } else {
            Vec2::y()
        };
        return Seen { distance, normal };
    }
    let mut best = (f64::INFINITY, Vec2::zeros(), Feature::Vertex(0));
    for i in edges {
        let j = if i + 1 == n { 0 } else { i + 1 };
        let (y, feature) = nearest_on_edge(outline[i], outline[j], p, i, j);
        let distance_sq = (p - y).norm_squared();
        if distance_sq < best.0 {
            best = (distance_sq, y, feature);
        }
    }
    let (distance_sq, y, feature) = best;
    let d = p - y;
    match feature {
        Feature::Edge(i) => {
            let edge = outline[if i + 1 == n { 0 } else { i + 1 }] - outline[i];
            let normal = outward(edge);
            // From the edge's line instead of from |p - Y|: exact down to, and through, the outline itself.
            let distance = cross(p - outline[i], edge) / edge.norm();
            if n == 2 && distance < 0.0 {
                Seen {
                    distance: -distance,
                    normal: -normal,
                }
            } else {
                Seen { distance, normal }
            }
        }
        Feature::Vertex(i) => {
            let before = outline[i] - outline[if i == 0 { n - 1 } else { i - 1 }];
            let after = outline[if i + 1 == n { 0 } else { i + 1 }] - outline[i];
            let distance = distance_sq.sqrt();
            if distance == 0.0 {
                let normal = if n == 2 {
                    before.normalize() // off the end of the segment
                } else {
                    (outward(before) + outward(after)).normalize()
                };
                return Seen { distance, normal };
            }
            let outside = n == 2 || cross(before, after) >= 0.0;
            let sign = if outside { 1.0 } else { -1.0 };
            Seen {
                distance: sign * distance,
                normal: d * (sign / distance),
            }
        }
    }
}

/// Where a contact acts (eq. 41, sign mended): `p = X - (a_V - xi/2) N` for a vertex or point `X` of radius `a_V`.
///
/// Written with the signed normal, so that it moves on smoothly when a point passes the bare outline.
#[inline]
pub fn contact_point(x: Vec2, radius: f64, overlap: f64, normal: Vec2) -> Vec2 {
    x - normal * (radius - 0.5 * overlap)
}

/// Distance of a vertex from an edge `a b`, and the unit vector from the edge to the vertex (eq. 38). Unsigned.
///
/// An edge without length (`a == b`) is a disc. A vertex exactly on the edge is pushed along the edge's outward
/// normal; one disc exactly on another along +y.
#[inline]
pub fn vertex_edge(vertex: Vec2, a: Vec2, b: Vec2) -> (f64, Vec2) {
    let d = vertex - nearest_on_edge(a, b, vertex, 0, 1).0;
    let distance = d.norm();
    if distance > 0.0 {
        (distance, d / distance)
    } else if a == b {
        (0.0, Vec2::y())
    } else {
        (0.0, outward(b - a))
    }
}
