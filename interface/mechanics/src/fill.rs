//! Filling a region with points.
//!
//! Points lie at the centres of boxes; each has the mass and the volume of its box. A rectangle is filled exactly (its
//! boxes are stretched to a whole number along each side); of discs and polygons those boxes count whose centre is
//! inside, so their area differs a little, which the solver's notes say. A lattice that follows the outline
//! ([`Following`]) fills discs, and rectangles that are turned, exactly.

use interface::Vec2;
use interface::config::{Fill, Following, GroupConfig, MpmConfig, points_of_ring, polygon};
use interface::solver::Refusal;

use crate::outline::crosses_ray;

/// The region of a group, filled with points.
#[derive(Debug, Clone)]
pub struct FilledRegion {
    /// Positions in m, row by row.
    pub positions: Vec<[f64; 2]>,
    /// Sides of the box of a point in m.
    pub sides: [f64; 2],
    /// Area of the region in m^2, where it has one.
    pub area: Option<f64>,
}

impl FilledRegion {
    /// Area of a point's box in m^2.
    pub fn box_area(&self) -> f64 {
        self.sides[0] * self.sides[1]
    }
}

/// Fills the region of a group, whose configuration has no faults. `key` is the group's place in it, for refusals.
///
/// # Errors
/// A [`Refusal`] if the region holds no point.
pub fn fill(group: &GroupConfig, cell: f64, key: &str) -> Result<FilledRegion, Refusal> {
    let [side, _] = group.distances(cell);
    let (sides, following) = (group.box_sides(cell), group.following(side));
    let round = |center, radius, inner| match &following {
        Some(following) => concentric(center, radius, following),
        None => disc(center, radius, inner, side),
    };
    let positions = match &group.fill {
        Fill::Disc { center, radius } => round(*center, *radius, 0.0),
        Fill::Ring {
            center,
            radius,
            inner,
        } => round(*center, *radius, *inner),
        Fill::Rectangle { lower, upper } => rectangle(*lower, *upper, sides),
        Fill::Polygon { vertices } => match &following {
            Some(following) => rows(vertices, following),
            None => along_the_grid(vertices, side),
        },
        Fill::Points { positions } => positions.clone(),
    };
    if positions.is_empty() {
        return Err(Refusal::new(
            format!("{key}.fill"),
            format!(
                "group '{}' has no points: the region is smaller than the spacing of {side} m; use a smaller spacing",
                group.name
            ),
        ));
    }
    Ok(FilledRegion {
        positions,
        sides,
        area: Some(group.fill.area()).filter(|area| *area > 0.0),
    })
}

/// The lattice has a corner at the centre: four-fold symmetric, whatever the ratio of radius and side. `inner` is the
/// radius of a hole, 0 for none.
fn disc(center: [f64; 2], radius: f64, inner: f64, side: f64) -> Vec<[f64; 2]> {
    let half = (radius / side).ceil() as i64;
    let mut positions = Vec::new();
    for j in -half..half {
        for i in -half..half {
            let r = [i, j].map(|n| (n as f64 + 0.5) * side);
            let squared = r[0] * r[0] + r[1] * r[1];
            if squared <= radius * radius && squared >= inner * inner {
                positions.push([center[0] + r[0], center[1] + r[1]]);
            }
        }
    }
    positions
}

/// The sides of a box divide those of the rectangle, up to rounding.
fn rectangle(lower: [f64; 2], upper: [f64; 2], sides: [f64; 2]) -> Vec<[f64; 2]> {
    let counts = [0, 1].map(|a| ((upper[a] - lower[a]) / sides[a]).round() as usize);
    (0..counts[1])
        .flat_map(|j| (0..counts[0]).map(move |i| [i, j]))
        .map(|at| [0, 1].map(|a| lower[a] + (at[a] as f64 + 0.5) * sides[a]))
        .collect()
}

