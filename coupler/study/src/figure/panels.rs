//! Pictures of instants side by side: points as squares of their size, coloured by a number, and outlines of bodies.
//!
//! Tens of thousands of points would make an SVG of megabytes, so the points of a panel are one small bitmap in it; axes,
//! outlines and words stay lines and letters.

use std::ops::Range;
use std::path::Path;

use plotters::element::{Drawable, PathElement, PointCollection, Polygon};
use plotters::prelude::{Color, Rectangle};
use plotters::style::RGBColor;
use plotters_backend::{BackendCoord, DrawingBackend, DrawingErrorKind};

use super::curves::Linear;
use super::{chart, failed, sheet, write};
use crate::StudyError;

/// Width in pixels of what the panels of a row have together, without axes.
const ROW: i32 = 700;
/// Room left of and below the axes of a panel, and around it, as [`chart`] leaves it.
const BESIDE: i32 = 74;
const BELOW: i32 = 48;
const AROUND: i32 = 12;
/// Height of the title, of a panel's caption and of the colours with their numbers.
const TITLE: i32 = 34;
const CAPTION: i32 = 20;
const COLOURS: i32 = 64;
/// Side of the smallest square of a point, in pixels.
const LEAST: usize = 2;
/// Colours that are told apart.
const STEPS: u8 = 32;
/// Viridis (van der Walt and Smith 2015), which grows evenly lighter, at eighths.
const VIRIDIS: [[u8; 3]; 9] = [
    [68, 1, 84],
    [71, 44, 122],
    [59, 81, 139],
    [44, 113, 142],
    [33, 144, 141],
    [39, 173, 129],
    [92, 200, 99],
    [170, 220, 50],
    [253, 231, 37],
];

/// A point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dot {
    /// In m.
    pub at: [f64; 2],
    /// Side of its square in m.
    pub side: f64,
    /// What its colour says.
    pub value: f64,
}

/// A bitmap; plotters has one only together with its bitmap files.
struct Picture {
    /// Upper left corner.
    at: BackendCoord,
    size: (u32, u32),
    /// Red, green and blue of each pixel, row by row from above.
    pixels: Vec<u8>,
}

impl<'a> PointCollection<'a, BackendCoord> for &'a Picture {
    type Point = &'a BackendCoord;
    type IntoIter = std::iter::Once<&'a BackendCoord>;

    fn point_iter(self) -> Self::IntoIter {
        std::iter::once(&self.at)
    }
}

impl<B: DrawingBackend> Drawable<B> for Picture {
    fn draw<I: Iterator<Item = BackendCoord>>(
        &self,
        places: I,
        backend: &mut B,
        _: (u32, u32),
    ) -> Result<(), DrawingErrorKind<B::ErrorType>> {
        let mut places = places;
        places.try_for_each(|at| backend.blit_bitmap(at, self.size, &self.pixels))
    }
}

/// An instant.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// Above it.
    pub caption: String,
    /// The points.
    pub dots: Vec<Dot>,
    /// Outlines of the bodies in m, each of which closes by itself.
    pub outlines: Vec<Vec<[f64; 2]>>,
}

/// How panels are shown.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    /// Above all.
    pub title: String,
    /// What colours say.
    pub legend: String,
    /// Panels in a row.
    pub columns: usize,
    /// Lower left and upper right corner of what is shown, in m.
    pub window: [[f64; 2]; 2],
    /// Values of the first and the last colour.
    pub between: [f64; 2],
}

