//! Geometry of contact between bodies (Jiang 2020 section 3.1; docs/physics.md section 5). The geometry of a point and
//! an outline is in [`mechanics::outline`].

use interface::Vec2;

/// Vector from the nearest point of the edge `a b` to a vertex (eq. 38), and its squared length. Unsigned distance.
/// `inverse_length_sq` is `1/|b - a|^2`, a constant of a rigid body, and 0 for an edge without length, which is a disc.
/// There is no branch and no division.
#[expect(clippy::inline_always, reason = "as in `pairs`")]
#[inline(always)]
pub fn vertex_edge(vertex: Vec2, a: Vec2, b: Vec2, inverse_length_sq: f64) -> (Vec2, f64) {
    let (edge, from_a) = (b - a, vertex - a);
    let along = from_a.dot(&edge) * inverse_length_sq;
    let along = if along > 0.0 { along } else { 0.0 };
    let along = if along < 1.0 { along } else { 1.0 };
    let d = from_a - edge * along;
    (d, d.norm_squared())
}