/// Rings of points of the same area, each in the middle between the circles that bound that area. As the lattice along the
/// grid, they are four-fold symmetric: a ring has a multiple of four points, and none on an axis.
fn concentric(center: [f64; 2], radius: f64, lattice: &Following) -> Vec<[f64; 2]> {
    let &Following::Rings { hole, rings, width } = lattice else {
        unreachable!("round regions have round lattices");
    };
    let of_ring = |ring| points_of_ring(ring, hole / width);
    let points: u64 = (0..rings).map(of_ring).sum();
    let in_hole = (hole / radius) * (hole / radius);
    let bound = |within: u64| {
        let share = within as f64 / points as f64;
        radius * (in_hole + (1.0 - in_hole) * share).sqrt()
    };
    let mut positions = Vec::with_capacity(points as usize);
    let mut within = 0;
    for ring in 0..rings {
        let n = of_ring(ring);
        let r = 0.5 * (bound(within) + bound(within + n));
        for i in 0..n {
            let turn = (i as f64 + 0.5) / n as f64;
            let (sin, cos) = (core::f64::consts::TAU * turn).sin_cos();
            positions.push([center[0] + r * cos, center[1] + r * sin]);
        }
        within += n;
    }
    positions
}

/// Points of a lattice along an edge that are inside of the polygon.
fn rows(vertices: &[[f64; 2]], lattice: &Following) -> Vec<[f64; 2]> {
    let Following::Rows {
        corner,
        along,
        counts,
        distances,
    } = *lattice
    else {
        unreachable!("a polygon has rows")
    };
    let across = Vec2::new(-along.y, along.x);
    let place =
        |[i, j]: [f64; 2]| corner + along * (i * distances[0]) + across * (j * distances[1]);
    inside(vertices, counts, place)
}

/// The lattice begins at the lower left corner of the polygon's bounds.
fn along_the_grid(vertices: &[[f64; 2]], side: f64) -> Vec<[f64; 2]> {
    let [lower, upper] = polygon::bounds(vertices).map(Vec2::from);
    // Slightly less than the quotient, so that a side that divides the bounds exactly adds no empty row.
    let counts = ((upper - lower) / side).map(|n| (n - 1e-9).ceil().max(1.0));
    let place = |at| lower + Vec2::from(at) * side;
    let counts = [counts.x as u32, counts.y as u32];
    inside(vertices, counts, place)
}

/// The centres of a lattice of boxes that are inside of a polygon, row by row; `place` is the position of a place of the lattice.
fn inside(
    vertices: &[[f64; 2]],
    counts: [u32; 2],
    place: impl Fn([f64; 2]) -> Vec2,
) -> Vec<[f64; 2]> {
    let outline: Vec<Vec2> = vertices.iter().map(|&v| Vec2::from(v)).collect();
    let all = (0..counts[1]).flat_map(|j| (0..counts[0]).map(move |i| [i, j]));
    let centers = all.map(|at| place(at.map(|n| f64::from(n) + 0.5)));
    let inside = centers.filter(|p| holds(&outline, *p));
    inside.map(Into::into).collect()
}

/// Whether a polygon holds a point.
fn holds(outline: &[Vec2], p: Vec2) -> bool {
    let edges = outline.iter().zip(outline.iter().cycle().skip(1));
    edges.fold(false, |inside, (a, b)| inside ^ crosses_ray(*a, *b, p))
}

