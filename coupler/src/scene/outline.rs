//! Whether vertices of a scene form a polygon, in words.

use super::geometry::{self, NotSimple};
use super::problems::Problems;

/// Whether `vertices` form a simple polygon; refused with the reason if not.
pub(super) fn simple_polygon(problems: &mut Problems, path: &str, vertices: &[[f64; 2]]) -> bool {
    let Err(reason) = geometry::simple(vertices) else {
        return true;
    };
    let (message, help) = match reason {
        NotSimple::TooFew => (
            format!(
                "a polygon of {} vertices, expected 3 or more",
                vertices.len()
            ),
            "a segment or a disc has a shape of its own",
        ),
        NotSimple::Repeated(i, j) => (
            format!("vertices {i} and {j} of the polygon coincide"),
            "drop one of them; the outline closes by itself",
        ),
        NotSimple::Crossing(i, j) => (
            format!(
                "edges of the polygon cross: the one from vertex {i} {:?} and the one from vertex {j} {:?}",
                vertices[i], vertices[j]
            ),
            "list the vertices in the order of the outline, in either sense, counted from 0",
        ),
        NotSimple::Flat => (
            "all vertices of the polygon lie on one line".to_owned(),
            "use `shape.segment`",
        ),
    };
    problems.refuse(path, message, help);
    false
}
