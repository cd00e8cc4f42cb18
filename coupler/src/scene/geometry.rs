//! Measures of fills and outlines, and what makes an outline impossible.

use interface::config::{Fill, Spacing};

/// A point in m.
type Point = [f64; 2];

/// Lower left and upper right corner of points.
pub(super) fn bounds(points: &[Point]) -> [Point; 2] {
    let mut bounds = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
    for point in points {
        for axis in 0..2 {
            bounds[0][axis] = bounds[0][axis].min(point[axis]);
            bounds[1][axis] = bounds[1][axis].max(point[axis]);
        }
    }
    bounds
}

/// Lower left and upper right corner of a fill in m.
pub(super) fn fill_bounds(fill: &Fill) -> [Point; 2] {
    match fill {
        Fill::Disc {
            center: [x, y],
            radius: r,
        } => [[x - r, y - r], [x + r, y + r]],
        Fill::Rectangle { lower, upper } => [*lower, *upper],
        Fill::Polygon { vertices } => bounds(vertices),
        Fill::Points { positions } => bounds(positions),
    }
}

/// Distances of neighbouring points along x and y in m.
pub(super) fn distances(spacing: &Spacing, fill: &Fill, cell: f64) -> Point {
    match *spacing {
        Spacing::PerCell(n) => [cell / f64::from(n).sqrt(); 2],
        Spacing::Distance(distance) => [distance; 2],
        Spacing::Counts([nx, ny]) => {
            let [lower, upper] = fill_bounds(fill);
            [
                (upper[0] - lower[0]) / f64::from(nx),
                (upper[1] - lower[1]) / f64::from(ny),
            ]
        }
    }
}

/// About how many points a fill holds.
pub(super) fn points_estimate(fill: &Fill, spacing: &Spacing, cell: f64) -> f64 {
    let [dx, dy] = distances(spacing, fill, cell);
    match (fill, spacing) {
        (Fill::Points { positions }, _) => positions.len() as f64,
        (_, Spacing::Counts([nx, ny])) => f64::from(*nx) * f64::from(*ny),
        _ => (fill_area(fill) / (dx * dy)).round(),
    }
}

fn fill_area(fill: &Fill) -> f64 {
    match fill {
        Fill::Disc { radius, .. } => std::f64::consts::PI * radius * radius,
        Fill::Rectangle { lower, upper } => (upper[0] - lower[0]) * (upper[1] - lower[1]),
        Fill::Polygon { vertices } => area(vertices).abs(),
        Fill::Points { .. } => 0.0,
    }
}

/// Signed area of a closed polygon in m^2: positive counter-clockwise.
pub(super) fn area(vertices: &[Point]) -> f64 {
    let next = vertices.iter().cycle().skip(1);
    let twice: f64 = vertices
        .iter()
        .zip(next)
        .map(|(a, b)| a[0] * b[1] - b[0] * a[1])
        .sum();
    0.5 * twice
}

/// Length of an outline in m: there and back for two vertices.
pub(super) fn perimeter(vertices: &[Point]) -> f64 {
    let next = vertices.iter().cycle().skip(1);
    let length = |(a, b): (&Point, &Point)| (b[0] - a[0]).hypot(b[1] - a[1]);
    vertices.iter().zip(next).map(length).sum()
}

/// Why a list of vertices is not a simple polygon.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NotSimple {
    /// Fewer than three vertices.
    TooFew,
    /// These two neighbouring vertices coincide.
    Repeated(usize, usize),
    /// The edges that begin at these vertices cross or touch.
    Crossing(usize, usize),
    /// All vertices lie on one line.
    Flat,
}