/// Draws the panels to `path`.
///
/// # Errors
/// [`StudyError::Figure`] and [`StudyError::File`].
pub fn draw(path: &Path, layout: &Layout, panels: &[Panel]) -> Result<(), StudyError> {
    let columns = layout.columns.clamp(1, panels.len().max(1));
    let rows = panels.len().div_ceil(columns);
    let [columns, rows] = [columns, rows].map(|n| i32::try_from(n).expect("no 2^31 panels"));
    let [[left, bottom], [right, top]] = layout.window;
    let inner = ROW / columns;
    let height = (f64::from(inner) * (top - bottom) / (right - left))
        .round()
        .max(1.0) as i32;
    let outer = [
        inner + BESIDE + 2 * AROUND,
        height + BELOW + 2 * AROUND + CAPTION,
    ];
    let below = TITLE + rows * outer[1];
    let size = (columns * outer[0], below + COLOURS);
    sheet(path, (size.0 as u32, size.1 as u32), |area| {
        write(area, &layout.title, 22, (14, 8))?;
        for (k, panel) in (0..).zip(panels) {
            let corner = (k % columns * outer[0], TITLE + k / columns * outer[1]);
            write(
                area,
                &panel.caption,
                15,
                (corner.0 + BESIDE + AROUND, corner.1 + 4),
            )?;
            let part = area.clone().shrink(
                (corner.0, corner.1 + CAPTION),
                (outer[0] as u32, (outer[1] - CAPTION) as u32),
            );
            let axes = [Linear::over(left..right), Linear::over(bottom..top)];
            let mut chart = chart(&part, axes, ["x [m]", "y [m]"])?;
            let picture = Picture {
                at: (corner.0 + BESIDE + AROUND, corner.1 + CAPTION + AROUND),
                size: (inner as u32, height as u32),
                pixels: raster(panel, layout, [inner as usize, height as usize]),
            };
            area.draw(&picture).map_err(failed)?;
            for outline in &panel.outlines {
                let pixel = (right - left) / f64::from(inner);
                let mut outline = clipped(outline, layout.window);
                // Of the vertices of a rounded corner that fall on one pixel, one.
                outline.dedup_by_key(|(x, y)| [*x / pixel, *y / pixel].map(f64::round));
                let Some(&first) = outline.first() else {
                    continue;
                };
                let filled = Polygon::new(outline.clone(), RGBColor(225, 225, 225).filled());
                chart
                    .draw_series([filled])
                    .map_err(|e| failed(e.to_string()))?;
                outline.push(first);
                let line = PathElement::new(outline, RGBColor(0, 0, 0).stroke_width(1));
                chart
                    .draw_series([line])
                    .map_err(|e| failed(e.to_string()))?;
            }
        }
        // The colours and what they say.
        let [from, to] = layout.between;
        let (start, width) = (BESIDE + AROUND, 10);
        for k in 0..STEPS {
            let x = start + width * i32::from(k);
            let [r, g, b] = shade(k);
            let step = Rectangle::new(
                [(x, below), (x + width, below + 14)],
                RGBColor(r, g, b).filled(),
            );
            area.draw(&step).map_err(failed)?;
        }
        let end = start + width * i32::from(STEPS);
        for (share, x) in [(0.0, start), (0.5, i32::midpoint(start, end)), (1.0, end)] {
            let text = super::label(rounded(from + share * (to - from), to - from));
            write(area, &text, 14, (x - 4, below + 20))?;
        }
        write(area, &layout.legend, 15, (end + 24, below))
    })
}

/// A number with the digits that a range of this width needs.
fn rounded(number: f64, width: f64) -> f64 {
    let unit = 10f64.powf(width.abs().max(f64::MIN_POSITIVE).log10().floor() - 2.0);
    (number / unit).round() * unit
}

/// The `k`-th colour.
fn shade(k: u8) -> [u8; 3] {
    let place = f64::from(k) / f64::from(STEPS - 1) * (VIRIDIS.len() - 1) as f64;
    let i = (place as usize).min(VIRIDIS.len() - 2);
    let share = place - i as f64;
    std::array::from_fn(|c| {
        let (a, b) = (f64::from(VIRIDIS[i][c]), f64::from(VIRIDIS[i + 1][c]));
        (a + share * (b - a)).round() as u8
    })
}

