//! Turns a configured shape into a checked outline with its mass properties.

use interface::Vec2;
use interface::config::BodyShape;

use crate::parry::BoxTree;
use mechanics::mass::{AreaMoments, cross, outward, swept, union_of_discs};
use mechanics::outline::{Bounds, foot, segments_apart};

/// Outlines with more edges than this are searched through a tree instead of edge by edge: below it, walking the
/// edges is as fast as walking the tree.
const EDGES_WITHOUT_TREE: usize = 16;

/// A checked outline about its own centroid, in counter-clockwise order.
#[derive(Debug, Clone)]
pub struct Shape {
    /// Vertices relative to the centroid of the swept shape, in the body's frame, in m.
    pub vertices: Vec<Vec2>,
    /// Sphero-radius `a` in m; of a cluster, the largest of its discs.
    pub radius: f64,
    /// Radii of the discs of a cluster in m, one for each vertex; empty for any other shape.
    pub radii: Vec<f64>,
    /// Largest distance of the surface from the centroid in m.
    pub extent: f64,
    /// Area, centroid (in the coordinates of the scene's shape) and polar moment of the swept shape.
    pub moments: AreaMoments,
    /// The boxes of the edges in the body's frame, for outlines with many edges.
    pub edges: Option<BoxTree>,
    /// Whether the outline has edges. A disc has none, nor has a cluster: its vertices are the centres of its discs.
    pub has_edges: bool,
}

/// Why a shape is refused: the key below `body`, and the message.
pub type ShapeError = (&'static str, String);

impl Shape {
    /// Checks the outline of `shape` swept by a disc of radius `a` (m), whose numbers have been checked
    /// ([`interface::config::DemConfig::faults`]). With `exact` the mass properties must be exact, which a
    /// sphero-radius that is too large for a notch prevents.
    ///
    /// # Errors
    /// The key and what is wrong with it.
    pub fn new(shape: &BodyShape, a: f64, exact: bool) -> Result<Self, ShapeError> {
        let vertices = shape.counter_clockwise().into_iter();
        let mut vertices: Vec<Vec2> = vertices.map(Vec2::from).collect();
        let radii = match shape {
            BodyShape::Cluster { radii, .. } if radii.is_empty() => vec![a; vertices.len()],
            BodyShape::Cluster { radii, .. } => radii.clone(),
            _ => Vec::new(),
        };
        let is_closed = radii.is_empty() && vertices.len() > 2;
        if exact
            && is_closed
            && let Some(i) = hidden_edge(&vertices, a)
        {
            let text = format!(
                "{a} m is too large for the notch next to edge {i} (in counter-clockwise order): the rounded \
                 outline would cover itself; write a smaller radius or fill the notch"
            );
            return Err(("sphero_radius", text));
        }
        let has_edges = radii.is_empty() && vertices.len() > 1;
        let moments = if radii.is_empty() {
            swept(&vertices, a)
        } else {
            // Overlaps count once, because a cluster represents a body that it fills (Singer 2022).
            union_of_discs(&vertices, &radii)
        };
        for v in &mut vertices {
            *v -= moments.centroid;
        }
        let largest = |radius: &dyn Fn(usize, f64) -> f64| {
            let radii = (0..vertices.len()).map(|k| radius(k, radii.get(k).copied().unwrap_or(a)));
            radii.fold(0.0, f64::max)
        };
        let with_tree = has_edges && edge_count(vertices.len()) > EDGES_WITHOUT_TREE;
        Ok(Self {
            radius: largest(&|_, radius| radius),
            extent: largest(&|k, radius| vertices[k].norm() + radius),
            edges: with_tree.then(|| edge_tree(&vertices)),
            radii,
            moments,
            has_edges,
            vertices,
        })
    }

    /// Edges of the outline; each disc of a cluster counts as one edge without length, and so does a lone disc.
    pub fn edge_count(&self) -> usize {
        if self.has_edges {
            edge_count(self.vertices.len())
        } else {
            self.vertices.len()
        }
    }

    /// Appends the edges that may meet a box in the body's frame, ascending: all if there is no tree.
    pub fn edges_near(&self, within: impl FnOnce() -> Bounds, near: &mut Vec<u32>) {
        match &self.edges {
            Some(tree) => tree.meeting(&within(), near),
            None => near.extend(0..self.edge_count() as u32),
        }
    }

    /// The vertex at the end of edge `i`.
    #[inline]
    pub fn edge_end(&self, i: usize) -> usize {
        if !self.has_edges {
            i
        } else if i + 1 == self.vertices.len() {
            0
        } else {
            i + 1
        }
    }
}

/// Edges of an outline of `n` vertices; a lone vertex counts as an edge without length.
pub fn edge_count(n: usize) -> usize {
    if n == 2 { 1 } else { n }
}

/// The boxes of the edges of a closed outline.
fn edge_tree(vertices: &[Vec2]) -> BoxTree {
    let n = vertices.len();
    BoxTree::new((0..n).map(|i| Bounds::around([vertices[i], vertices[(i + 1) % n]])))
}

/// An edge whose offset by `a` comes closer than `a` to another part of the outline. Then the pieces of
/// [`mechanics::mass`] overlap, and their sum is not the area of the swept shape.
fn hidden_edge(vertices: &[Vec2], a: f64) -> Option<usize> {
    let n = vertices.len();
    let at = |i: usize| vertices[i % n];
    let turn = |i: usize| {
        let (before, edge) = (at(i) - at(i + n - 1), at(i + 1) - at(i));
        cross(before, edge).atan2(before.dot(&edge))
    };
    if a == 0.0 || (0..n).all(|i| turn(i) >= 0.0) {
        return None;
    }
    let tree = edge_tree(vertices);
    let limit = a * (1.0 - 1e-9); // a touching pair of offsets is still exact; leave room for rounding
    let mut near = Vec::new();
    for i in 0..n {
        let (from, to) = (at(i), at(i + 1));
        let edge = to - from;
        let (length, normal) = (edge.norm(), outward(edge));
        // The offset edge, shortened at reflex corners, where the offsets of two edges meet.
        let cut = |t: f64| if t < 0.0 { a * (-0.5 * t).tan() } else { 0.0 };
        let (begin, end) = (cut(turn(i)), length - cut(turn(i + 1)));
        if begin > end {
            return Some(i);
        }
        let offset = |s: f64| from + edge / length * s + normal * a;
        let (p, q) = (offset(begin), offset(end));
        let search = |around: Bounds, near: &mut Vec<u32>| {
            near.clear();
            tree.meeting(&around, near);
        };
        search(Bounds::around([p, q]).grown(a), &mut near);
        for j in near.iter().map(|&j| j as usize).filter(|&j| j != i) {
            if segments_apart([p, q], [at(j), at(j + 1)]) < limit {
                return Some(i);
            }
        }
        // The arc around a convex corner: its nearest approach to another edge lies on the line to that edge's
        // nearest point, where that line leaves within the arc's opening.
        if turn(i) > 0.0 {
            let before = outward(from - at(i + n - 1));
            search(Bounds::around([from]).grown(2.0 * a), &mut near);
            for j in near.iter().map(|&j| j as usize) {
                if j == i || (j + 1) % n == i {
                    continue;
                }
                let to_edge = foot(at(j), at(j + 1), from).0 - from;
                let within = cross(before, to_edge) >= 0.0 && cross(to_edge, normal) >= 0.0;
                if within && to_edge.norm() < 2.0 * limit {
                    return Some(i);
                }
            }
        }
    }
    None
}
