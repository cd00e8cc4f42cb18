//! The map of stability: which runs were stable, the measured edge, and what criteria allow.

use std::path::Path;

use plotters::coord::Shift;
use plotters::prelude::{Circle, Color, DrawingArea, DrawingBackend, PathElement};
use plotters::style::RGBColor;

use super::{LINE, around, axis, chart, colour, failed, lines, sheet, write};
use crate::StudyError;

/// Width of a map in pixels, and its height.
const MAP: (i32, i32) = (760, 420);
/// Height of the title.
const TITLE: i32 = 34;

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
    let height = |map: &Map| TITLE + MAP.1 + lines(map.lines.len() + 2);
    let total: i32 = maps.iter().map(height).sum();
    sheet(path, (MAP.0 as u32, total.max(1) as u32), |area| {
        let mut top = 0;
        for map in maps {
            write(area, &map.title, 22, (14, top + 8))?;
            let part = area
                .clone()
                .shrink((0, top + TITLE), (MAP.0 as u32, MAP.1 as u32));
            draw_map(&part, map)?;
            let mut line = top + TITLE + MAP.1 + 8;
            for (k, (name, _)) in map.lines.iter().enumerate() {
                let stroke = vec![(20, line), (50, line)];
                area.draw(&PathElement::new(stroke, colour(k).stroke_width(2)))
                    .map_err(failed)?;
                write(area, name, 15, (60, line - 7))?;
                line += LINE;
            }
            write(area, "full: stable, open: unstable", 14, (20, line - 7))?;
            top += height(map);
        }
        Ok(())
    })
}

fn draw_map<B: DrawingBackend>(area: &DrawingArea<B, Shift>, map: &Map) -> Result<(), StudyError> {
    let drawn = || map.lines.iter().flat_map(|(_, points)| points);
    let x = around(map.runs.iter().map(|p| p.0).chain(drawn().map(|p| p.0)));
    let y = around(map.runs.iter().map(|p| p.1).chain(drawn().map(|p| p.1)));
    let mut chart = chart(area, [axis(&x), axis(&y)], [&map.x, &map.y])?;
    let (stable, unstable) = (RGBColor(90, 90, 90), RGBColor(150, 150, 150));
    let dots = map.runs.iter().map(|&(x, y, is_stable)| {
        let style = if is_stable {
            stable.filled()
        } else {
            unstable.stroke_width(1)
        };
        Circle::new((x, y), 4, style)
    });
    chart.draw_series(dots).map_err(|e| failed(e.to_string()))?;
    for (k, (_, points)) in map.lines.iter().enumerate() {
        let line = PathElement::new(points.clone(), colour(k).stroke_width(2));
        chart
            .draw_series([line])
            .map_err(|e| failed(e.to_string()))?;
    }
    Ok(())
}