/// Whether vertices form a simple polygon.
///
/// # Errors
/// The first reason why not.
pub(super) fn simple(vertices: &[Point]) -> Result<(), NotSimple> {
    let n = vertices.len();
    if n < 3 {
        return Err(NotSimple::TooFew);
    }
    for i in 0..n {
        let j = (i + 1) % n;
        if vertices[i] == vertices[j] {
            return Err(NotSimple::Repeated(i, j));
        }
    }
    let [lower, upper] = bounds(vertices);
    let extent = (upper[0] - lower[0]).hypot(upper[1] - lower[1]);
    for i in 0..n {
        for j in i + 1..n {
            let (a, b) = (vertices[i], vertices[(i + 1) % n]);
            let (c, d) = (vertices[j], vertices[(j + 1) % n]);
            let crossing = if j == i + 1 {
                folds_back(a, b, d)
            } else if i == 0 && j == n - 1 {
                folds_back(c, a, b)
            } else {
                touch(a, b, c, d)
            };
            if crossing {
                return Err(NotSimple::Crossing(i, j));
            }
        }
    }
    // Rounding of a flat polygon's area is far below this.
    if area(vertices).abs() <= 1e-12 * extent * extent {
        return Err(NotSimple::Flat);
    }
    Ok(())
}

/// Twice the signed area of the triangle `a b c`.
fn cross(a: Point, b: Point, c: Point) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Whether the edge `b c` runs back along `a b`.
fn folds_back(a: Point, b: Point, c: Point) -> bool {
    let along = (b[0] - a[0]) * (c[0] - b[0]) + (b[1] - a[1]) * (c[1] - b[1]);
    cross(a, b, c) == 0.0 && along < 0.0
}

/// Whether the segments `a b` and `c d` have a point in common.
fn touch(a: Point, b: Point, c: Point, d: Point) -> bool {
    let [lower_1, upper_1] = bounds(&[a, b]);
    let [lower_2, upper_2] = bounds(&[c, d]);
    let apart = (0..2).any(|i| upper_1[i] < lower_2[i] || upper_2[i] < lower_1[i]);
    !apart && cross(a, b, c) * cross(a, b, d) <= 0.0 && cross(c, d, a) * cross(c, d, b) <= 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_is_simple_and_a_bow_tie_is_not() {
        let square = [[0., 0.], [1., 0.], [1., 1.], [0., 1.]];
        assert_eq!(simple(&square), Ok(()));
        assert_eq!(area(&square), 1.0);
        assert_eq!(perimeter(&square), 4.0);
        let bow_tie = [[0., 0.], [1., 1.], [1., 0.], [0., 1.]];
        assert_eq!(simple(&bow_tie), Err(NotSimple::Crossing(0, 2)));
    }

    #[test]
    fn other_impossible_outlines_are_named() {
        assert_eq!(simple(&[[0., 0.], [1., 0.]]), Err(NotSimple::TooFew));
        assert_eq!(
            simple(&[[0., 0.], [1., 0.], [1., 0.], [0., 1.]]),
            Err(NotSimple::Repeated(1, 2))
        );
        assert_eq!(
            simple(&[[0., 0.], [2., 0.], [1., 0.], [1., 1.]]),
            Err(NotSimple::Crossing(0, 1))
        );
        // A vertex that lies on another edge.
        assert_eq!(
            simple(&[[0., 0.], [2., 0.], [2., 2.], [1., 0.], [0., 2.]]),
            Err(NotSimple::Crossing(0, 2))
        );
        let star = [
            [0., 3.],
            [-1., 1.],
            [-3., 0.],
            [-1., -1.],
            [0., -3.],
            [1., 0.],
        ];
        assert_eq!(simple(&star), Ok(()));
    }

    #[test]
    fn points_are_counted_by_area_number_or_list() {
        let disc = Fill::Disc {
            center: [0.0, 0.0],
            radius: 0.02,
        };
        let n = points_estimate(&disc, &Spacing::PerCell(36), 0.003);
        assert!((n - 5026.0).abs() < 2.0, "{n}");
        let block = Fill::Rectangle {
            lower: [0.0, 0.0],
            upper: [0.1, 0.1],
        };
        assert_eq!(
            points_estimate(&block, &Spacing::Counts([51, 51]), 1.0),
            2601.0
        );
        let [dx, _] = distances(&Spacing::Counts([51, 51]), &block, 1.0);
        assert!((dx - 0.1 / 51.0).abs() < 1e-15);
    }
}
