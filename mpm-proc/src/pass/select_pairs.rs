//! Chooses the points of two groups that may touch: those within `r_a + r_b + V_d` of a point of the other group
//! (PROTOCOL.md I-7).

use crate::kernel::shape::Shape;
use crate::kernel::transfer::AffineState;
use crate::state::points::Cloud;

/// A point: its id less the cloud's first id, and its position in m.
type Point = (u32, [f64; 2]);

/// The points of both clouds that are within contact distance plus `skin` (m) of a point of the other cloud, by id less
/// the cloud's first id, in no order.
pub fn near_one_another<const W: usize, S: Shape<W>, A: AffineState>(
    clouds: [&Cloud<W, S, A>; 2],
    skin: f64,
) -> [Vec<u32>; 2] {
    let distance = clouds[0].radius + clouds[1].radius + skin;
    let extents = [extent(clouds[0]), extent(clouds[1])];
    let a = within(clouds[0], &extents[1], distance);
    let b = within(clouds[1], &extents[0], distance);
    let bins = [Bins::new(&a, distance), Bins::new(&b, distance)];
    [bins[1].near(&a), bins[0].near(&b)]
}

/// Smallest and largest coordinates of a cloud's points in m.
fn extent<const W: usize, S: Shape<W>, A: AffineState>(cloud: &Cloud<W, S, A>) -> [[f64; 2]; 2] {
    let [mut lower, mut upper] = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
    for tile in &cloud.tiles {
        cloud.points_of(tile, &mut |_, x| {
            for a in 0..2 {
                lower[a] = lower[a].min(x[a]);
                upper[a] = upper[a].max(x[a]);
            }
        });
    }
    [lower, upper]
}

/// The points of a cloud that lie within `distance` (m) of a box.
fn within<const W: usize, S: Shape<W>, A: AffineState>(
    cloud: &Cloud<W, S, A>,
    [lower, upper]: &[[f64; 2]; 2],
    distance: f64,
) -> Vec<Point> {
    let d = distance * (1.0 + 1e-9); // slightly more, because coordinates are rounded
    let inside = |x: &[f64; 2]| (0..2).all(|a| lower[a] - d <= x[a] && x[a] <= upper[a] + d);
    let mut found = Vec::new();
    for tile in &cloud.tiles {
        cloud.points_of(tile, &mut |local, x| {
            if inside(&x) {
                found.push((local, x));
            }
        });
    }
    found
}

/// Points in square bins as wide as the distance that is asked for.
struct Bins {
    distance: f64,
    /// Row, column and position, in order of the first two.
    sorted: Vec<([i64; 2], [f64; 2])>,
}

impl Bins {
    fn new(points: &[Point], distance: f64) -> Self {
        let mut sorted: Vec<_> = points
            .iter()
            .map(|(_, x)| (bin(*x, distance), *x))
            .collect();
        sorted.sort_unstable_by_key(|(bin, _)| *bin);
        Self { distance, sorted }
    }

    /// Those of `points` that have a point of these bins within the distance.
    fn near(&self, points: &[Point]) -> Vec<u32> {
        let near = |x: [f64; 2]| {
            let [row, column] = bin(x, self.distance);
            (row - 1..=row + 1).any(|row| {
                let from = self.sorted.partition_point(|(b, _)| *b < [row, column - 1]);
                let here = self.sorted[from..].iter();
                let mut here = here.take_while(|(b, _)| *b <= [row, column + 1]);
                here.any(|(_, y)| (x[0] - y[0]).hypot(x[1] - y[1]) <= self.distance)
            })
        };
        let chosen = points.iter().filter(|(_, x)| near(*x));
        chosen.map(|(local, _)| *local).collect()
    }
}

/// Row and column of the bin of a position.
fn bin(x: [f64; 2], side: f64) -> [i64; 2] {
    [x[1], x[0]].map(|x| (x / side).floor() as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against a comparison of all pairs, with bins narrower and wider than 1 m.
    #[test]
    fn bins_find_the_points_within_the_distance() {
        let mut random = fastrand::Rng::with_seed(5);
        for distance in [0.3, 1.0, 4.0] {
            let mut cloud = |count: u32| -> Vec<Point> {
                let mut any = || distance * (8.0 * random.f64() - 4.0);
                (0..count).map(|local| (local, [any(), any()])).collect()
            };
            let [a, b] = [cloud(60), cloud(20)];
            let apart = |x: [f64; 2], y: [f64; 2]| (x[0] - y[0]).hypot(x[1] - y[1]);
            let near = |x| b.iter().any(|(_, y)| apart(x, *y) <= distance);
            let near = a.iter().filter(|(_, x)| near(*x));
            let expected: Vec<u32> = near.map(|(local, _)| *local).collect();
            assert!((20..50).contains(&expected.len()), "{}", expected.len());
            assert_eq!(Bins::new(&b, distance).near(&a), expected, "{distance}");
        }
    }
}