/// The points as red, green and blue of each pixel, row by row from above.
fn raster(panel: &Panel, layout: &Layout, [width, height]: [usize; 2]) -> Vec<u8> {
    let mut pixels = vec![255; 3 * width * height];
    let [[left, bottom], [right, top]] = layout.window;
    let [from, to] = layout.between;
    let scale = width as f64 / (right - left);
    for dot in &panel.dots {
        let [x, y] = dot.at;
        if !((left..right).contains(&x) && (bottom..top).contains(&y)) {
            continue;
        }
        // Values beyond the ends have the colours of the ends, as the manual says.
        let share = ((dot.value - from) / (to - from)).clamp(0.0, 1.0);
        let colour = shade((share * f64::from(STEPS - 1)).round() as u8);
        let span = |middle: f64, count: usize| -> Range<usize> {
            let half = 0.5 * scale * dot.side;
            let first = ((middle - half).round().max(0.0) as usize).min(count - 1);
            let last = ((middle + half).round().max(0.0) as usize).min(count);
            first..last.max((first + LEAST).min(count))
        };
        for row in span(scale * (top - y), height) {
            for column in span(scale * (x - left), width) {
                let pixel = 3 * (row * width + column);
                pixels[pixel..pixel + 3].copy_from_slice(&colour);
            }
        }
    }
    pixels
}

/// The part of a polygon that is within the window (Sutherland and Hodgman 1974).
fn clipped(outline: &[[f64; 2]], window: [[f64; 2]; 2]) -> Vec<(f64, f64)> {
    let mut kept = outline.to_vec();
    for (axis, side) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        let bound = window[side][axis];
        let inside = |p: &[f64; 2]| {
            if side == 0 {
                p[axis] >= bound
            } else {
                p[axis] <= bound
            }
        };
        let mut next = Vec::with_capacity(kept.len() + 2);
        for (k, p) in kept.iter().enumerate() {
            let before = kept[(k + kept.len() - 1) % kept.len()];
            if inside(p) != inside(&before) {
                let share = (bound - before[axis]) / (p[axis] - before[axis]);
                let mut cut = std::array::from_fn(|i| before[i] + share * (p[i] - before[i]));
                cut[axis] = bound;
                next.push(cut);
            }
            if inside(p) {
                next.push(*p);
            }
        }
        kept = next;
    }
    kept.into_iter().map(|[x, y]| (x, y)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const WINDOW: [[f64; 2]; 2] = [[0.0, 0.0], [2.0, 1.0]];

    #[test]
    fn what_is_outside_is_cut_off() {
        let square = [[-1.0, 0.5], [1.0, 0.5], [1.0, 3.0], [-1.0, 3.0]];
        let cut = clipped(&square, WINDOW);
        assert_eq!(cut.len(), 4);
        for corner in [(0.0, 0.5), (1.0, 0.5), (1.0, 1.0), (0.0, 1.0)] {
            assert!(cut.contains(&corner), "{cut:?}");
        }
        assert!(clipped(&square.map(|[x, y]| [x, y + 1.0]), WINDOW).is_empty());
        let inside = [[0.1, 0.1], [0.2, 0.1], [0.1, 0.2]];
        assert_eq!(clipped(&inside, WINDOW), inside.map(|[x, y]| (x, y)));
    }

    #[test]
    fn a_point_is_a_square_of_its_size_and_colour() {
        let dot = |at, value| Dot {
            at,
            side: 0.2,
            value,
        };
        let panel = Panel {
            caption: String::new(),
            dots: vec![
                dot([0.5, 0.75], 0.0),
                dot([1.5, 0.25], 9.0),
                dot([3.0, 0.5], 1.0),
            ],
            outlines: Vec::new(),
        };
        let layout = Layout {
            title: String::new(),
            legend: String::new(),
            columns: 1,
            window: WINDOW,
            between: [0.0, 1.0],
        };
        let pixels = raster(&panel, &layout, [200, 100]);
        let colour = |x: usize, y: usize| -> [u8; 3] {
            std::array::from_fn(|c| pixels[3 * (y * 200 + x) + c])
        };
        assert_eq!(colour(50, 25), VIRIDIS[0]);
        assert_eq!(colour(150, 75), VIRIDIS[8]);
        assert_eq!(colour(50, 75), [255; 3]);
        let drawn = pixels.chunks(3).filter(|p| *p != [255; 3]).count();
        assert_eq!(drawn, 2 * 20 * 20);
    }
}
