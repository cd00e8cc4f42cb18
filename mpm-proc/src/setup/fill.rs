//! Filling a region with points.
//!
//! Points lie at the centres of boxes; each has the mass and the volume of its box. A rectangle is filled exactly (its
//! boxes are stretched to a whole number along each side); of discs and polygons those boxes count whose centre is
//! inside, so their area differs a little, which the solver's notes say.

use interface::Vec2;
use interface::config::{Fill, GroupConfig, Spacing};
use interface::solver::Refusal;
use mechanics::outline::crosses_ray;

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
    let side = match group.spacing {
        Spacing::PerCell(n) => cell / f64::from(n).sqrt().round(),
        Spacing::Distance(distance) => distance,
        Spacing::Counts(_) => 0.0, // goes with a rectangle, which has its counts
    };
    let region = match &group.fill {
        Fill::Disc { center, radius } => disc(*center, *radius, side),
        Fill::Rectangle { lower, upper } => {
            let size = [upper[0] - lower[0], upper[1] - lower[1]];
            let counts = match group.spacing {
                Spacing::Counts(counts) => counts.map(f64::from),
                _ => size.map(|s| (s / side).round().max(1.0)),
            };
            rectangle(*lower, size, counts.map(|n| n as usize))
        }
        Fill::Polygon { vertices } => polygon(vertices, side),
        Fill::Points { positions } => FilledRegion {
            positions: positions.clone(),
            sides: [side; 2],
            area: None,
        },
    };
    if region.positions.is_empty() {
        return Err(Refusal::new(
            format!("{key}.fill"),
            format!(
                "group '{}' has no points: the region is smaller than the spacing of {side} m; use a smaller spacing",
                group.name
            ),
        ));
    }
    Ok(region)
}

/// The lattice has a corner at the centre: four-fold symmetric, whatever the ratio of radius and side.
fn disc(center: [f64; 2], radius: f64, side: f64) -> FilledRegion {
    let half = (radius / side).ceil() as i64;
    let mut positions = Vec::new();
    for j in -half..half {
        for i in -half..half {
            let r = [i, j].map(|n| (n as f64 + 0.5) * side);
            if r[0] * r[0] + r[1] * r[1] <= radius * radius {
                positions.push([center[0] + r[0], center[1] + r[1]]);
            }
        }
    }
    FilledRegion {
        positions,
        sides: [side; 2],
        area: Some(core::f64::consts::PI * radius * radius),
    }
}

fn rectangle(lower: [f64; 2], size: [f64; 2], counts: [usize; 2]) -> FilledRegion {
    let sides = [0, 1].map(|a| size[a] / counts[a] as f64);
    let positions = (0..counts[1])
        .flat_map(|j| (0..counts[0]).map(move |i| [i, j]))
        .map(|at| [0, 1].map(|a| lower[a] + (at[a] as f64 + 0.5) * sides[a]))
        .collect();
    FilledRegion {
        positions,
        sides,
        area: Some(size[0] * size[1]),
    }
}

/// The lattice begins at the lower left corner of the polygon's bounds.
fn polygon(vertices: &[[f64; 2]], side: f64) -> FilledRegion {
    let outline: Vec<Vec2> = vertices.iter().map(|&v| Vec2::from(v)).collect();
    let lower = outline.iter().fold(outline[0], |a, b| a.inf(b));
    let upper = outline.iter().fold(outline[0], |a, b| a.sup(b));
    // A hair less than the quotient, so that a side that divides the bounds exactly adds no empty row.
    let counts = ((upper - lower) / side).map(|n| (n - 1e-9).ceil().max(1.0));
    let edges = || (0..outline.len()).map(|i| (outline[i], outline[(i + 1) % outline.len()]));
    let mut positions = Vec::new();
    for j in 0..counts.y as usize {
        for i in 0..counts.x as usize {
            let p = lower + Vec2::new(i as f64 + 0.5, j as f64 + 0.5) * side;
            if edges().fold(false, |inside, (a, b)| inside ^ crosses_ray(a, b, p)) {
                positions.push([p.x, p.y]);
            }
        }
    }
    let area = 0.5 * edges().map(|(a, b)| a.perp(&b)).sum::<f64>().abs();
    FilledRegion {
        positions,
        sides: [side; 2],
        area: Some(area),
    }
}

/// Refuses groups whose boxes lie on top of one another by more than half a side.
///
/// # Errors
/// A [`Refusal`] that names both groups.
pub fn refuse_overlap(groups: &[GroupConfig], points: &[FilledRegion]) -> Result<(), Refusal> {
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
                if other > g && near(0) && near(1) {
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
