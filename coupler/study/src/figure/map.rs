//! The map of stability: which runs were stable, the measured edge, and what criteria allow.

use std::path::Path;

use super::area::Plan;
use super::axis::{Axis, Scale};
use super::canvas::{Anchor, Canvas, Colour, Paint, Place, Stroke};
use super::file;
use super::legend::{Legend, Sample};
use super::style::{LINE, MARGIN, WORDS, colour, heading, heading_height, write_heading};
use crate::StudyError;

/// Width of what is within the axes of a map in pixels, and its height.
const SIZE: (f64, f64) = (650.0, 350.0);
/// Width of the first line in pixels, and how much wider each of the others is: where they lie on one another, the lower ones
/// show beside the upper ones.
const WIDTH: f64 = 2.0;
const WIDER: f64 = 2.2;

/// A map.
#[derive(Debug, Clone)]
pub struct Map {
    /// Above.
    pub title: String,
    /// Below.
    pub x: String,
    /// Beside.
    pub y: String,
    /// Place of each run and whether it was stable.
    pub runs: Vec<(f64, f64, bool)>,
    /// Named lines; the first is the measured edge.
    pub lines: Vec<(String, Vec<(f64, f64)>)>,
}

/// Draws maps below one another.
///
/// # Errors
/// [`StudyError::Figure`] and [`StudyError::File`].
pub fn draw(path: &Path, maps: &[Map]) -> Result<(), StudyError> {
    file::write(path, &sheet(maps))
}

fn sheet(maps: &[Map]) -> Canvas {
    let plans: Vec<Plan> = maps.iter().map(plan).collect();
    let width = plans
        .iter()
        .map(|plan| plan.outer().0)
        .fold(0.0, f64::max)
        .max(SIZE.0);
    let parts: Vec<(Vec<String>, Legend)> = maps
        .iter()
        .map(|map| {
            let entries = map.lines.iter().enumerate();
            let entries = entries.map(|(k, (name, _))| (Sample::Line(stroke(k)), name.clone()));
            let legend = Legend::new(&entries.collect::<Vec<_>>(), width - 2.0 * MARGIN);
            (heading(&map.title, width), legend)
        })
        .collect();
    let height = |plan: &Plan, (title, legend): &(Vec<String>, Legend)| {
        heading_height(title) + plan.outer().1 + legend.height() + LINE + MARGIN
    };
    let total: f64 = plans
        .iter()
        .zip(&parts)
        .map(|(plan, part)| height(plan, part))
        .sum();
    let mut canvas = Canvas::new(width, total.max(1.0));
    let mut top = 0.0;
    for ((map, plan), part) in maps.iter().zip(&plans).zip(&parts) {
        let (title, legend) = part;
        write_heading(&mut canvas, title, top);
        let below = top + heading_height(title);
        put(&mut canvas, map, plan, below);
        let below = below + plan.outer().1;
        legend.draw(&mut canvas, (MARGIN, below));
        let note = (MARGIN, below + legend.height() + 0.5 * LINE);
        canvas.text("full: stable, open: unstable", WORDS, note, Anchor::Start);
        top += height(plan, part);
    }
    canvas
}

fn plan(map: &Map) -> Plan {
    let drawn = || map.lines.iter().flat_map(|(_, points)| points);
    let x = map.runs.iter().map(|p| p.0).chain(drawn().map(|p| p.0));
    let y = map.runs.iter().map(|p| p.1).chain(drawn().map(|p| p.1));
    let axes = [
        Axis::around(x, Scale::Log, [None; 2]),
        Axis::around(y, Scale::Log, [None; 2]),
    ];
    Plan::new(SIZE, axes, [&map.x, &map.y])
}

/// The first line is drawn last and thinnest, so that none hides another that it lies on.
fn stroke(k: usize) -> Stroke {
    Stroke::of(colour(k), WIDTH + WIDER * k as f64)
}

fn put(canvas: &mut Canvas, map: &Map, plan: &Plan, top: f64) {
    let area = plan.draw(canvas, (0.0, top));
    let (stable, unstable) = (Colour(90, 90, 90), Colour(150, 150, 150));
    for (k, (_, points)) in map.lines.iter().enumerate().rev() {
        let places: Vec<Place> = points
            .iter()
            .filter(|p| area.has(**p))
            .map(|p| area.place(*p))
            .collect();
        canvas.line(&places, stroke(k));
    }
    for &(x, y, is_stable) in map.runs.iter().filter(|run| area.has((run.0, run.1))) {
        let paint = if is_stable {
            Paint::Filled(stable)
        } else {
            Paint::Outlined(Stroke::of(unstable, 1.0))
        };
        canvas.circle(area.place((x, y)), 4.0, paint);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_words_overlap_and_a_line_under_another_can_be_seen() {
        let line = vec![(1e3, 0.9), (1e6, 1.4)];
        let map = Map {
            title: "jiang2020/collision_hard, quick".into(),
            x: "contact.linear.normal_stiffness in N/m".into(),
            y: "step / composed step".into(),
            runs: vec![(1e3, 1.0, true), (1e6, 1.9, false)],
            lines: [
                "measured edge",
                "composed",
                "Jiang 2020 eq. 51",
                "eq. 51 with the mass of the lightest point",
            ]
            .map(|name| (name.to_owned(), line.clone()))
            .to_vec(),
        };
        let canvas = sheet(&[map.clone(), map.clone()]);
        assert_eq!(canvas.collisions(), Vec::<String>::new());
        let widths: Vec<f64> = (0..4).map(|k| stroke(k).width).collect();
        assert!(
            widths.windows(2).all(|pair| pair[1] >= pair[0] + 2.0),
            "{widths:?}"
        );
    }
}
