//! The lattice that a group's points lie on.

use super::continuum::{Fill, GroupConfig, Lattice};
use nalgebra::Vector2;

/// A lattice that follows an outline.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Following {
    /// Rings of one width around the centre of a disc, or around the hole of a ring.
    Rings {
        /// Radius of the hole in m; 0 for a disc.
        hole: f64,
        /// How many, 1 or more.
        rings: u32,
        /// Their width in m. It is approximate: all points have the same area, and the widths follow from that.
        width: f64,
    },
    /// Rows along an edge of a polygon and columns across it.
    Rows {
        /// Where the first row and column begin, in m.
        corner: Vector2<f64>,
        /// Direction of the rows, a unit vector.
        along: Vector2<f64>,
        /// Number of points in a row, and of rows: so many that they cover the polygon, each 1 or more.
        counts: [u32; 2],
        /// Distance along a row and from row to row, in m.
        distances: [f64; 2],
    },
}

/// Largest number of rings of a disc that are counted one by one. More rings have more points than a group may have.
const MOST_RINGS: u32 = 1 << 16;

impl Following {
    /// Side in m of the square whose area is that of a point.
    pub fn side(&self) -> f64 {
        match *self {
            Self::Rings { hole, rings, width } => {
                let across = f64::from(rings) * width;
                // A disc with more rings is not counted: it has too many points, and its group is refused.
                let area = core::f64::consts::PI * across * (across + 2.0 * hole);
                let points = |ring| points_of_ring(ring, hole / width);
                let counted = (rings <= MOST_RINGS).then(|| (0..rings).map(points).sum());
                counted.map_or(width, |points: u64| (area / points as f64).sqrt())
            }
            Self::Rows { distances, .. } => (distances[0] * distances[1]).sqrt(),
        }
    }
}

/// Points in a ring; rings are counted from the centre, or from a hole whose radius is `hole` widths of a ring. It is the
/// multiple of four nearest to the ring's area divided by the square of its width.
pub fn points_of_ring(ring: u32, hole: f64) -> u64 {
    4 * (core::f64::consts::FRAC_PI_4 * (2.0 * hole + f64::from(2 * ring + 1))).round() as u64
}

impl GroupConfig {
    /// The lattice that follows the outline, for points that are `distance` (m) apart. `None` if the group does not ask
    /// for one, or if it is a rectangle, which is filled along its sides anyway.
    pub fn following(&self, distance: f64) -> Option<Following> {
        if self.lattice == Lattice::Grid {
            return None;
        }
        match &self.fill {
            Fill::Disc { radius, .. } => {
                let rings = whole(radius / distance);
                let width = radius / f64::from(rings);
                let hole = 0.0;
                Some(Following::Rings { hole, rings, width })
            }
            &Fill::Ring { radius, inner, .. } => {
                let rings = whole((radius - inner) / distance);
                let width = (radius - inner) / f64::from(rings);
                let hole = inner;
                Some(Following::Rings { hole, rings, width })
            }
            Fill::Polygon { vertices } => rows(vertices, distance),
            Fill::Rectangle { .. } | Fill::Points { .. } => None,
        }
    }
}

/// The nearest integer to `n`, 1 at least. A number that is too large is reported elsewhere.
fn whole(n: f64) -> u32 {
    n.round().max(1.0) as u32
}

/// Rows along the first of the longest edges; `None` if the vertices form no polygon.
fn rows(vertices: &[[f64; 2]], distance: f64) -> Option<Following> {
    let at = |i: usize| Vector2::from(vertices[i % vertices.len()]);
    let edges = (0..vertices.len()).map(|i| at(i + 1) - at(i));
    let longest = edges.reduce(|a, b| {
        // Edges whose lengths differ only by rounding count as equal, so that the first one is chosen.
        if b.norm() > a.norm() * (1.0 + 1e-9) {
            b
        } else {
            a
        }
    })?;
    if !(longest.norm() > 0.0 && longest.norm().is_finite()) {
        return None;
    }
    let along = longest / longest.norm();
    let across = Vector2::new(-along.y, along.x);
    let extent = |axis: Vector2<f64>| {
        let places = vertices.iter().map(|&v| Vector2::from(v).dot(&axis));
        places.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
            [low.min(x), high.max(x)]
        })
    };
    let extents = [extent(along), extent(across)];
    let counts = extents.map(|[low, high]| whole((high - low) / distance));
    let distances = [0, 1].map(|a| (extents[a][1] - extents[a][0]) / f64::from(counts[a]));
    Some(Following::Rows {
        corner: along * extents[0][0] + across * extents[1][0],
        along,
        counts,
        distances,
    })
}
