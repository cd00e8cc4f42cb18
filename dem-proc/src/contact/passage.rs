//! Tests whether a point, or another body, has passed through a body.
//!
//! A penalty force depends on the position of a point, not on its path. Beyond the middle of a body (the skeleton of a
//! thin one, the medial axis of a polygon) the force pushes to the other side: finite, balanced, and wrong. So a point
//! must not get there. There are two criteria, and neither is met if contact is resolved:
//!
//! - *Through.* From one step to the next the normal turns by more than 100 degrees relative to the body, the path
//!   between the two positions crosses the outline or ends inside it, and the nearest point of the outline has jumped:
//!   its path along the outline is longer than the contact distance. When a point rolls around a corner or a cap, its
//!   normal turns by at most `2 asin(r_p/4 / d)`, because it moves by at most half its radius in a step (the kinematic
//!   limit of docs/physics.md section 4): 29 degrees at the distance `d = r_p` of light contact. In a narrow notch the
//!   nearer wall may change, but the path crosses nothing. At the corners of a rectangle the normals inside differ by
//!   90 degrees. If a soft contact lets a point in as far as its contact distance at a sharp tip, the point may cut off
//!   the tip, which is no worse than a path around it.
//! - *Deep.* The middle of a disc is a single point, which no path hits exactly, and around it the normal turns
//!   gradually. So the centre of a point may not be deeper than three quarters of the radius of the disc that has the
//!   body's area. That radius is never smaller than that of the largest disc within the body, so for thin bodies the
//!   first criterion decides.
//!
//! A single point may escape both criteria if it passes the middle of a disc at a distance between a quarter of its
//! radius and its radius. The points of a continuum are nearer to one another than that, unless the disc is smaller
//! than the points.
//!
//! Two bodies pass through one another vertex by vertex and edge by edge: separate outlines can only begin to cross
//! where a vertex of one comes onto an edge of the other. The criterion depends on the measure of their overlap:
//!
//! - *Each edge* ([`crate::contact::pairs`]): the distance of a vertex from an edge has no sign, so the force reverses
//!   where it is zero. The overlap of a vertex may be at most three quarters of its contact distance, the sum of the
//!   sphero-radii. By the kinematic limit the distance decreases by at most half of that in a step, so no vertex gets
//!   to the other side undetected.
//! - *Nearest edge* ([`crate::contact::nearest`]): the distance is signed, so both criteria for points apply to a
//!   vertex. It is also through if it is nearer to the other side than to the edge that pushes it. A corner that slides
//!   past a sharp tip of the other body changes from one side of the tip to the other even at a small overlap; at an
//!   overlap `xi` it cuts off a piece of the tip of `2 xi / tan(alpha/2)` along the outline, for an angle `alpha`. A
//!   quarter of the thickness of the thinner body is allowed, or more if the sphero-radii allow more. A vertex that has
//!   its own body behind its edge may be where a soft contact let faces of two bodies slide through: then the way by
//!   which the outlines would have to move apart may be no longer than that piece. Nor may it be where no vertex presses:
//!   bodies whose tips were cut off may lie across one another, with crossing edges, and this measure has no force there.
//! - *Area* ([`crate::contact::overlap`]): when an overlap reaches across a thin body, the width of the overlap that
//!   determines the force becomes zero and then reverses. So the criteria are a width below a fifth of the root of the
//!   area, which is that of a corner of 1.1 degrees, and a normal that has turned. The second counts only if the bodies
//!   have been deeper in one another than that quarter, because a corner that slides past a tip turns its normal too.
//!   A plank that goes through a stone, or a wedge through a plate, keeps width and normal. So the way by which the
//!   outlines would have to move apart may be at most three quarters of the thickness of the thinner body.

use interface::Vec2;
use interface::solver::{Fault, Refusal};
use mechanics::outline::{Feature, Nearest, nearest};

use crate::body::bodies::Bodies;
use crate::body::shape::edge_count;
use mechanics::mass::cross;

/// Cosine of the angle by which a normal may turn in one step, relative to the body: of 100 degrees.
pub const TURN: f64 = -0.173_648_177_666_930_36;

/// Largest distance of a point from the outline, as a share of its radius, in the step in which it comes to the other
/// side: it moves by at most half its radius, and a little is added for rounding.
pub const CROSSING: f64 = 0.55;

/// Largest depth of the centre of a point, as a share of the radius of the disc with the body's area; and largest
/// overlap of a vertex and an edge, as a share of their contact distance; and largest way out of an area, as a share of
/// the thickness of the thinner body.
pub const DEEP: f64 = 0.75;

/// Length along the outline of a tip that a corner may cut off, as a share of the thickness of the thinner body.
pub const TIP: f64 = 0.25;

/// The criterion by which a point or a vertex is too far inside a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Passage {
    /// It is on the other side.
    Through,
    /// It is near the middle.
    Deep,
    /// No vertex of either body is inside the other, but their edges cross.
    Across,
}

impl Passage {
    /// What it has done, in the words of the error message that stand before the name of the body.
    fn words(self) -> &'static str {
        match self {
            Self::Through => "has passed through",
            Self::Deep => "is near the middle of",
            Self::Across => "lies across",
        }
    }

    /// What is wrong with it, and the advice for the user.
    fn advice(self) -> &'static str {
        match self {
            Self::Through | Self::Deep => ADVICE,
            Self::Across => ACROSS,
        }
    }
}

/// Advice for the user.
const ADVICE: &str = "a contact force would push it to the wrong side; write a stiffer contact, a slower drive or a \
                      shorter time.max_step";

/// Likewise, where edges cross.
const ACROSS: &str = "no corner of either is in the other, so no contact force pushes them apart; take another \
                      dem.overlap, or write rounder bodies or a stiffer contact";