/// Refuses groups, filled with `points`, whose boxes lie on top of one another by more than half a side. Layers exchange
/// nothing except by their pairs, so groups on layers without a pair may overlap.
///
/// # Errors
/// A [`Refusal`] that names both groups.
pub fn refuse_overlap(config: &MpmConfig, points: &[FilledRegion]) -> Result<(), Refusal> {
    let groups = &config.groups;
    let is_pair = |of: [usize; 2]| config.group_pairs.contains(&of);
    let touch = |a, b| !config.layers || is_pair([a, b]) || is_pair([b, a]);
    let side = points.iter().flat_map(|p| p.sides).fold(0.0, f64::max);
    let bounds: Vec<[Vec2; 2]> = points.iter().map(bounds).collect();
    let meet =
        |a: &[Vec2; 2], b: &[Vec2; 2]| (0..2).all(|i| a[0][i] < b[1][i] && b[0][i] < a[1][i]);
    let mut sorted: Vec<([i64; 2], usize, [f64; 2])> = Vec::new();
    for (g, p) in points.iter().enumerate() {
        let alone = (0..points.len()).all(|o| o == g || !meet(&bounds[g], &bounds[o]));
        if alone {
            continue;
        }
        let bin = |x: &[f64; 2]| x.map(|x| (x / side).floor() as i64);
        sorted.extend(p.positions.iter().map(|x| (bin(x), g, *x)));
    }
    sorted.sort_unstable_by_key(|(bin, group, _)| (*bin, *group));
    let in_bin = |bin: [i64; 2]| {
        let from = sorted.partition_point(|(b, ..)| *b < bin);
        sorted[from..].iter().take_while(move |(b, ..)| *b == bin)
    };
    for (bin, g, x) in &sorted {
        for neighbour in (0..9).map(|k| [bin[0] + k % 3 - 1, bin[1] + k / 3 - 1]) {
            for (_, other, y) in in_bin(neighbour) {
                let near = |a: usize| {
                    let side = points[*g].sides[a].min(points[*other].sides[a]);
                    (x[a] - y[a]).abs() < 0.5 * side
                };
                if other > g && near(0) && near(1) && touch(*g, *other) {
                    return Err(Refusal::new(
                        format!("mpm.points.{other}.fill"),
                        format!(
                            "group '{}' lies on top of group '{}' at ({}, {}) m; move one of them",
                            groups[*other].name, groups[*g].name, y[0], y[1]
                        ),
                    ));
                }
            }
        }
    }
    Ok(())
}

/// Lower left and upper right corner of a group's boxes.
fn bounds(points: &FilledRegion) -> [Vec2; 2] {
    let half = 0.5 * Vec2::from(points.sides);
    let all = points.positions.iter().map(|&p| Vec2::from(p));
    all.fold(
        [Vec2::repeat(f64::INFINITY), Vec2::repeat(f64::NEG_INFINITY)],
        |[low, high], p| [low.inf(&(p - half)), high.sup(&(p + half))],
    )
}

#[cfg(test)]
mod tests {
    use interface::config::{Lattice, Spacing};

    use super::*;

    fn group(fill: Fill, distance: f64, lattice: Lattice) -> GroupConfig {
        GroupConfig {
            lattice,
            ..GroupConfig::at_rest("points", fill, Spacing::Distance(distance))
        }
    }

    fn filled(fill_: Fill, distance: f64, lattice: Lattice) -> FilledRegion {
        fill(&group(fill_, distance, lattice), 1.0, "").unwrap()
    }

    /// A square with sides of 2 around the origin.
    fn square(angle: f64) -> Vec<[f64; 2]> {
        let (s, c) = angle.sin_cos();
        let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        corners.map(|[x, y]| [c * x - s * y, s * x + c * y]).into()
    }

    #[test]
    fn a_turned_rectangle_is_filled_as_one_along_the_grid() {
        for angle in [0.0, 0.2, 0.7, 1.3, -0.9] {
            let fill = Fill::Polygon {
                vertices: square(angle),
            };
            let outline = filled(fill.clone(), 0.103, Lattice::Outline);
            assert_eq!(outline.positions.len(), 19 * 19);
            let area = 361.0 * outline.box_area();
            assert!((area - 4.0).abs() < 1e-12, "{area}");
            let reach = |axis: [f64; 2]| {
                let along = outline
                    .positions
                    .iter()
                    .map(|p| p[0] * axis[0] + p[1] * axis[1]);
                along.fold(f64::NEG_INFINITY, f64::max)
            };
            let (s, c) = angle.sin_cos();
            for axis in [[c, s], [-s, c], [-c, -s], [s, -c]] {
                assert!((reach(axis) - (1.0 - 1.0 / 19.0)).abs() < 1e-12, "{angle}");
            }
            let radius = group(fill, 0.103, Lattice::Outline).default_contact_radius(1.0);
            assert!((radius - 1.0 / 19.0).abs() < 1e-12);
        }
        // A lattice along the grid gives a jagged surface.
        let fill = Fill::Polygon {
            vertices: square(0.2),
        };
        let grid = filled(fill, 0.103, Lattice::Grid);
        let (s, c) = 0.2_f64.sin_cos();
        let along: Vec<f64> = grid.positions.iter().map(|p| p[0] * c + p[1] * s).collect();
        let most = along.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let at_the_face = along.iter().filter(|&&x| x > most - 1e-9).count();
        assert!(at_the_face < 3, "{at_the_face} of 19");
    }

