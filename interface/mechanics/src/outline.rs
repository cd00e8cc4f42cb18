//! The nearest point of a polygonal outline: the geometry that both sides of the contract need.
//!
//! The continuum uses it to find the points near a body, and a rigid-body solver may use it for contact. An outline is
//! a closed list of vertices: one vertex is a point, two are a segment, three or more a simple polygon in either sense.

use crate::mass::{cross, outward};
use interface::Vec2;

/// The part of an outline that is nearest to a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Feature {
    /// Interior of the edge that begins at this vertex.
    Edge(usize),
    /// A vertex.
    Vertex(usize),
}

/// The nearest point of an outline.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearest {
    /// The nearest point `Y` in m.
    pub point: Vec2,
    /// Distance from it in m; negative inside a polygon.
    pub distance: f64,
    /// The feature on which it lies.
    pub feature: Feature,
}

/// The point of `outline` nearest to `p`, with its signed distance.
///
/// Ties go to the feature that comes first. A point exactly on the outline counts as outside (distance 0).
///
/// # Panics
/// If the outline is empty: an assertion, since configurations with empty outlines are refused.
pub fn nearest(outline: &[Vec2], p: Vec2) -> Nearest {
    assert!(!outline.is_empty(), "an outline has at least one vertex");
    let n = outline.len();
    let mut best = Nearest {
        point: outline[0],
        distance: f64::INFINITY,
        feature: Feature::Vertex(0),
    };
    let mut best_sq = f64::INFINITY;
    let mut inside = false;
    let edges = if n == 2 { 1 } else { n };
    for i in 0..edges {
        let j = if i + 1 == n { 0 } else { i + 1 };
        let (a, b) = (outline[i], outline[j]);
        let (point, feature) = nearest_on_edge(a, b, p, i, j);
        let distance_sq = (p - point).norm_squared();
        if distance_sq < best_sq {
            best_sq = distance_sq;
            best = Nearest {
                point,
                distance: 0.0,
                feature,
            };
        }
        inside ^= crosses_ray(a, b, p);
    }
    let distance = best_sq.sqrt();
    best.distance = if inside && n > 2 { -distance } else { distance };
    best
}

/// The point of edge `a b` (vertices `i`, `j`) nearest to `p`, and whether it is an end or between.
#[inline]
pub(crate) fn nearest_on_edge(a: Vec2, b: Vec2, p: Vec2, i: usize, j: usize) -> (Vec2, Feature) {
    let (point, along) = foot(a, b, p);
    let feature = if along == 0.0 {
        Feature::Vertex(i)
    } else if along == 1.0 {
        Feature::Vertex(j)
    } else {
        Feature::Edge(i)
    };
    (point, feature)
}

/// Distance of two segments in m.
pub fn segments_apart([a, b]: [Vec2; 2], [c, d]: [Vec2; 2]) -> f64 {
    let side = |p: Vec2, q: Vec2, x: Vec2| cross(q - p, x - p);
    let crosses = side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0;
    if crosses {
        return 0.0;
    }
    let to = |p: Vec2, q: Vec2, x: Vec2| (x - foot(p, q, x).0).norm();
    let ends = [to(a, b, c), to(a, b, d), to(c, d, a), to(c, d, b)];
    ends.into_iter().fold(f64::INFINITY, f64::min)
}

/// Whether the edge `a b` crosses the ray from `p` to the right (even-odd rule).
pub fn crosses_ray(a: Vec2, b: Vec2, p: Vec2) -> bool {
    (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x)
}

/// Distance and normal of a point with respect to an outline.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen {
    /// Signed distance in m: negative inside a polygon.
    pub distance: f64,
    /// Unit normal `N` of the contact, outwards: the direction in which a point is pushed.
    pub normal: Vec2,
}

/// The point of the edge `a b` nearest to `p`, and how far along the edge it is, between 0 and 1 inclusive.
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

/// Distance and normal of `p` with respect to `edges` of a closed, counter-clockwise outline.
///
/// The sign comes from the nearest feature alone, so only edges near `p` need be looked at: in a simple polygon the
/// nearest point is an edge (then its side has the sign), a convex corner (then `p` is outside) or a reflex one (inside).
/// Where `p` lies on the outline the normal is the edge's, or bisects the corner; at the centre of a disc,
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
            // The distance is computed from the line of the edge and not from |p - Y|, so that it is exact near and on
            // the outline.
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
            // Nearer than that, rounding would say where it is.
            if distance <= 1e-12 * (p.x.abs() + p.y.abs()) {
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

/// An axis-aligned box, in m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Smallest coordinates.
    pub lower: Vec2,
    /// Largest coordinates.
    pub upper: Vec2,
}

impl Bounds {
    /// Of no points.
    pub const EMPTY: Self = Self {
        lower: Vec2::new(f64::INFINITY, f64::INFINITY),
        upper: Vec2::new(f64::NEG_INFINITY, f64::NEG_INFINITY),
    };

    /// The smallest box around `points`.
    pub fn around(points: impl IntoIterator<Item = Vec2>) -> Self {
        let mut bounds = Self::EMPTY;
        points.into_iter().for_each(|p| bounds.widen(p));
        bounds
    }

    /// Makes it hold `p` too.
    #[inline]
    pub fn widen(&mut self, p: Vec2) {
        (self.lower, self.upper) = (self.lower.inf(&p), self.upper.sup(&p));
    }

