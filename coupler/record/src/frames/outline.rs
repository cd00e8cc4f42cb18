//! The outline of a body as it is drawn: that of the polygon together with the disc that is swept along it.

use core::f64::consts::{PI, TAU};

use interface::config::{BodyConfig, BodyShape, polygon};

/// Number of edges with which a full circle is drawn.
const EDGES_A_TURN: f64 = 48.0;

/// The closed outlines of a body, counter-clockwise, in the scene's coordinates (m) at the start: one for a
/// spheropolygon, one for each disc of a cluster.
pub(super) fn outlines(body: &BodyConfig) -> Vec<Vec<[f64; 2]>> {
    let vertices = body.placed();
    match &body.shape {
        BodyShape::Cluster { .. } => {
            let discs = vertices.iter().enumerate();
            let disc = |(i, &center)| swept(&[center], body.radius_at(i));
            discs.map(disc).collect()
        }
        _ => vec![swept(&vertices, body.sphero_radius)],
    }
}

/// The outline of a polygon (m) with a disc of `radius` (m) swept along it. One vertex is a disc, two are a rounded
/// segment. At a reflex corner the offset edges meet in a corner.
fn swept(vertices: &[[f64; 2]], radius: f64) -> Vec<[f64; 2]> {
    let around = |[x, y]: [f64; 2], from: f64, turn: f64| {
        let edges = (turn / TAU * EDGES_A_TURN).ceil().max(1.0);
        let at = move |k: u32| from + turn * f64::from(k) / edges;
        (0..=edges as u32).map(move |k| [x + radius * at(k).cos(), y + radius * at(k).sin()])
    };
    if let [center] = *vertices {
        let mut circle: Vec<[f64; 2]> = around(center, 0.0, TAU).collect();
        circle.pop(); // where it began
        return circle;
    }
    let n = vertices.len();
    let edge = |v: &[[f64; 2]], i: usize| {
        let ([ax, ay], [bx, by]) = (v[i % n], v[(i + 1) % n]);
        [bx - ax, by - ay]
    };
    let vertices = polygon::counter_clockwise(vertices.to_vec());
    if radius == 0.0 {
        return vertices;
    }
    let mut outline = Vec::new();
    for i in 0..n {
        let ([ax, ay], [bx, by]) = (edge(&vertices, i + n - 1), edge(&vertices, i));
        let turn = if n == 2 {
            PI
        } else {
            (ax * by - ay * bx).atan2(ax * bx + ay * by)
        };
        // Outside is to the right of an edge.
        let outside = (-ax).atan2(ay);
        if turn >= 0.0 {
            outline.extend(around(vertices[i], outside, turn));
        } else {
            let [x, y] = vertices[i];
            let (middle, reach) = (outside + 0.5 * turn, radius / (0.5 * turn).cos());
            outline.push([x + reach * middle.cos(), y + reach * middle.sin()]);
        }
    }
    outline
}

#[cfg(test)]
mod tests {
    use super::polygon::area;
    use super::*;

    /// Area of a disc as drawn.
    fn disc(radius: f64) -> f64 {
        0.5 * EDGES_A_TURN * (TAU / EDGES_A_TURN).sin() * radius * radius
    }

    #[test]
    fn the_area_is_that_of_the_swept_shape() {
        let a = 0.3;
        // Steiner: A + P a + pi a^2 of a convex one, in either sense.
        let square = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]];
        let reversed: Vec<[f64; 2]> = square.into_iter().rev().collect();
        for square in [&square[..], &reversed] {
            assert!((area(&swept(square, a)) - (4.0 + 8.0 * a + disc(a))).abs() < 1e-12);
        }
        let segment = [[0.0, 0.0], [3.0, 4.0]];
        assert!((area(&swept(&segment, a)) - (10.0 * a + disc(a))).abs() < 1e-12);
        assert!((area(&swept(&[[7.0, -1.0]], a)) - disc(a)).abs() < 1e-12);
        // An L of three unit squares: its five outer corners make a disc and a quarter, the inner one loses a square of a
        // that the two strips there would count twice.
        let l = [
            [0.0, 0.0],
            [2.0, 0.0],
            [2.0, 1.0],
            [1.0, 1.0],
            [1.0, 2.0],
            [0.0, 2.0],
        ];
        let expected = 3.0 + 8.0 * a + 1.25 * disc(a) - a * a;
        assert!((area(&swept(&l, a)) - expected).abs() < 1e-12);
        assert_eq!(swept(&l, 0.0), l);
    }
}
