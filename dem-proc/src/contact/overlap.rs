//! The area of the overlap of two convex polygons as the measure of their contact (Chen 2023 section 3.2.2 and eq. 18:
//! "the penetration can be area in 2D").
//!
//! Chen's `f = k A` has no potential if the width of the overlap changes: the work of a corner on the way in differs
//! from that on the way out. Feng and Owen (2004, "A 2D polygon/polygon contact model: algorithmic aspects",
//! Engineering Computations 21, section 3) take any energy of the area instead, whose gradient gives force, direction
//! and line of action. Here the depth is `xi = A / l`, with a length `l` of the pair that does not change, so a law of
//! a depth can be used as it is; the force is `k A / l` times the width of the overlap over `l`. For an overlap as wide
//! as `l` that is Chen's with `k_A = k / l`.

use interface::Vec2;

use crate::body::bodies::Bodies;
use crate::contact::convex::{Candidate, Measure, Spot};
use crate::contact::passage::{DEEP, Passage, TIP, deeper, penetration};
use crate::parry::nearest_points;
use mechanics::mass::cross;
use mechanics::outline::thickness;

/// Smallest ratio of the width of an overlap to the root of its area for which the force has the right direction: half
/// of it is the root of `tan(alpha / 2)` for a corner of the angle `alpha`.
const NARROW: f64 = 0.2;

/// A vertex of an overlap, and whether the edge that begins there belongs to the second outline.
type Corner = (Vec2, bool);

/// Measures a contact by the area of the overlap.
#[derive(Debug, Default)]
pub struct OverlapArea {
    corners: Vec<Corner>,
    spare: Vec<Corner>,
}

/// The overlap of two convex polygons.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Overlap {
    /// `A` in m^2.
    pub area: f64,
    /// `-dA/dc` in m, the decrease of the area when the first polygon is moved. Its length is the width of the overlap,
    /// and its direction is that in which the first polygon is pushed out.
    pub gradient: Vec2,
    /// `-dA/dtheta` in m^2 for a rotation of the first polygon about the centroid of the overlap.
    pub turning: f64,
    /// Centroid in m.
    pub centroid: Vec2,
}

impl OverlapArea {
    /// The overlap of two convex polygons in counter-clockwise order; `None` if they have no area in common.
    ///
    /// The first is cut by the edges of the second, one after another (Sutherland and Hodgman 1974).
    pub fn overlap(&mut self, first: &[Vec2], second: &[Vec2]) -> Option<Overlap> {
        self.corners.clear();
        self.corners.extend(first.iter().map(|p| (*p, false)));
        for (a, b) in around(second) {
            self.spare.clear();
            let side = |p: Vec2| cross(b - a, p - a);
            for (&(p, of_second), &(q, _)) in around(&self.corners) {
                let (from, to) = (side(p), side(q));
                let crossing = || p + (q - p) * (from / (from - to));
                match (from >= 0.0, to >= 0.0) {
                    (true, true) => self.spare.push((p, of_second)),
                    (true, false) => {
                        self.spare.push((p, of_second));
                        self.spare.push((crossing(), true));
                    }
                    (false, true) => self.spare.push((crossing(), of_second)),
                    (false, false) => {}
                }
            }
            std::mem::swap(&mut self.corners, &mut self.spare);
        }
        measure(&self.corners)
    }
}

/// Each corner of an outline, and the one after it.
fn around<T>(outline: &[T]) -> impl Iterator<Item = (&T, &T)> {
    outline.iter().zip(outline.iter().cycle().skip(1))
}

