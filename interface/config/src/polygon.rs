//! Tests whether vertices form a simple polygon, and measures of polygons; for outlines of bodies and regions of
//! points.

use super::fault::Faults;

/// A point in m.
type Point = [f64; 2];

/// A polygon is flat, up to rounding, if its triangles together have less than this share of the square of its extent.
const FLAT: f64 = 1e-12;

/// Lower left and upper right corner of points in m.
pub fn bounds(points: &[Point]) -> [Point; 2] {
    let mut bounds = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
    for point in points {
        for axis in 0..2 {
            bounds[0][axis] = bounds[0][axis].min(point[axis]);
            bounds[1][axis] = bounds[1][axis].max(point[axis]);
        }
    }
    bounds
}

/// Signed area of a closed polygon in m^2: positive counter-clockwise.
pub fn area(vertices: &[Point]) -> f64 {
    let twice = |(a, b): (&Point, &Point)| cross(vertices[0], *a, *b);
    0.5 * edges(vertices).map(twice).sum::<f64>()
}

/// The vertices of a polygon in counter-clockwise order.
pub fn counter_clockwise(mut vertices: Vec<Point>) -> Vec<Point> {
    if area(&vertices) < 0.0 {
        vertices.reverse();
    }
    vertices
}

/// Length of an outline in m: there and back for two vertices.
pub fn perimeter(vertices: &[Point]) -> f64 {
    let length = |(a, b): (&Point, &Point)| (b[0] - a[0]).hypot(b[1] - a[1]);
    edges(vertices).map(length).sum()
}

/// Distance of a point from the outline in m: positive inside a closed polygon, negative outside.
pub fn depth(vertices: &[Point], [x, y]: Point) -> f64 {
    let (mut inside, mut least) = (false, f64::INFINITY);
    for (a, b) in edges(vertices) {
        let [dx, dy] = [b[0] - a[0], b[1] - a[1]];
        let along = ((x - a[0]) * dx + (y - a[1]) * dy) / (dx * dx + dy * dy);
        let along = along.clamp(0.0, 1.0);
        least = least.min((x - a[0] - along * dx).hypot(y - a[1] - along * dy));
        if (a[1] > y) != (b[1] > y) && x < a[0] + (y - a[1]) / dy * dx {
            inside = !inside;
        }
    }
    if inside { least } else { -least }
}

fn edges(vertices: &[Point]) -> impl Iterator<Item = (&Point, &Point)> {
    vertices.iter().zip(vertices.iter().cycle().skip(1))
}

impl Faults<'_> {
    /// Refuses vertices that are not finite or form no simple polygon; `key` is the key of the vertices.
    pub fn polygon(&mut self, key: &str, vertices: &[Point]) {
        if !vertices.as_flattened().iter().all(|x| x.is_finite()) {
            return self.finite(key, vertices.as_flattened());
        }
        if let Err((what, help)) = simple(vertices) {
            self.add(key, format!("a polygon {what}"), "a simple polygon", help);
        }
    }
}

/// Whether vertices form a simple polygon.
///
/// # Errors
/// The first reason why not, and what to do.
fn simple(vertices: &[Point]) -> Result<(), (String, &'static str)> {
    let n = vertices.len();
    if n < 3 {
        let help = "it takes three or more; a segment or a disc has a shape of its own";
        return Err((format!("of {n} vertices"), help));
    }
    if let Some(i) = (0..n).find(|&i| vertices[i] == vertices[(i + 1) % n]) {
        let help = "drop one of them; the outline closes by itself";
        let j = (i + 1) % n;
        return Err((format!("whose vertices {i} and {j} coincide"), help));
    }
    // A flat polygon also folds back on itself. To report it as flat says more.
    let [lower, upper] = bounds(vertices);
    let extent = (upper[0] - lower[0]).hypot(upper[1] - lower[1]);
    let off_the_line = edges(vertices).map(|(a, b)| cross(vertices[0], *a, *b).abs());
    if off_the_line.sum::<f64>() <= FLAT * extent * extent {
        let what = "whose vertices all lie on one line".to_owned();
        return Err((what, "a line is `shape.segment`"));
    }
    let Some((i, j)) = crossing(vertices) else {
        return Ok(());
    };
    let what = format!(
        "whose edges cross or touch: the one from vertex {i} {:?} and the one from vertex {j} {:?}",
        vertices[i], vertices[j]
    );
    let help = "list the vertices in the order of the outline, in either sense, counted from 0";
    Err((what, help))
}

/// The first two edges that cross or touch where they should not. Only edges whose ranges in x overlap are compared.
fn crossing(vertices: &[Point]) -> Option<(usize, usize)> {
    let n = vertices.len();
    let end = |i: usize| vertices[(i + 1) % n];
    let left = |i: usize| vertices[i][0].min(end(i)[0]);
    let mut by_left: Vec<usize> = (0..n).collect();
    by_left.sort_by(|&i, &j| left(i).total_cmp(&left(j)));
    let mut first = None;
    for (k, &one) in by_left.iter().enumerate() {
        let right = vertices[one][0].max(end(one)[0]);
        let near = by_left[k + 1..].iter().take_while(|&&j| left(j) <= right);
        for &other in near {
            let (i, j) = (one.min(other), one.max(other));
            let (a, b, c, d) = (vertices[i], end(i), vertices[j], end(j));
            let crosses = if j == i + 1 {
                folds_back(a, b, d)
            } else if i == 0 && j == n - 1 {
                folds_back(c, a, b)
            } else {
                touch(a, b, c, d)
            };
            if crosses && first.is_none_or(|found| (i, j) < found) {
                first = Some((i, j));
            }
        }
    }
    first
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

    /// Far from the origin, products of coordinates have no digit of a small area.
    #[test]
    fn a_small_square_far_away_has_its_area() {
        let at = |x: f64, y: f64| [5e6 + 0.01 * x, -5e6 + 0.01 * y];
        let square = [at(0., 0.), at(1., 0.), at(1., 1.), at(0., 1.)];
        assert!((area(&square) / 1e-4 - 1.0).abs() < 1e-6);
        assert!((perimeter(&square) / 0.04 - 1.0).abs() < 1e-6);
    }
}
