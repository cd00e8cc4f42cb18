//! Filling a region with points.
//!
//! Points lie at the centres of boxes; each has the mass and the volume of its box. A rectangle is filled exactly (its
//! boxes are stretched to a whole number along each side); of discs and polygons those boxes count whose centre is
//! inside, so their area differs a little, which the solver's notes say.

use interface::Vec2;
use interface::config::{Fill, GroupConfig, Spacing};
use interface::solver::Refusal;
use mechanics::outline::crosses_ray;

use crate::kernel::tiles::Geometry;

/// More points than this per group are refused before memory is asked for: identities are 32 bits wide.
const POINTS_MAX: f64 = 2.0e9;

/// The points of a group.
#[derive(Debug, Clone)]
pub struct Points {
    /// Positions in m, row by row.
    pub positions: Vec<[f64; 2]>,
    /// Sides of the box of a point in m.
    pub sides: [f64; 2],
    /// Area of the region in m^2, where it has one.
    pub area: Option<f64>,
}

impl Points {
    /// Area of a point's box in m^2.
    pub fn box_area(&self) -> f64 {
        self.sides[0] * self.sides[1]
    }
}

/// Fills a group's region. `key` is the group's place in the configuration, for refusals.
///
/// # Errors
/// A [`Refusal`] that names the key.
pub fn fill(group: &GroupConfig, grid: &Geometry, key: &str) -> Result<Points, Refusal> {
    let side = side(group, grid, key)?;
    check_numbers(group, key)?;
    let points = match &group.fill {
        Fill::Disc { center, radius } => disc(*center, *radius, side),
        Fill::Rectangle { lower, upper } => {
            let size = [upper[0] - lower[0], upper[1] - lower[1]];
            let counts = match group.spacing {
                Spacing::Counts(counts) => counts.map(f64::from),
                _ => size.map(|s| (s / side).round().max(1.0)),
            };
            refuse_too_many(counts[0] * counts[1], key)?;
            rectangle(*lower, size, counts.map(|n| n as usize))
        }
        Fill::Polygon { vertices } => polygon(vertices, side, key)?,
        Fill::Points { positions } => Points {
            positions: positions.clone(),
            sides: [side; 2],
            area: None,
        },
    };
    if points.positions.is_empty() {
        return Err(Refusal::new(
            format!("{key}.fill"),
            format!(
                "group '{}' has no points: the region is smaller than the spacing of {side} m; use a smaller spacing",
                group.name
            ),
        ));
    }
    let outside = points
        .positions
        .iter()
        .find(|p| !(0..2).all(|a| p[a] >= grid.lower[a] && p[a] <= grid.upper[a]));
    if let Some([x, y]) = outside {
        return Err(Refusal::new(
            format!("{key}.fill"),
            format!(
                "group '{}' reaches out of the domain: a point lies at ({}, {}) m, the domain is [{}, {}] to [{}, {}] m; enlarge mpm.domain",
                group.name, x, y, grid.lower[0], grid.lower[1], grid.upper[0], grid.upper[1]
            ),
        ));
    }
    Ok(points)
}

/// Side of the square boxes in m (unused for counts).
fn side(group: &GroupConfig, grid: &Geometry, key: &str) -> Result<f64, Refusal> {
    let refuse = |message: String| Err(Refusal::new(format!("{key}.spacing"), message));
    match group.spacing {
        Spacing::PerCell(n) => {
            let root = f64::from(n).sqrt().round();
            if n == 0 || root * root != f64::from(n) {
                let near = root.max(1.0);
                return refuse(format!(
                    "per_cell = {n} is not the square of a whole number; use {} or {}",
                    near * near,
                    (near + 1.0) * (near + 1.0)
                ));
            }
            Ok(grid.cell / root)
        }
        Spacing::Distance(d) if d.is_finite() && d > 0.0 => Ok(d),
        Spacing::Distance(d) => refuse(format!("distance = {d} m must be above 0")),
        Spacing::Counts(counts) => {
            if !matches!(group.fill, Fill::Rectangle { .. }) {
                return refuse(
                    "counts go with a rectangle only; use per_cell or distance for this region"
                        .into(),
                );
            }
            if counts.contains(&0) {
                return refuse(format!("counts = {counts:?} must both be above 0"));
            }
            Ok(0.0)
        }
    }
}

fn check_numbers(group: &GroupConfig, key: &str) -> Result<(), Refusal> {
    let refuse = |message: String| Err(Refusal::new(format!("{key}.fill"), message));
    let finite = |p: &[f64; 2]| p.iter().all(|x| x.is_finite());
    match &group.fill {
        Fill::Disc { center, radius } => {
            if !finite(center) || !radius.is_finite() || *radius <= 0.0 {
                return refuse(format!(
                    "a disc needs a finite centre and a radius above 0, not {center:?} and {radius}"
                ));
            }
        }
        Fill::Rectangle { lower, upper } => {
            if !finite(lower) || !finite(upper) || upper[0] <= lower[0] || upper[1] <= lower[1] {
                return refuse(format!(
                    "a rectangle needs upper above lower in both directions, not {lower:?} and {upper:?}"
                ));
            }
        }
        Fill::Polygon { vertices } => {
            if vertices.len() < 3 || !vertices.iter().all(finite) {
                return refuse("a polygon needs at least three vertices, all finite".into());
            }
            if let Some([i, j]) = crossing_edges(vertices) {
                return refuse(format!(
                    "edges {i} and {j} of the polygon of group '{}' touch or cross; a simple polygon is needed",
                    group.name
                ));
            }
        }
        Fill::Points { positions } => {
            if !positions.iter().all(finite) {
                return refuse("positions must be finite".into());
            }
        }
    }
    Ok(())
}

