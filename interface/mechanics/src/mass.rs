//! Area, centroid and moment of inertia of a swept shape (docs/physics.md section 5). They define mass and inertia of a
//! body in PROTOCOL.md section 10, for every solver that gets a density.
//!
//! The Minkowski sum of a simple polygon and a disc of radius `a` is cut into the polygon, a rectangle `L x a` on the
//! outside of every edge, a circular sector at every convex corner, and at every reflex corner a kite that the two
//! rectangles there cover twice. A point is one sector of `2 pi`; a segment is a polygon of two edges, there and
//! back, with two sectors of `pi`.
//!
//! A cluster is the union of its discs: Green's theorem turns its moments into sums over the arcs that no other disc
//! covers, so what several discs cover counts once.

use std::f64::consts::{PI, TAU};

use interface::Vec2;
use interface::config::BodyInertia;

/// The z component of the cross product of two plane vectors.
#[inline]
pub fn cross(a: Vec2, b: Vec2) -> f64 {
    a.x * b.y - a.y * b.x
}

/// Area moments of a plane shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AreaMoments {
    /// `A` in m^2.
    pub area: f64,
    /// Centroid in m.
    pub centroid: Vec2,
    /// Polar second moment of area about the centroid in m^4.
    pub polar: f64,
}

impl AreaMoments {
    /// Mass (kg/m) of a body of this shape and its moment of inertia (kg m) about the centroid; not checked.
    pub fn mass(&self, inertia: BodyInertia) -> (f64, f64) {
        let mass = match inertia {
            BodyInertia::Mass(mass) => mass,
            BodyInertia::Density(density) => density * self.area,
        };
        (mass, mass * self.polar / self.area)
    }
}

/// Area, first moment and polar moment about a common origin, so that pieces can be added.
#[derive(Debug, Clone, Copy, Default)]
struct Sum {
    area: f64,
    first: Vec2,
    polar: f64,
}

impl Sum {
    /// Adds a piece of signed `area` whose centroid is at `at` and whose polar moment about its centroid is `own`.
    fn add(&mut self, area: f64, at: Vec2, own: f64) {
        self.area += area;
        self.first += at * area;
        self.polar += own + area * at.norm_squared();
    }

    /// The moments about the centroid; the common origin is at `origin`.
    fn about_centroid(&self, origin: Vec2) -> AreaMoments {
        let from_origin = self.first / self.area;
        AreaMoments {
            area: self.area,
            centroid: origin + from_origin,
            polar: self.polar - self.area * from_origin.norm_squared(),
        }
    }

    /// Adds `sign` times the triangle `origin u v`, all relative to the common origin.
    fn add_triangle(&mut self, o: Vec2, u: Vec2, v: Vec2, sign: f64) {
        let (p, q) = (u - o, v - o);
        let area = 0.5 * cross(p, q);
        let centroid = o + (p + q) / 3.0;
        // Polar moment of a triangle about its centroid: area / 36 times the sum of its squared sides.
        let sides = p.norm_squared() + q.norm_squared() + (p - q).norm_squared();
        self.add(sign * area, centroid, sign * area * sides / 36.0);
    }
}

/// Moments of the shape swept by a disc of radius `a` (m) along the polygon `vertices` (m), which is simple and in
/// counter-clockwise order (one vertex: a disc; two: a rounded segment).
///
/// It is exact unless a part of the outline is covered by another one, as with a sphero-radius that is too large for a
/// notch.
pub fn swept(vertices: &[Vec2], a: f64) -> AreaMoments {
    let n = vertices.len();
    // Relative to the first vertex, because the origin of the body's coordinates may be far away.
    let at = |i: usize| vertices[i % n] - vertices[0];
    let mut sum = Sum::default();
    if n == 1 {
        sum.add(PI * a * a, Vec2::zeros(), 0.5 * PI * a.powi(4));
    } else {
        for i in 0..n {
            let (before, here, next) = (at(i + n - 1), at(i), at(i + 1));
            sum.add_triangle(Vec2::zeros(), here, next, 1.0);
            let (edge, edge_before) = (next - here, here - before);
            let (length, normal) = (edge.norm(), outward(edge));
            let normal_before = outward(edge_before);
            // Rectangle on the outside of this edge.
            let middle = (here + next) * 0.5 + normal * (0.5 * a);
            let own = length * a * (length * length + a * a) / 12.0;
            sum.add(length * a, middle, own);
            // Corner between the edge before and this one.
            let turn = cross(edge_before, edge).atan2(edge_before.dot(&edge));
            let turn = if n == 2 { PI } else { turn };
            if turn > 0.0 {
                add_sector(&mut sum, here, normal_before, turn, a);
            } else if turn < 0.0 {
                let side = a * (0.5 * turn.abs()).tan();
                let meeting = here + normal * a + edge / length * side;
                sum.add_triangle(here, here + normal * a, meeting, -1.0);
                sum.add_triangle(here, meeting, here + normal_before * a, -1.0);
            }
        }
    }
    sum.about_centroid(vertices[0])
}

