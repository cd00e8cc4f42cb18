//! Contact geometry and nothing else (Jiang 2020 section 3.1; PHYSICS.md section 5).

use interface::Vec2;
use interface::outline::Feature;

use crate::mass::{cross, outward};

/// The point of an outline nearest to a point, seen from there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen {
    /// Signed distance in m: negative inside a polygon.
    pub distance: f64,
    /// Unit normal `N` of the contact, from the outline to the outside: the way in which a point is pushed.
    pub normal: Vec2,
}

/// The point of the edge `a b` nearest to `p`, and how far along the edge it is, between 0 and 1 inclusive.
///
/// [`interface::outline::nearest_on_edge`] in a form that inlines into the contact loops across crates.
#[inline]
pub fn foot(a: Vec2, b: Vec2, p: Vec2) -> (Vec2, f64) {
    let edge = b - a;
    let along = (p - a).dot(&edge);
    let length_sq = edge.norm_squared();
    if along <= 0.0 {
        (a, 0.0)
    } else if along >= length_sq {
        (b, 1.0)
    } else {
        let t = along / length_sq;
        (a + edge * t, t)
    }
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
        let (y, t) = foot(outline[i], outline[j], p);
        let distance_sq = (p - y).norm_squared();
        let feature = if t == 0.0 {
            Feature::Vertex(i)
        } else if t == 1.0 {
            Feature::Vertex(j)
        } else {
            Feature::Edge(i)
        };
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

/// Vector from the nearest point of the edge `a b` to a vertex (eq. 38), and its squared length. Unsigned distance.
///
/// `inverse_length_sq` is `1/|b - a|^2`, which a rigid body never changes, and 0 for an edge without length, which is
/// a disc. No branch and no division, so that the loop over a list can be done several pairs at a time.
#[expect(
    clippy::inline_always,
    reason = "as in `pairs`, whose first pass is this function"
)]
#[inline(always)]
pub fn vertex_edge(vertex: Vec2, a: Vec2, b: Vec2, inverse_length_sq: f64) -> (Vec2, f64) {
    let (edge, from_a) = (b - a, vertex - a);
    let along = from_a.dot(&edge) * inverse_length_sq;
    let along = if along > 0.0 { along } else { 0.0 };
    let along = if along < 1.0 { along } else { 1.0 };
    let d = from_a - edge * along;
    (d, d.norm_squared())
}

/// The normal of a vertex exactly on an edge: the edge's outward normal; of one disc exactly on another: +y.
#[cold]
pub fn normal_on(a: Vec2, b: Vec2) -> Vec2 {
    if a == b { Vec2::y() } else { outward(b - a) }
}
