//! Boundary chains: makes the markers of the configuration from a group's outline or a list of positions.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use interface::config::{Chain, Fill, GroupConfig, Interface, polygon};

use super::problems::Problems;
use super::written::{ChainWritten, MpmWritten};

/// The chains of a scene whose bodies are in contact with segments; empty if they are in contact with points.
pub(super) fn chains(
    problems: &mut Problems,
    written: &MpmWritten,
    groups: &[GroupConfig],
) -> Vec<Chain> {
    let names = written.chain.iter().map(|chain| chain.name.as_str());
    problems.names("mpm.chain", "chains", names);
    let names = written.points.iter().map(|group| group.name.as_str());
    let known: BTreeMap<&str, usize> = names.clone().zip(0..).collect();
    let chains = written.chain.iter().enumerate().map(|(i, chain)| {
        let path = format!("mpm.chain.{i}");
        let found = known.get(chain.points.as_str()).copied();
        if found.is_none() {
            let message = format!("no group of points \"{}\"", chain.points);
            let what = [chain.points.as_str(), "groups of this scene"];
            problems.refuse_unknown(&format!("{path}.points"), &message, what, names.clone());
        }
        let group = found.unwrap_or(0);
        let (markers, closed) = match groups.get(group) {
            Some(of) => markers(problems, &path, chain, (of, written.scheme.cell)),
            None => (Vec::new(), false),
        };
        Chain {
            group,
            markers,
            closed,
            floor: chain.floor,
        }
    });
    let chains: Vec<Chain> = chains.collect();
    // Chains are ignored, so that the same scene can run with either interface.
    if written.scheme.interface == Interface::Points {
        Vec::new()
    } else {
        chains
    }
}

/// Largest number of markers in a chain: a hundred times what can be computed in an hour.
const MARKERS_LIMIT: usize = 1_000_000;
const COARSER: &str = "a chain as fine as the cells shows what the grid can";

/// The positions of the markers in m, and whether a segment goes from the last to the first.
fn markers(
    problems: &mut Problems,
    path: &str,
    chain: &ChainWritten,
    (group, cell): (&GroupConfig, f64),
) -> (Vec<[f64; 2]>, bool) {
    let mut refuse = |key: &str, what: String, help: &str| {
        problems.refuse(&format!("{path}.{key}"), what, help.to_owned());
        (Vec::new(), false)
    };
    if let Some(through) = &chain.through {
        if chain.spacing.is_some() || chain.shift.is_some() {
            let what = "`through` has the markers themselves".to_owned();
            return refuse("through", what, "leave out `spacing` and `shift`");
        }
        return (through.clone(), chain.closed);
    }
    let Some(spacing) = chain.spacing.filter(|s| *s > 0.0 && s.is_finite()) else {
        let what = "the distance of the markers, above 0, is missing".to_owned();
        return refuse(
            "spacing",
            what,
            "write `spacing`, or the markers themselves as `through`",
        );
    };
    let shift = chain.shift.unwrap_or_else(|| group.radius(cell));
    let polygon = match &group.fill {
        Fill::Disc { center, radius } => {
            let r = radius - shift;
            if !(r > 0.0 && shift.is_finite()) {
                let what = format!("the circle shrinks to a radius of {r} m");
                return refuse("shift", what, "");
            }
            if parts(TAU * r, spacing) > MARKERS_LIMIT {
                return refuse("spacing", too_many(spacing), COARSER);
            }
            return (circle(*center, r, spacing), true);
        }
        Fill::Rectangle { lower, upper } => {
            vec![*lower, [upper[0], lower[1]], *upper, [lower[0], upper[1]]]
        }
        Fill::Polygon { vertices } => polygon::counter_clockwise(vertices.clone()),
        Fill::Ring { .. } => {
            let what = "a ring has two outlines".to_owned();
            return refuse("points", what, "write a chain for each, with `through`");
        }
        Fill::Points { .. } => {
            let what = "points that are given by their positions have no outline".to_owned();
            return refuse("points", what, "write the markers as `through`");
        }
    };
    match shrunk(&polygon, shift) {
        Some(outline) if parts(polygon::perimeter(&outline), spacing) > MARKERS_LIMIT => {
            refuse("spacing", too_many(spacing), COARSER)
        }
        Some(outline) => (cut(&outline, spacing), true),
        None => refuse(
            "shift",
            format!("an edge vanishes when all edges are moved inward by {shift} m"),
            "",
        ),
    }
}

