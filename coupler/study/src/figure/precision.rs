//! The work-precision figure: error against time, a curve a method.

use std::path::Path;

use super::area::{Area, Plan};
use super::axis::{Axis, Scale};
use super::canvas::{Anchor, BLACK, Canvas, Paint, Place, Stroke};
use super::file;
use super::legend::{Legend, Sample};
use super::style::{LINE, MARGIN, WORDS, colour, heading, heading_height, marker, write_heading};
use super::text::wrapped;
use crate::StudyError;

/// Width of what is within the axes of a panel in pixels, and its height.
const SIZE: (f64, f64) = (440.0, 350.0);

/// A curve of each panel.
#[derive(Debug, Clone)]
pub struct Curve {
    /// What the legend says.
    pub label: String,
    /// By panel: time in s, error, and whether the point is on the Pareto front.
    pub points: [Vec<(f64, f64, bool)>; 2],
}

/// What the axes of a panel say.
#[derive(Debug, Clone)]
pub struct Panel {
    /// Below.
    pub x: String,
    /// Beside.
    pub y: String,
}

/// Draws the figure to `path`.
///
/// # Errors
/// [`StudyError::Figure`] and [`StudyError::File`].
pub fn draw(
    path: &Path,
    title: &str,
    panels: &[Panel; 2],
    curves: &[Curve],
    note: &str,
) -> Result<(), StudyError> {
    file::write(path, &sheet(title, panels, curves, note))
}

fn sheet(title: &str, panels: &[Panel; 2], curves: &[Curve], note: &str) -> Canvas {
    let plans = [0, 1].map(|k| {
        let all = || curves.iter().flat_map(|curve| &curve.points[k]);
        let axes = [
            Axis::around(all().map(|p| p.0), Scale::Log, [None; 2]),
            Axis::around(all().map(|p| p.1), Scale::Log, [None; 2]),
        ];
        Plan::new(SIZE, axes, [&panels[k].x, &panels[k].y])
    });
    let outer = [plans[0].outer(), plans[1].outer()];
    let width = outer[0].0 + outer[1].0;
    let height = outer[0].1.max(outer[1].1);
    let line = |k| Stroke::of(colour(k), 2.0);
    let entries = curves
        .iter()
        .enumerate()
        .map(|(k, curve)| (Sample::Marked(line(k), k), curve.label.clone()));
    let legend = Legend::new(&entries.collect::<Vec<_>>(), width - 2.0 * MARGIN);
    let title = heading(title, width);
    let note = wrapped(note, WORDS, width - 2.0 * MARGIN);
    let top = heading_height(&title);
    let below = top + height + legend.height();
    let mut canvas = Canvas::new(width, below + note.len() as f64 * LINE + MARGIN);
    write_heading(&mut canvas, &title, 0.0);
    for (k, left) in [0.0, outer[0].0].into_iter().enumerate() {
        let area = plans[k].draw(&mut canvas, (left, top));
        for (c, curve) in curves.iter().enumerate() {
            put(&mut canvas, &area, &curve.points[k], c);
        }
    }
    legend.draw(&mut canvas, (MARGIN, top + height));
    for (k, line) in (0..).zip(&note) {
        let y = below + (f64::from(k) + 0.5) * LINE;
        canvas.text(line, WORDS, (MARGIN, y), Anchor::Start);
    }
    canvas
}

fn put(canvas: &mut Canvas, area: &Area, points: &[(f64, f64, bool)], curve: usize) {
    // What has no logarithm has no place here; the table has it.
    let drawn = points.iter().filter(|p| area.has((p.0, p.1)));
    let places: Vec<(Place, bool)> = drawn.map(|p| (area.place((p.0, p.1)), p.2)).collect();
    let line: Vec<Place> = places.iter().map(|p| p.0).collect();
    canvas.line(&line, Stroke::of(colour(curve), 2.0));
    for (at, front) in places {
        marker(canvas, at, curve);
        if front {
            canvas.circle(at, 9.0, Paint::Outlined(Stroke::of(BLACK, 1.0)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_words_overlap_and_every_run_has_a_place() {
        let long = "error of \"the share of energy that a collision hands over to the bar\", of the reference";
        let curve = |k: usize| Curve {
            label: format!("transfer flip, shape number {k}: order 1.98"),
            points: [0, 1].map(|_| {
                vec![
                    (0.02, 3e-3, true),
                    (0.021, 2.9e-3, false),
                    (0.0, 1e-3, false),
                ]
            }),
        };
        let panel = |x: &str| Panel {
            x: x.into(),
            y: long.into(),
        };
        for count in [0, 1, 8] {
            let curves: Vec<Curve> = (0..count).map(curve).collect();
            let panels = [
                panel("CPU time of stepping in s"),
                panel("wall time of stepping in s"),
            ];
            let canvas = sheet(long, &panels, &curves, "ring: Pareto front");
            assert_eq!(canvas.collisions(), Vec::<String>::new());
            // Two panels of two places each, one of them with a ring: that without a time has none.
            let discs = canvas.svg().matches("<circle").count();
            let rings = canvas.svg().matches("r=\"9\"").count();
            assert_eq!(rings, 2 * count);
            assert!(discs >= rings);
        }
    }
}
