//! Whether a point, or another body, has gone through a body.
//!
//! A penalty force depends on where a point is, not on where it came from. Beyond the middle of a body, which is the skeleton of
//! a thin one and the medial axis of a polygon, it pushes to the other side: finite, balanced, and wrong. So a point may
//! not get there. Two signs tell, and neither is seen where contact is resolved:
//!
//! - *Through.* From one step to the next the normal turns by more than 100 degrees relative to the body, the path
//!   between crosses the outline or ends inside it, and the nearest point of the outline has leapt: the way along the
//!   outline is longer than the contact distance. A point that rolls round a corner or a cap turns by `2 asin(r_p/4 / d)`
//!   at most, since it moves by half its radius in a step at most (the kinematic limit of docs/physics.md section 4): 29
//!   degrees at the distance `d = r_p` of light contact. In a narrow notch the nearer wall may change, but the path
//!   crosses nothing. At the corners of a rectangle the normals inside differ by 90 degrees. And a sharp tip that a soft
//!   contact lets in as far as its contact distance is cut off, which is no worse than to go round it.
//! - *Deep.* The middle of a disc is a single point, which nobody hits, and round it the normal turns little by little.
//!   So the centre of a point may not go deeper than three quarters of the radius of the disc that has the body's
//!   area. That is never smaller than the largest disc within the body: thin bodies are left to the first sign.
//!
//! A single point may slip by both, past the middle of a disc at between a quarter of its radius and all of it. The
//! points of a continuum are nearer to one another than that, as long as the disc is not smaller than they are.
//!
//! Two bodies pass through one another vertex by vertex and edge by edge, since outlines that are apart cannot cross but
//! where a vertex of one comes onto an edge of the other. What tells depends on how their overlap is measured:
//!
//! - *Each edge* ([`crate::contact::pairs`]): the distance of a vertex from an edge has no sign, so the force turns round where it
//!   is zero. A vertex may use up three quarters of its contact distance, the sum of the sphero-radii. The kinematic
//!   limit lets it come nearer by half of that in a step, so none gets from one side to the other unseen.
//! - *Nearest edge* ([`crate::contact::nearest`]): signed, so a vertex is judged as a point is, by both signs. A corner that slides
//!   off past a sharp tip of the other body comes from one of its sides to the other however lightly it presses; at an
//!   overlap `xi` it cuts off a piece of the tip of `2 xi / tan(alpha/2)` along the outline, for an angle `alpha`. Where the
//!   sphero-radii do not allow more, a quarter of the thickness of the thinner body is allowed.
//! - *Area* ([`crate::contact::overlap`]): the width of the overlap along which it pushes vanishes when a body spans a thin one,
//!   and points back from then on. So a width below a fifth of the root of the area tells, which is that of a corner of
//!   1.1 degrees, and a normal that has turned.

use interface::Vec2;
use interface::solver::Fault;
use mechanics::outline::{Feature, Nearest, nearest};

use crate::body::bodies::Bodies;
use crate::body::shape::edge_count;
use mechanics::mass::cross;

/// Cosine of the angle by which a normal may turn in one step, relative to the body: of 100 degrees.
pub const TURN: f64 = -0.173_648_177_666_930_36;

/// How near to the outline, as a share of its radius, a point is in the step in which it comes to the other side: it moves
/// by half its radius at most, and a little is for rounding.
pub const CROSSING: f64 = 0.55;

/// Share of the radius of the disc with the body's area that the centre of a point may be deep, and of the contact
/// distance of a vertex and an edge that they may overlap.
pub const DEEP: f64 = 0.75;

/// Length along the outline of a tip that a corner may cut off, as a share of the thickness of the thinner body.
pub const TIP: f64 = 0.25;

/// How a point or a vertex went too far into a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Passage {
    /// It has come to the other side.
    Through,
    /// It is near the middle.
    Deep,
}

impl Passage {
    /// The words of the error message, before the name of the body.
    fn words(self) -> &'static str {
        match self {
            Self::Through => "has passed through",
            Self::Deep => "is near the middle of",
        }
    }
}

/// What the user can change.
const ADVICE: &str = "a contact force would push it to the wrong side; write a stiffer contact, a slower drive or a \
                      shorter time.max_step";