    #[test]
    fn a_ring_is_filled_by_either_lattice() {
        let (radius, inner, distance) = (0.04, 0.03, 8e-4);
        let area = core::f64::consts::PI * (radius * radius - inner * inner);
        for (lattice, slack) in [(Lattice::Grid, 0.01), (Lattice::Outline, 1e-12)] {
            let center = [0.1, -0.2];
            let fill = Fill::Ring {
                center,
                radius,
                inner,
            };
            let region = filled(fill, distance, lattice);
            let filled = region.positions.len() as f64 * region.box_area();
            assert!((filled / area - 1.0).abs() < slack, "{}", filled / area);
            assert!((region.area.unwrap() / area - 1.0).abs() < 1e-12);
            let from_center = |p: &[f64; 2]| (p[0] - center[0]).hypot(p[1] - center[1]);
            let r: Vec<f64> = region.positions.iter().map(from_center).collect();
            let [least, most] =
                [f64::min, f64::max].map(|of| r.iter().copied().reduce(of).unwrap());
            assert!(least >= inner && most <= radius, "{least} {most}");
            if lattice == Lattice::Outline {
                let half = 0.5 * region.sides[0];
                for gap in [least - inner, radius - most] {
                    assert!((gap / half - 1.0).abs() < 0.05, "{gap} {half}");
                }
            }
        }
    }

    #[test]
    fn rings_fill_a_disc_and_all_reach_as_far() {
        for (radius, distance) in [(1.0, 0.05), (1.0, 0.3), (0.5, 0.013), (0.1, 1.0)] {
            let fill = Fill::Disc {
                center: [0.0; 2],
                radius,
            };
            let rings = filled(fill, distance, Lattice::Outline);
            let n = rings.positions.len() as f64;
            let area = n * rings.box_area() / (core::f64::consts::PI * radius * radius);
            assert!((area - 1.0).abs() < 1e-12, "{area}");
            let from_center: Vec<f64> = rings.positions.iter().map(|p| p[0].hypot(p[1])).collect();
            let most = from_center.iter().copied().fold(0.0, f64::max);
            let outer = from_center
                .iter()
                .filter(|r| **r > most - 1e-9 * radius)
                .count();
            let across = core::f64::consts::TAU * most / outer as f64;
            let inside = radius - most;
            if n > 50.0 {
                assert!((across / rings.sides[0] - 1.0).abs() < 0.05, "{across}");
                assert!(
                    (inside / (0.5 * rings.sides[0]) - 1.0).abs() < 0.05,
                    "{inside}"
                );
                // The moment of inertia of a disc, without that of the points themselves.
                let polar = from_center.iter().map(|r| r * r).sum::<f64>() / n;
                assert!(
                    (polar / (0.5 * radius * radius) - 1.0).abs() < 2.0 / n,
                    "{polar}"
                );
            }
            for q in 0..2 {
                let mean = rings.positions.iter().map(|p| p[q]).sum::<f64>() / n;
                assert!(mean.abs() < 1e-12 * radius);
            }
        }
    }

    #[test]
    fn no_point_lies_outside_of_a_polygon_with_slanted_edges() {
        let vertices = vec![[0.0, 0.0], [3.0, 1.0], [2.5, 2.5], [1.0, 1.2]];
        let outline: Vec<Vec2> = vertices.iter().map(|&v| v.into()).collect();
        let expected = polygon::area(&vertices);
        let region = filled(Fill::Polygon { vertices }, 0.07, Lattice::Outline);
        assert!(region.positions.iter().all(|&p| holds(&outline, p.into())));
        let area = region.positions.len() as f64 * region.box_area();
        assert!((area / expected - 1.0).abs() < 0.02);
    }
}