fn refuse_too_many(count: f64, key: &str) -> Result<(), Refusal> {
    if count <= POINTS_MAX {
        return Ok(());
    }
    Err(Refusal::new(
        format!("{key}.spacing"),
        format!(
            "this asks for {count:.1e} points, more than {POINTS_MAX:.0e}; use a larger spacing or cell"
        ),
    ))
}

/// The lattice has a corner at the centre: four-fold symmetric, whatever the ratio of radius and side.
fn disc(center: [f64; 2], radius: f64, side: f64) -> Points {
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
    Points {
        positions,
        sides: [side; 2],
        area: Some(core::f64::consts::PI * radius * radius),
    }
}

fn rectangle(lower: [f64; 2], size: [f64; 2], counts: [usize; 2]) -> Points {
    let sides = [0, 1].map(|a| size[a] / counts[a] as f64);
    let positions = (0..counts[1])
        .flat_map(|j| (0..counts[0]).map(move |i| [i, j]))
        .map(|at| [0, 1].map(|a| lower[a] + (at[a] as f64 + 0.5) * sides[a]))
        .collect();
    Points {
        positions,
        sides,
        area: Some(size[0] * size[1]),
    }
}

/// The lattice begins at the lower left corner of the polygon's bounds.
fn polygon(vertices: &[[f64; 2]], side: f64, key: &str) -> Result<Points, Refusal> {
    let outline: Vec<Vec2> = vertices.iter().map(|&v| Vec2::from(v)).collect();
    let lower = outline.iter().fold(outline[0], |a, b| a.inf(b));
    let upper = outline.iter().fold(outline[0], |a, b| a.sup(b));
    // A hair less than the quotient, so that a side that divides the bounds exactly adds no empty row.
    let counts = ((upper - lower) / side).map(|n| (n - 1e-9).ceil().max(1.0));
    refuse_too_many(counts.x * counts.y, key)?;
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
    Ok(Points {
        positions,
        sides: [side; 2],
        area: Some(area),
    })
}

/// Two edges of a closed polygon that touch where they should not, if there are any.
fn crossing_edges(vertices: &[[f64; 2]]) -> Option<[usize; 2]> {
    let n = vertices.len();
    let at = |i: usize| Vec2::from(vertices[i % n]);
    for i in 0..n {
        if at(i) == at(i + 1) {
            return Some([i, (i + 1) % n]);
        }
        for j in i + 1..n {
            let next = j == i + 1;
            let previous = (j + 1) % n == i;
            let touch = if next || previous {
                // Neighbours share a vertex; they must not lie on top of each other.
                let (a, b, c) = if next {
                    (at(i), at(j), at(j + 1))
                } else {
                    (at(j), at(i), at(i + 1))
                };
                (b - a).perp(&(c - b)) == 0.0 && (b - a).dot(&(c - b)) < 0.0
            } else {
                segments_touch(at(i), at(i + 1), at(j), at(j + 1))
            };
            if touch {
                return Some([i, j]);
            }
        }
    }
    None
}

fn segments_touch(a: Vec2, b: Vec2, c: Vec2, d: Vec2) -> bool {
    let side = |p: Vec2, q: Vec2, r: Vec2| (q - p).perp(&(r - p));
    let within = |p: Vec2, q: Vec2, r: Vec2| {
        let (low, high) = (p.inf(&q), p.sup(&q));
        r.x >= low.x && r.x <= high.x && r.y >= low.y && r.y <= high.y
    };
    let (s1, s2) = (side(a, b, c), side(a, b, d));
    let (s3, s4) = (side(c, d, a), side(c, d, b));
    (s1 * s2 < 0.0 && s3 * s4 < 0.0)
        || (s1 == 0.0 && within(a, b, c))
        || (s2 == 0.0 && within(a, b, d))
        || (s3 == 0.0 && within(c, d, a))
        || (s4 == 0.0 && within(c, d, b))
}

/// Refuses groups whose boxes lie on top of one another by more than half a side.
///
/// # Errors
/// A [`Refusal`] that names both groups.
pub fn refuse_overlap(groups: &[GroupConfig], points: &[Points]) -> Result<(), Refusal> {
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
fn bounds(points: &Points) -> [Vec2; 2] {
    let half = 0.5 * Vec2::from(points.sides);
    let all = points.positions.iter().map(|&p| Vec2::from(p));
    all.fold(
        [Vec2::repeat(f64::INFINITY), Vec2::repeat(f64::NEG_INFINITY)],
        |[low, high], p| [low.inf(&(p - half)), high.sup(&(p + half))],
    )
}