    /// The box grown by `margin` (m) on every side.
    #[inline]
    #[must_use]
    pub fn grown(&self, margin: f64) -> Self {
        let margin = Vec2::repeat(margin);
        Self {
            lower: self.lower - margin,
            upper: self.upper + margin,
        }
    }

    /// Whether the boxes touch.
    #[inline]
    pub fn meets(&self, other: &Self) -> bool {
        self.lower.x <= other.upper.x
            && other.lower.x <= self.upper.x
            && self.lower.y <= other.upper.y
            && other.lower.y <= self.upper.y
    }
}

/// The smallest width of a convex outline in m: the thickness of a plate, 0 of a segment or a point.
pub fn thickness(outline: &[Vec2]) -> f64 {
    let n = outline.len();
    if n < 3 {
        return 0.0;
    }
    let width = |i: usize| {
        let (a, edge) = (outline[i], outline[(i + 1) % n] - outline[i]);
        let heights = outline.iter().map(|p| cross(edge, p - a).abs());
        heights.fold(0.0, f64::max) / edge.norm()
    };
    (0..n).map(width).fold(f64::INFINITY, f64::min)
}

/// The contact point (eq. 41, sign corrected): `p = X - (a_V - xi/2) N` for a vertex or point `X` of radius `a_V`.
///
/// It uses the signed normal, so that it moves smoothly when a point passes the outline of a body without
/// sphero-radius.
#[inline]
pub fn contact_point(x: Vec2, radius: f64, overlap: f64, normal: Vec2) -> Vec2 {
    x - normal * (radius - 0.5 * overlap)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Vec<Vec2> {
        vec![
            Vec2::new(0.0, 0.0),
            Vec2::new(2.0, 0.0),
            Vec2::new(2.0, 2.0),
            Vec2::new(0.0, 2.0),
        ]
    }

    #[test]
    fn outside_inside_edge_and_corner_of_a_square() {
        let s = square();
        let at = |x, y| nearest(&s, Vec2::new(x, y));
        assert_eq!(at(1.0, -0.5).distance, 0.5);
        assert_eq!(at(1.0, -0.5).feature, Feature::Edge(0));
        assert_eq!(at(1.0, 0.25).distance, -0.25);
        assert_eq!(at(5.0, 6.0).distance, 5.0);
        assert_eq!(at(5.0, 6.0).feature, Feature::Vertex(2));
        assert_eq!(at(1.0, 0.0).distance, 0.0);
    }

    #[test]
    fn the_sense_of_the_outline_does_not_matter() {
        let mut s = square();
        let inside = nearest(&s, Vec2::new(0.5, 1.0));
        s.reverse();
        assert_eq!(nearest(&s, Vec2::new(0.5, 1.0)).distance, inside.distance);
    }

    /// The random case 1430 of the kit: rounding pushed a point on a corner in a direction that no normal there has.
    #[test]
    fn on_a_corner_to_rounding_the_normal_is_between_those_of_its_edges() {
        let square = square();
        for k in 0..1000 {
            let turn = nalgebra::Rotation2::new(0.01 * f64::from(k));
            let outline: Vec<Vec2> = square.iter().map(|v| turn * v).collect();
            let bisector = turn * Vec2::new(1.0, 1.0).normalize();
            for way in 0..9 {
                let off = Vec2::new(f64::from(way % 3 - 1), f64::from(way / 3 - 1));
                let seen = see(&outline, 0..4, outline[2] + off * 4e-16);
                assert!(seen.normal.dot(&bisector) >= 0.7, "{k} {off:?} {seen:?}");
            }
        }
    }

    #[test]
    fn a_point_and_a_segment_have_no_inside() {
        let p = Vec2::new(0.5, 0.0);
        assert_eq!(nearest(&[Vec2::zeros()], p).distance, 0.5);
        let segment = [Vec2::zeros(), Vec2::new(1.0, 0.0)];
        assert_eq!(nearest(&segment, p).distance, 0.0);
        assert_eq!(nearest(&segment, Vec2::new(0.5, -0.1)).distance, 0.1);
    }

    #[test]
    fn a_notch_of_a_concave_outline_is_outside() {
        let s: Vec<Vec2> = [[0., 0.], [4., 0.], [4., 4.], [2., 1.], [0., 4.]]
            .iter()
            .map(|&[x, y]| Vec2::new(x, y))
            .collect();
        assert!(nearest(&s, Vec2::new(2.0, 3.0)).distance > 0.0);
        assert!(nearest(&s, Vec2::new(2.0, 0.5)).distance < 0.0);
    }

    #[test]
    fn segments_that_cross_are_not_apart() {
        let [a, b] = [Vec2::new(-0.1, 0.0), Vec2::new(0.9, 0.0)];
        let [c, d] = [Vec2::new(0.0, -0.7), Vec2::new(0.0, 0.2)];
        for (ends, others) in [
            ([a, b], [c, d]),
            ([b, a], [c, d]),
            ([a, b], [d, c]),
            ([c, d], [a, b]),
            ([d, c], [b, a]),
        ] {
            assert_eq!(segments_apart(ends, others), 0.0);
        }
        // Short of one another by 0.1, and by the diagonal beyond an end.
        assert!((segments_apart([a, b], [Vec2::new(0.3, 0.1), d]) - 0.1).abs() < 1e-15);
        let beyond = [Vec2::new(0.93, 0.04), Vec2::new(0.93, 2.0)];
        assert!((segments_apart([a, b], beyond) - 0.05).abs() < 1e-15);
    }
}