/// What is too far inside a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Own {
    /// The point of this identity.
    Point(u64),
    /// A vertex of this body, or all of it.
    Body(u32),
}

/// Two whose overlap is too large.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Passed {
    /// In a body.
    Body {
        /// What is in it.
        own: Own,
        /// Body.
        body: u32,
        /// The criterion that is met.
        passage: Passage,
        /// Overlap `xi` in m.
        overlap: f64,
    },
    /// In another point.
    Point {
        /// Identities of the two.
        ids: [u64; 2],
        /// Their groups.
        groups: [u32; 2],
        /// Overlap `xi` in m.
        overlap: f64,
        /// In m.
        contact_distance: f64,
    },
}

impl Passed {
    /// The message for the user.
    pub fn fault(&self, bodies: &Bodies) -> Fault {
        Fault::Other(match *self {
            Self::Body {
                own,
                body,
                passage,
                overlap,
            } => {
                let named = |b: u32| format!("body {b} ({})", bodies.properties[b as usize].name);
                let own = match own {
                    Own::Point(id) => format!("point {id}"),
                    Own::Body(b) => named(b),
                };
                let (how, advice, body) = (passage.words(), passage.advice(), named(body));
                format!("{own} {how} {body} with an overlap of {overlap:.3e} m: {advice}")
            }
            Self::Point {
                ids: [a, b],
                groups: [of_a, of_b],
                overlap,
                contact_distance,
            } => format!(
                "points {a} and {b} of groups {of_a} and {of_b} overlap by {overlap:.3e} m, which is more than three \
                 quarters of their contact distance of {contact_distance:.3e} m: they would pass through one another; \
                 write a stiffer contact or larger contact radii"
            ),
        })
    }

    /// The message for the user about two bodies before anything has moved.
    pub fn refusal(&self, bodies: &Bodies) -> Option<Refusal> {
        let Self::Body {
            own: Own::Body(own),
            body,
            overlap,
            ..
        } = *self
        else {
            return None;
        };
        let [first, second] = [own.min(body), own.max(body)];
        let [first_name, name] = [first, second].map(|b| &bodies.properties[b as usize].name);
        Some(Refusal::new(
            format!("dem.body.{second}.position"),
            format!(
                "body \"{name}\" overlaps body \"{first_name}\" by {overlap:.3e} m, and contact would not push them \
                 apart; move one of them by at least that"
            ),
        ))
    }
}

/// Largest depth of a point's centre below the surface of a body in m.
pub fn admissible_depth(bodies: &Bodies, body: usize, part: u32) -> f64 {
    let shape = &bodies.properties[body].shape;
    let radius = match shape.radii.get(part as usize) {
        Some(&of_disc) => of_disc,
        None => (shape.moments.area / std::f64::consts::PI).sqrt(),
    };
    DEEP * radius
}

/// Whether the path from `from` to `to` (m), in the frame of the body, crosses its outline or ends inside it, and the
/// nearest point of the outline moves by more than `reach` (m) along the outline. A disc has no outline to cross: for
/// it the rotation of the normal decides.
pub fn goes_through(outline: &[Vec2], from: Vec2, to: Vec2, reach: f64) -> bool {
    let n = outline.len();
    if n == 1 {
        return true;
    }
    let seen = [nearest(outline, from), nearest(outline, to)];
    let way = to - from;
    let meets = |i: usize| {
        let (a, b) = (outline[i], outline[(i + 1) % n]);
        let (edge, from_a) = (b - a, from - a);
        let sides = [cross(edge, from_a), cross(edge, to - a)];
        let ends = [cross(way, -from_a), cross(way, b - from)];
        sides[0] * sides[1] <= 0.0 && ends[0] * ends[1] <= 0.0
    };
    let inside = seen.iter().any(|s| s.distance < 0.0);
    (inside || (0..edge_count(n)).any(meets)) && leap(outline, &seen) > reach
}

/// The least way in m by which two convex outlines would have to move apart; 0 if one is a point.
pub fn penetration([one, other]: [&[Vec2]; 2]) -> f64 {
    if one.len().min(other.len()) < 2 {
        return 0.0;
    }
    let mut least = f64::INFINITY;
    for [own, other] in [[one, other], [other, one]] {
        for (i, a) in own.iter().enumerate() {
            let edge = own[(i + 1) % own.len()] - a;
            let depths = other.iter().map(|x| cross(edge, x - a) / edge.norm());
            least = least.min(depths.fold(0.0, f64::max));
        }
    }
    least
}

/// Whether the [`penetration`] is above `limit` (m). It is at most the overlap in any direction in which the first outline
/// could go out: that in the direction `along` is below the limit for most, and is looked at first.
pub fn deeper([one, other]: [&[Vec2]; 2], along: Vec2, limit: f64) -> bool {
    let least = (one.iter()).fold(f64::INFINITY, |least, x| least.min(x.dot(&along)));
    let most = (other.iter()).fold(f64::NEG_INFINITY, |most, x| most.max(x.dot(&along)));
    most - least >= limit * along.norm() && penetration([one, other]) > limit
}

/// The shorter path in m along a closed outline between two of its points. For a segment it goes round one of its ends.
pub fn leap(outline: &[Vec2], seen: &[Nearest; 2]) -> f64 {
    let n = outline.len();
    let length = |i: usize| (outline[(i + 1) % n] - outline[i]).norm();
    let before = |i: usize| (0..i).map(length).sum::<f64>();
    let [a, b] = [0, 1].map(|k| match seen[k].feature {
        Feature::Vertex(i) => before(i),
        Feature::Edge(i) => before(i) + (seen[k].point - outline[i]).norm(),
    });
    let all = before(n); // a segment counts both ways
    let along = if n == 2 { a + b } else { (a - b).abs() };
    along.min(all - along)
}
