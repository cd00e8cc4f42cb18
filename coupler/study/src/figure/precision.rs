//! The work-precision figure: error against time, a curve a method.

use std::path::Path;

use plotters::coord::Shift;
use plotters::prelude::{
    Circle, Color, DrawingArea, DrawingBackend, EmptyElement, PathElement, Rectangle,
    TriangleMarker,
};
use plotters::style::RGBColor;

use super::{around, axis, chart, colour, failed, lines, sheet, write};
use crate::StudyError;

/// Width of a panel in pixels, and its height.
const PANEL: (i32, i32) = (560, 420);
/// Height of the title.
const TITLE: i32 = 34;

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
    let below = TITLE + PANEL.1 + 8;
    let legend = lines(curves.len().div_ceil(2));
    let height = below + legend + lines(2);
    let left = |panel: usize| if panel == 0 { 0 } else { PANEL.0 };
    sheet(path, (2 * PANEL.0 as u32, height as u32), |area| {
        write(area, title, 22, (14, 8))?;
        for (k, panel) in panels.iter().enumerate() {
            let part = area
                .clone()
                .shrink((left(k), TITLE), (PANEL.0 as u32, PANEL.1 as u32));
            draw_panel(&part, panel, curves, k)?;
        }
        for (k, curve) in curves.iter().enumerate() {
            let at = (20 + left(k % 2), below + lines(k / 2));
            let line = PathElement::new(vec![at, (at.0 + 30, at.1)], colour(k).stroke_width(2));
            area.draw(&line).map_err(failed)?;
            mark(area, (at.0 + 15, at.1), k)?;
            write(area, &curve.label, 15, (at.0 + 40, at.1 - 7))?;
        }
        write(area, note, 14, (20, below + legend))
    })
}

fn draw_panel<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    panel: &Panel,
    curves: &[Curve],
    k: usize,
) -> Result<(), StudyError> {
    let all = || curves.iter().flat_map(|curve| &curve.points[k]);
    let (x, y) = (around(all().map(|p| p.0)), around(all().map(|p| p.1)));
    let mut chart = chart(area, [axis(&x), axis(&y)], [&panel.x, &panel.y])?;
    for (c, curve) in curves.iter().enumerate() {
        // What has no logarithm has no place here; the table has it.
        let drawn = || curve.points[k].iter().filter(|p| p.0 > 0.0 && p.1 > 0.0);
        let line: Vec<(f64, f64)> = drawn().map(|p| (p.0, p.1)).collect();
        let style = colour(c).stroke_width(2);
        chart
            .draw_series([PathElement::new(line, style)])
            .map_err(|e| failed(e.to_string()))?;
        for &(time, error, front) in drawn() {
            let at = chart.backend_coord(&(time, error));
            let at = (
                at.0 - area.get_base_pixel().0,
                at.1 - area.get_base_pixel().1,
            );
            mark(area, at, c)?;
            if front {
                let ring = EmptyElement::at(at)
                    + Circle::new((0, 0), 9, RGBColor(0, 0, 0).stroke_width(1));
                area.draw(&ring).map_err(|e| failed(e.to_string()))?;
            }
        }
    }
    Ok(())
}

/// The marker of the `k`-th curve.
fn mark<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    at: (i32, i32),
    k: usize,
) -> Result<(), StudyError> {
    let style = colour(k).filled();
    let drawn = match k % 3 {
        0 => area.draw(&Circle::new(at, 4, style)),
        1 => area.draw(&Rectangle::new(
            [(at.0 - 4, at.1 - 4), (at.0 + 4, at.1 + 4)],
            style,
        )),
        _ => area.draw(&TriangleMarker::new(at, 6, style)),
    };
    drawn.map_err(|e| failed(e.to_string()))
}