/// A point that has gone too far into a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Passed {
    /// Identity of the point.
    pub id: u64,
    /// Body.
    pub body: usize,
    /// How.
    pub passage: Passage,
    /// Overlap `xi` in m.
    pub overlap: f64,
}

impl Passed {
    /// What the user is told.
    pub fn fault(&self, bodies: &Bodies) -> Fault {
        let Self {
            id, body, overlap, ..
        } = self;
        let (name, how) = (&bodies.properties[*body].name, self.passage.words());
        Fault::Other(format!(
            "point {id} {how} body {body} ({name}) with an overlap of {overlap:.3e} m: {ADVICE}"
        ))
    }
}

/// Two bodies that have gone too far into one another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PassedBodies {
    /// The one whose vertex went too far, and the other.
    pub bodies: [u32; 2],
    /// How.
    pub passage: Passage,
    /// Overlap `xi` in m.
    pub overlap: f64,
}

impl PassedBodies {
    /// What the user is told.
    pub fn fault(&self, bodies: &Bodies) -> Fault {
        let [one, other] = self.bodies;
        let [own, its] = self.bodies.map(|b| &bodies.properties[b as usize].name);
        let (how, overlap) = (self.passage.words(), self.overlap);
        Fault::Other(format!(
            "body {one} ({own}) {how} body {other} ({its}) with an overlap of {overlap:.3e} m: {ADVICE}"
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

/// Whether the way from `from` to `to` (m), as seen from the body, crosses its outline or ends inside it, and leads
/// to where the outline is farther than `reach` (m) along itself. A disc has nothing to cross: the turn of the normal
/// has told.
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

/// The shorter way along a closed outline between two of its points in m; of a segment, round one of its ends.
fn leap(outline: &[Vec2], seen: &[Nearest; 2]) -> f64 {
    let n = outline.len();
    let length = |i: usize| (outline[(i + 1) % n] - outline[i]).norm();
    let before = |i: usize| (0..i).map(length).sum::<f64>();
    let [a, b] = [0, 1].map(|k| match seen[k].feature {
        Feature::Vertex(i) => before(i),
        Feature::Edge(i) => before(i) + (seen[k].point - outline[i]).norm(),
    });
    let all = before(n); // of a segment: there and back
    let along = if n == 2 { a + b } else { (a - b).abs() };
    along.min(all - along)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn v(x: f64, y: f64) -> Vec2 {
        Vec2::new(x, y)
    }

    #[test]
    fn a_way_leads_through_a_segment_a_plate_and_a_spike_but_not_a_notch_or_a_tip() {
        let through = |outline: &[Vec2], from, to| goes_through(outline, from, to, 0.1);
        let segment = [v(-1.0, 0.0), v(1.0, 0.0)];
        assert!(through(&segment, v(0.3, 0.1), v(0.2, -0.1)));
        assert!(through(&segment, v(0.3, 0.0), v(0.2, -0.1)));
        assert!(through(&segment, v(-0.9, 0.01), v(-0.9, -0.01)));
        assert!(!through(&segment, v(-0.96, 0.01), v(-0.96, -0.01)));
        assert!(!through(&segment, v(1.05, 0.1), v(1.05, -0.1)));
        let plate = [v(-1.0, -0.01), v(1.0, -0.01), v(1.0, 0.01), v(-1.0, 0.01)];
        assert!(through(&plate, v(0.3, 0.1), v(0.2, -0.1)));
        assert!(through(&plate, v(0.3, 0.005), v(0.2, -0.005)));
        assert!(!through(&plate, v(1.05, 0.1), v(1.05, -0.1)));
        // A spike to the right, 23 degrees sharp: across its middle, and across its tip.
        let spike = [v(0.0, -0.2), v(1.0, 0.0), v(0.0, 0.2)];
        assert!(through(&spike, v(0.5, 0.01), v(0.5, -0.01)));
        assert!(!through(&spike, v(0.97, 0.001), v(0.97, -0.001)));
        // A narrow notch from above: from one of its walls to the other.
        let notched = [
            v(-1.0, -1.0),
            v(1.0, -1.0),
            v(1.0, 1.0),
            v(0.2, 1.0),
            v(0.0, 0.0),
            v(-0.2, 1.0),
            v(-1.0, 1.0),
        ];
        assert!(!through(&notched, v(-0.02, 0.5), v(0.02, 0.5)));
        assert!(through(&notched, v(-0.02, 0.5), v(0.02, -0.5)));
    }
}
