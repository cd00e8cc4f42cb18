//! Values over what was varied: a panel a value, a curve a combination of what else was varied.

use std::path::Path;

use super::area::{Area, Plan};
use super::axis::{Axis, Scale};
use super::canvas::{Canvas, Place, Stroke};
use super::file;
use super::legend::{Legend, Sample};
use super::style::{MARGIN, colour, heading, heading_height, marker, write_heading};
use crate::StudyError;

/// Width of what is within the axes of a panel in pixels, and its height.
const SIZE: (f64, f64) = (440.0, 260.0);
/// Panels in a row.
const COLUMNS: usize = 2;
/// Positive numbers of at least this ratio lie along a logarithmic axis.
const MANY_X: f64 = 8.0;
const MANY_Y: f64 = 100.0;

/// What the panels have in common.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    /// Above.
    pub title: String,
    /// What the numbers 0, 1, 2, ... along x stand for, where they are no numbers of their own.
    pub names: Option<Vec<String>>,
    /// What the legend says, by curve.
    pub curves: Vec<String>,
    /// Whether a line joins the points of a curve.
    pub lines: bool,
}

/// A value.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// Below.
    pub x: String,
    /// Beside.
    pub y: String,
    /// By curve; what is not finite is left out.
    pub points: Vec<Vec<(f64, f64)>>,
}

/// Draws the figure to `path`.
///
/// # Errors
/// [`StudyError::Figure`] and [`StudyError::File`].
pub fn draw(path: &Path, layout: &Layout, panels: &[Panel]) -> Result<(), StudyError> {
    file::write(path, &sheet(layout, panels))
}

fn sheet(layout: &Layout, panels: &[Panel]) -> Canvas {
    let plans: Vec<Plan> = panels.iter().map(|panel| plan(layout, panel)).collect();
    let columns = COLUMNS.min(plans.len().max(1));
    let wide = |column: usize| -> f64 {
        let widths = plans
            .iter()
            .skip(column)
            .step_by(columns)
            .map(|plan| plan.outer().0);
        widths.fold(0.0, f64::max)
    };
    let high = |row: usize| -> f64 {
        let heights = plans
            .iter()
            .skip(row * columns)
            .take(columns)
            .map(|plan| plan.outer().1);
        heights.fold(0.0, f64::max)
    };
    let width = (0..columns).map(wide).sum::<f64>().max(SIZE.0);
    let height: f64 = (0..plans.len().div_ceil(columns)).map(high).sum();
    // A single curve without a name needs no legend.
    let named = layout
        .curves
        .iter()
        .filter(|name| !name.is_empty())
        .enumerate();
    let entries = named.map(|(k, name)| (Sample::Marked(stroke(k), k), name.clone()));
    let legend = Legend::new(&entries.collect::<Vec<_>>(), width - 2.0 * MARGIN);
    let title = heading(&layout.title, width);
    let top = heading_height(&title);
    let mut canvas = Canvas::new(width, top + height + legend.height() + MARGIN);
    write_heading(&mut canvas, &title, 0.0);
    for (k, (plan, panel)) in plans.iter().zip(panels).enumerate() {
        let (column, row) = (k % columns, k / columns);
        let left = (0..column).map(wide).sum();
        let area = plan.draw(&mut canvas, (left, top + (0..row).map(high).sum::<f64>()));
        for (c, points) in panel.points.iter().enumerate() {
            put(&mut canvas, &area, points, c, layout.lines);
        }
    }
    legend.draw(&mut canvas, (MARGIN, top + height));
    canvas
}

fn stroke(curve: usize) -> Stroke {
    Stroke::of(colour(curve), 2.0)
}

fn plan(layout: &Layout, panel: &Panel) -> Plan {
    let all = || {
        panel
            .points
            .iter()
            .flatten()
            .filter(|p| p.0.is_finite() && p.1.is_finite())
    };
    let y = Axis::around(
        all().map(|p| p.1),
        scale(all().map(|p| p.1), MANY_Y),
        [None; 2],
    );
    if let Some(names) = &layout.names {
        let x = Axis::over([-0.5, names.len() as f64 - 0.5], Scale::Linear);
        return Plan::with_names(SIZE, [x, y], [&panel.x, &panel.y], names);
    }
    let x = Axis::around(
        all().map(|p| p.0),
        scale(all().map(|p| p.0), MANY_X),
        [None; 2],
    );
    Plan::new(SIZE, [x, y], [&panel.x, &panel.y])
}

fn scale(numbers: impl Iterator<Item = f64>, many: f64) -> Scale {
    let none = (f64::INFINITY, f64::NEG_INFINITY);
    let (low, high) = numbers.fold(none, |(low, high), n| (low.min(n), high.max(n)));
    if low > 0.0 && high >= many * low {
        Scale::Log
    } else {
        Scale::Linear
    }
}

fn put(canvas: &mut Canvas, area: &Area, points: &[(f64, f64)], curve: usize, lines: bool) {
    let drawn = points.iter().filter(|p| area.has(**p));
    let places: Vec<Place> = drawn.map(|p| area.place(*p)).collect();
    if lines {
        canvas.line(&places, stroke(curve));
    }
    for at in places {
        marker(canvas, at, curve);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_words_overlap_with_numbers_or_names_along_x() {
        let long =
            "angle of repose of the heap that the hopper leaves, measured from its toe to its top";
        let names = [
            "linear",
            "ugimp",
            "quadratic_bspline",
            "cubic_bspline",
            "{ blend = { pic_fraction = 0.01 } }",
        ];
        for names in [None, Some(names.map(String::from).to_vec())] {
            let points = |k: usize| {
                (0..5)
                    .map(|n| (f64::from(n), 10f64.powi(n) * k as f64))
                    .collect()
            };
            let layout = Layout {
                title: long.into(),
                names,
                lines: true,
                curves: vec![long.into(), "b".into()],
            };
            for count in [1, 2, 5] {
                let panel = Panel {
                    x: format!("mpm.points.0.spacing.per_cell, {long}"),
                    y: long.into(),
                    points: vec![points(1), points(0)],
                };
                let canvas = sheet(&layout, &vec![panel; count]);
                assert_eq!(canvas.collisions(), Vec::<String>::new());
            }
        }
    }

    #[test]
    fn numbers_of_many_sizes_lie_along_a_logarithmic_axis() {
        let of = |numbers: &[f64]| scale(numbers.iter().copied(), 8.0);
        assert_eq!(of(&[1.0, 2.0, 4.0]), Scale::Linear);
        assert_eq!(of(&[1.0, 2.0, 8.0]), Scale::Log);
        assert_eq!(of(&[0.0, 2.0, 80.0]), Scale::Linear);
        assert_eq!(of(&[]), Scale::Linear);
    }
}