/// Unit normal on the outside of an edge of a counter-clockwise polygon.
#[inline]
pub fn outward(edge: Vec2) -> Vec2 {
    Vec2::new(edge.y, -edge.x) / edge.norm()
}

/// A sector of radius `a` and opening `turn` with its apex at `apex`, starting in the direction `from`.
fn add_sector(sum: &mut Sum, apex: Vec2, from: Vec2, turn: f64, a: f64) {
    debug_assert!(turn <= TAU);
    let area = 0.5 * turn * a * a;
    let half = 0.5 * turn;
    let (sin, cos) = half.sin_cos();
    let bisector = Vec2::new(from.x * cos - from.y * sin, from.x * sin + from.y * cos);
    let to_centroid = 4.0 * a * sin / (3.0 * turn);
    let about_apex = 0.25 * turn * a.powi(4);
    let own = about_apex - area * to_centroid * to_centroid;
    sum.add(area, apex + bisector * to_centroid, own);
}

/// Moments of the union of discs at `centers` (m) with `radii` (m), which may overlap, touch or lie apart.
pub fn union_of_discs(centers: &[Vec2], radii: &[f64]) -> AreaMoments {
    let discs = || {
        centers
            .iter()
            .map(|c| c - centers[0])
            .zip(radii.iter().copied())
    };
    let mut sum = Sum::default();
    for (i, (c, r)) in discs().enumerate() {
        let mut from = 0.0;
        let covered = covered_arcs(i, c, r, discs());
        for [begin, end] in covered.into_iter().chain([[TAU, TAU]]) {
            if begin > from {
                add_arc(&mut sum, c, r, [from, begin]);
            }
            from = f64::max(from, end);
        }
    }
    sum.about_centroid(centers[0])
}

/// The arcs, as angles in 0 to 2 pi in ascending order of their beginnings, of the circle `i` around `c` with radius
/// `r` that other discs cover. Of two equal discs the first covers the second.
fn covered_arcs(
    i: usize,
    c: Vec2,
    r: f64,
    discs: impl Iterator<Item = (Vec2, f64)>,
) -> Vec<[f64; 2]> {
    let mut covered: Vec<[f64; 2]> = Vec::new();
    for (j, (other, other_r)) in discs.enumerate() {
        let away = other - c;
        let d = away.norm();
        let equal = d == 0.0 && other_r == r;
        if i == j || d >= r + other_r || d <= r - other_r && !(equal && j < i) {
            continue; // apart, or the other is within this one
        }
        if d <= other_r - r {
            return vec![[0.0, TAU]];
        }
        let half = ((d * d + r * r - other_r * other_r) / (2.0 * d * r)).acos();
        let begin = (away.y.atan2(away.x) - half).rem_euclid(TAU);
        let end = begin + 2.0 * half;
        if end > TAU {
            covered.extend([[begin, TAU], [0.0, end - TAU]]);
        } else {
            covered.push([begin, end]);
        }
    }
    covered.sort_by(|a, b| a[0].total_cmp(&b[0]));
    covered
}

/// Adds the boundary integrals over the arc `[from, to]` of the circle around `c` with radius `r`:
/// `A = 1/2 (x dy - y dx)`, `(x^2 dy, -y^2 dx) / 2` and `(x^3 dy - y^3 dx) / 3`.
fn add_arc(sum: &mut Sum, c: Vec2, r: f64, [from, to]: [f64; 2]) {
    // Integrals of the powers 1 to 4 of the cosine over the angle up to t, and of the sine.
    let powers = |t: f64| {
        let (sin, cos) = t.sin_cos();
        let (twice, four) = ((2.0 * t).sin() / 4.0, (4.0 * t).sin() / 32.0);
        let of_cos = [
            sin,
            0.5 * t + twice,
            sin - sin.powi(3) / 3.0,
            0.375 * t + twice + four,
        ];
        let of_sin = [
            -cos,
            0.5 * t - twice,
            -cos + cos.powi(3) / 3.0,
            0.375 * t - twice + four,
        ];
        [of_cos, of_sin]
    };
    let (begin, end) = (powers(from), powers(to));
    for axis in 0..2 {
        let p: [f64; 4] = std::array::from_fn(|n| end[axis][n] - begin[axis][n]);
        let c = c[axis];
        sum.area += 0.5 * r * (c * p[0] + r * p[1]);
        sum.first[axis] += 0.5 * r * (c * c * p[0] + 2.0 * c * r * p[1] + r * r * p[2]);
        sum.polar += r / 3.0
            * (c.powi(3) * p[0]
                + 3.0 * c * c * r * p[1]
                + 3.0 * c * r * r * p[2]
                + r.powi(3) * p[3]);
    }
}