/// The sums over the corners of an overlap, relative to the first corner.
fn measure(corners: &[Corner]) -> Option<Overlap> {
    let origin = corners.first()?.0;
    let (mut twice, mut first) = (0.0, Vec2::zeros());
    let (mut gradient, mut turning) = (Vec2::zeros(), 0.0);
    for (&(p, of_second), &(q, _)) in around(corners) {
        let (p, q) = (p - origin, q - origin);
        let triangle = cross(p, q);
        twice += triangle;
        first += (p + q) * (triangle / 6.0);
        if of_second {
            // The outward normal of the second polygon's edge times its length: its direction is that in which the
            // first one is pushed.
            let push = Vec2::new(q.y - p.y, p.x - q.x);
            gradient += push;
            turning += cross((p + q) * 0.5, push);
        }
    }
    let area = 0.5 * twice;
    (area > 0.0).then(|| {
        let centroid = first / area;
        Overlap {
            area,
            gradient,
            turning: turning - cross(centroid, gradient),
            centroid: origin + centroid,
        }
    })
}

/// The length `l` of a pair in m, at least the width of any overlap, so that the gain is at most 1.
pub fn pair_length(bodies: &Bodies, pair: [u32; 2]) -> f64 {
    let [a, b] = pair.map(|b| bodies.state[b as usize].extent);
    2.0 * a.min(b)
}

impl Measure for OverlapArea {
    /// The root of the overlap's area is concave along a translation (Brunn and Minkowski), so `A A'' <= A'^2 / 2`, and
    /// `d^2(A^2/2)/du^2 <= 1.5 A'^2`.
    const STIFFENS: f64 = 1.5;

    fn list(bodies: &Bodies, pair: [u32; 2], _: f64, candidates: &mut Vec<Candidate>) {
        let [a, b] = pair.map(|b| thickness(bodies.outline_of(b as usize)));
        candidates.push(Candidate {
            bodies: pair,
            vertex: None,
            // The depth at which the overlap reaches through the thinner body.
            length: a.min(b),
        });
    }

    fn meet(&mut self, bodies: &Bodies, candidate: Candidate, closing: f64) -> Option<Spot> {
        let pair = candidate.bodies;
        let [a, b] = pair.map(|b| bodies.outline_of(b as usize));
        let length = pair_length(bodies, pair);
        let half_width = 0.5 * length;
        if let Some(overlap) = self.overlap(a, b) {
            let width = overlap.gradient.norm();
            let normal = if width > 0.0 {
                overlap.gradient / width
            } else {
                Vec2::y() // one is inside the other: the area does not change, nothing pushes
            };
            let off = if width > 0.0 {
                -overlap.turning / width
            } else {
                0.0
            };
            return Some(Spot {
                depth: overlap.area / length,
                gain: width / length,
                normal,
                point: overlap.centroid + Vec2::new(-normal.y, normal.x) * off,
                half_width,
            });
        }
        nearest_points(a, b, closing).map(|[p, q]| {
            let apart = (p - q).norm();
            Spot {
                depth: -apart,
                gain: 0.0, // that of no width
                normal: if apart > 0.0 {
                    (p - q) / apart
                } else {
                    Vec2::y()
                },
                point: q,
                half_width,
            }
        })
    }

    /// Where the area has ended, its width is 0, and dashpots do not work on the last way.
    fn fallen(_: &Bodies, _: Candidate, spot: &Spot, before: f64) -> f64 {
        if spot.gain > 0.0 {
            before - spot.depth
        } else {
            0.0
        }
    }

    fn passage(
        bodies: &Bodies,
        candidate: Candidate,
        spot: &Spot,
        turned: Option<f64>,
    ) -> Option<Passage> {
        let length = pair_length(bodies, candidate.bodies);
        let (area, width) = (spot.depth * length, spot.gain * length);
        let through = |approached| {
            let outlines = candidate.bodies.map(|b| bodies.outline_of(b as usize));
            penetration(outlines) + approached > TIP * candidate.length
        };
        let reaches_through = || {
            let outlines = candidate.bodies.map(|b| bodies.outline_of(b as usize));
            deeper(outlines, spot.normal, DEEP * candidate.length)
        };
        if turned.is_some_and(through) {
            Some(Passage::Through)
        } else if width < NARROW * area.sqrt() || reaches_through() {
            Some(Passage::Deep)
        } else {
            None
        }
    }
}
