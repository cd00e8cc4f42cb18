//! The area that two convex bodies share as the measure of their contact (docs/physics.md, "The laws").

use interface::Vec2;
use interface::step::Step;

use super::{BLUR, Body, Oracle, Place, Spring, Sums, Who, edges, left};
use crate::mass::cross;
use crate::reference::law::History;

/// What two outlines share.
#[derive(Debug, Clone, Copy)]
pub struct Shared {
    /// In m^2.
    pub area: f64,
    /// By how much it falls where the first is moved by a metre along x and y, in m.
    pub push: Vec2,
    /// The place on the line of action of the push that is nearest to the centroid, in m.
    pub at: Vec2,
}

/// What two convex outlines in counter-clockwise order share, by Green's theorem over the pieces of edges of each that are
/// inside of the other.
pub fn shared(first: &[Vec2], second: &[Vec2]) -> Option<Shared> {
    let inside = |of: &[Vec2], by: &[Vec2]| -> Vec<_> {
        edges(of).filter_map(|edge| inside(edge, by)).collect()
    };
    let pieces = [inside(first, second), inside(second, first)];
    let origin = pieces.iter().flatten().next()?[0];
    let (mut area, mut moment) = (0.0, Vec2::zeros());
    let (mut push, mut turning) = (Vec2::zeros(), 0.0);
    for (k, piece) in pieces.iter().enumerate() {
        for [p, q] in piece.iter().map(|piece| piece.map(|x| x - origin)) {
            area += 0.5 * cross(p, q);
            moment += (p + q) * (cross(p, q) / 6.0);
            if k == 0 {
                // Where the first one is moved inwards of its edge, the area that is swept is lost.
                let inwards = left(q - p);
                push += inwards;
                turning += cross(0.5 * (p + q), inwards);
            }
        }
    }
    let centroid = moment / area;
    let beside = (cross(centroid, push) - turning) / push.norm_squared();
    (area > 0.0).then(|| Shared {
        area,
        push,
        at: origin + centroid + left(push) * beside,
    })
}

/// The part of an edge that is inside of a convex outline.
fn inside([a, b]: [Vec2; 2], outline: &[Vec2]) -> Option<[Vec2; 2]> {
    let (mut from, mut to) = (0.0_f64, 1.0_f64);
    for [p, q] in edges(outline) {
        let [at_a, at_b] = [a, b].map(|x| cross(q - p, x - p));
        let crossing = at_a / (at_a - at_b);
        match [at_a < 0.0, at_b < 0.0] {
            [true, true] => return None,
            [true, false] => from = from.max(crossing),
            [false, true] => to = to.min(crossing),
            [false, false] => {}
        }
    }
    (from < to).then(|| [from, to].map(|t| a + (b - a) * t))
}

impl Oracle {
    /// Two bodies that share an area. Returns the spring, which is that of an overlap as wide as it is.
    pub(super) fn area(&self, step: &Step, [i, j]: [usize; 2], sums: &mut Sums) -> Option<Spring> {
        let [one, other] = [i, j].map(|b| &self.bodies[b]);
        let who = Who::Bodies(i, 0, j, 0);
        let (corners, others) = (one.corners(), other.corners());
        let Some(shared) = shared(&corners, &others) else {
            // An area that has gone has no width, so the law gets no motion.
            sums.friction += self.history.get(&who).map_or(0.0, History::energy);
            return None;
        };
        let extent = |body: &Body| {
            body.vertices
                .iter()
                .map(|(v, _)| v.norm())
                .fold(0.0, f64::max)
        };
        let length = 2.0 * extent(one).min(extent(other));
        let width = shared.push.norm();
        let gain = width / length;
        let were = [one, other].map(|b| {
            b.corners()
                .into_iter()
                .map(|x| b.was(x))
                .collect::<Vec<_>>()
        });
        let before = self::shared(&were[0], &were[1]).map_or(0.0, |before| before.area);
        let place = Place {
            overlap: shared.area / length,
            normal: shared.push / width,
            at: shared.at,
            radius: 0.0,
            // The square root of an area is a concave function of the way, so the width changes the force by no more than half of
            // what the depth does.
            blur: 1.5 * gain * BLUR * length,
            curvature: 2.0 / (gain * width),
            gain,
            fallen: Some((before - shared.area) / length),
        };
        self.pair(step, who, [i, j], place, sums)
    }
}