fn too_many(spacing: f64) -> String {
    format!("markers {spacing} m apart are more than {MARKERS_LIMIT}")
}

fn circle(center: [f64; 2], radius: f64, spacing: f64) -> Vec<[f64; 2]> {
    let count = parts(TAU * radius, spacing).max(3);
    let at = |k: usize| {
        let (sin, cos) = (TAU * k as f64 / count as f64).sin_cos();
        [center[0] + radius * cos, center[1] + radius * sin]
    };
    (0..count).map(at).collect()
}

/// Number of parts of at most `spacing` into which a length is divided. Rounding must not add a part.
fn parts(length: f64, spacing: f64) -> usize {
    ((length / spacing - 1e-9).ceil() as usize).max(1)
}

/// The outline with every edge moved inwards by `shift`; `None` if an edge vanishes or reverses.
fn shrunk(outline: &[[f64; 2]], shift: f64) -> Option<Vec<[f64; 2]>> {
    let n = outline.len();
    let along = |i: usize, of: &[[f64; 2]]| {
        let (a, b) = (of[i % n], of[(i + 1) % n]);
        [b[0] - a[0], b[1] - a[1]]
    };
    let inward = |i: usize| {
        let [x, y] = along(i, outline);
        let length = x.hypot(y);
        [-y / length, x / length]
    };
    let moved: Vec<[f64; 2]> = (0..n)
        .map(|i| {
            let ([ax, ay], [bx, by]) = (inward((i + n - 1) % n), inward(i));
            let share = shift / (1.0 + ax * bx + ay * by);
            [
                outline[i][0] + share * (ax + bx),
                outline[i][1] + share * (ay + by),
            ]
        })
        .collect();
    let keeps = |i: usize| {
        let (was, is) = (along(i, outline), along(i, &moved));
        was[0] * is[0] + was[1] * is[1] > 0.0
    };
    (0..n).all(keeps).then_some(moved)
}

/// The outline with its edges cut into parts of at most `spacing`, each edge into equal ones.
fn cut(outline: &[[f64; 2]], spacing: f64) -> Vec<[f64; 2]> {
    let n = outline.len();
    let edge = |i: usize| {
        let (a, b) = (outline[i], outline[(i + 1) % n]);
        let count = parts((b[0] - a[0]).hypot(b[1] - a[1]), spacing);
        (0..count).map(move |k| {
            let t = k as f64 / count as f64;
            [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]
        })
    };
    (0..n).flat_map(edge).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outlines_are_moved_in_and_cut_evenly() {
        let l = [
            [0.0, 0.0],
            [4.0, 0.0],
            [4.0, 1.0],
            [1.0, 1.0],
            [1.0, 3.0],
            [0.0, 3.0],
        ];
        let inner = shrunk(&l, 0.1).expect("it keeps its edges");
        let expected = [
            [0.1, 0.1],
            [3.9, 0.1],
            [3.9, 0.9],
            [0.9, 0.9],
            [0.9, 2.9],
            [0.1, 2.9],
        ];
        for (a, b) in inner.iter().zip(&expected) {
            assert!(
                (a[0] - b[0]).abs() < 1e-12 && (a[1] - b[1]).abs() < 1e-12,
                "{a:?} {b:?}"
            );
        }
        assert_eq!(shrunk(&l, 0.6), None, "the arms are 1 m wide");
        let turned: Vec<[f64; 2]> = l.into_iter().rev().collect();
        assert_eq!(polygon::counter_clockwise(turned), l.to_vec());
        let square = cut(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]], 0.25);
        assert_eq!((square.len(), square[5]), (16, [1.0, 0.25]));
        assert_eq!(parts(1.0, 0.3), 4);
        let round = circle([1.0, 2.0], 0.5, 0.1);
        assert_eq!(round.len(), 32);
        assert!(
            round
                .iter()
                .all(|x| ((x[0] - 1.0).hypot(x[1] - 2.0) - 0.5).abs() < 1e-12)
        );
    }
}
