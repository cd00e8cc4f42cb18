//! Pictures of instants, side by side or one after another: points as squares of their size, coloured by a number, and
//! outlines of bodies.
//!
//! Tens of thousands of points would make an SVG of megabytes, so the points of a panel are one small bitmap in it; axes,
//! outlines and words stay lines and letters.

use std::ops::Range;
use std::path::Path;

use super::area::{Area, NUMBER_GAP, Plan, fitting};
use super::axis::{Axis, Scale, label};
use super::canvas::{Anchor, BLACK, Canvas, Colour, Stroke};
use super::file;
use super::sheet::Sheet;
use super::style::{LINE, MARGIN, NUMBERS, WORDS, colour};
use super::text::{width, wrapped};
use crate::StudyError;

/// Width in pixels of what the panels of a row have together, without axes.
const ROW: f64 = 700.0;
/// Pixels of the picture of points for one of the sheet.
const FINE: f64 = 2.0;
/// Width and height of the colours.
const COLOURS: (f64, f64) = (320.0, 14.0);
/// Side of the smallest square of a point, in pixels of the picture.
const LEAST: usize = 3;
/// Width in pixels of the line of the largest contact force, and of the smallest that is drawn.
const THICKEST: f64 = 6.0;
const FAINTEST: f64 = 0.1;
/// Colour of force lines; distinct from the colours of points and bodies.
const FORCES: usize = 1;
/// Distinct colours.
const STEPS: u8 = 128;
/// Of a point whose value is no number: no colour of Viridis.
const NO_NUMBER: [u8; 3] = [170, 170, 170];
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

/// A contact force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Force {
    /// The centres of the two that touch, in m.
    pub between: [[f64; 2]; 2],
    /// In N/m.
    pub strength: f64,
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
    /// Contact forces, where they are drawn.
    pub forces: Vec<Force>,
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
    /// The force in N/m whose line is the thickest, where forces are drawn.
    pub largest_force: Option<f64>,
}

impl Layout {
    /// What colours and lines say.
    fn words(&self) -> String {
        match self.largest_force {
            Some(force) if force > 0.0 => {
                let force = label(round(force));
                format!(
                    "{}; lines: contact forces, the thickest {force} N/m",
                    self.legend
                )
            }
            Some(_) => format!("{}; no contact presses", self.legend),
            None => self.legend.clone(),
        }
    }
}

/// To three digits.
fn round(number: f64) -> f64 {
    let unit = 10_f64.powf(number.log10().floor() - 2.0);
    (number / unit).round() * unit
}

/// Draws the panels to `path`.
///
/// # Errors
/// [`StudyError::Figure`] and [`StudyError::File`].
pub fn draw(path: &Path, layout: &Layout, panels: &[Panel]) -> Result<(), StudyError> {
    file::write(path, &sheet(layout, panels)?)
}

/// Draws the panels one after another, a film of so many pictures a second.
///
/// # Errors
/// Of [`draw`].
pub fn film(path: &Path, layout: &Layout, panels: &[Panel], rate: f64) -> Result<(), StudyError> {
    let sheets = panels
        .iter()
        .map(|panel| sheet(layout, std::slice::from_ref(panel)));
    let hundredths = (100.0 / rate).round().clamp(1.0, 6e4) as u16;
    file::write_film(path, sheets, hundredths)
}

fn sheet(layout: &Layout, panels: &[Panel]) -> Result<Canvas, StudyError> {
    let columns = layout.columns.max(1);
    let [[left, bottom], [right, top]] = layout.window;
    let inner = (ROW / columns as f64).round();
    let height = (inner * (top - bottom) / (right - left)).round().max(1.0);
    let axes = [[left, right], [bottom, top]].map(|range| Axis::over(range, Scale::Linear));
    // Words stand at the outer panels only.
    let plan = |k: usize| {
        let (lowest, first) = (k + columns >= panels.len(), k.is_multiple_of(columns));
        let words = [
            if lowest { "x [m]" } else { "" },
            if first { "y [m]" } else { "" },
        ];
        Plan::new((inner, height), axes, words)
    };
    let cells = panels.iter().enumerate();
    let cells = cells.map(|(k, panel)| (&*panel.caption, plan(k))).collect();
    let sheet = Sheet::new(&layout.title, cells, columns, COLOURS.0 + 4.0 * MARGIN);
    let legend = wrapped(&layout.words(), WORDS, sheet.width - 4.0 * MARGIN);
    let room = COLOURS.1 + NUMBER_GAP + LINE * (1 + legend.len()) as f64 + 2.0 * MARGIN;
    let (mut canvas, areas, below) = sheet.draw(room);
    for (panel, area) in panels.iter().zip(&areas) {
        fill(&mut canvas, area, panel, layout, (inner, height))?;
    }
    colours(&mut canvas, layout, &legend, (2.0 * MARGIN, below + MARGIN))?;
    Ok(canvas)
}

/// The points and bodies of a panel.
fn fill(
    canvas: &mut Canvas,
    area: &Area,
    panel: &Panel,
    layout: &Layout,
    size: (f64, f64),
) -> Result<(), StudyError> {
    if !panel.dots.is_empty() {
        let pixels = [size.0, size.1].map(|side| (FINE * side) as usize);
        canvas.picture(area.corner(), size, pixels, &raster(panel, layout, pixels))?;
    }
    for outline in &panel.outlines {
        let mut places: Vec<_> = clipped(outline, layout.window)
            .into_iter()
            .map(|p| area.place(p))
            .collect();
        // Of the vertices of a rounded corner that fall on a tenth of a pixel, one.
        places.dedup_by_key(|(x, y)| [10.0 * *x, 10.0 * *y].map(f64::round));
        if places.len() > 2 {
            canvas.polygon(&places, Colour(225, 225, 225), Some(Stroke::of(BLACK, 1.0)));
        }
    }
    area.within(canvas, |canvas| {
        for force in &panel.forces {
            let share = force.strength / layout.largest_force.unwrap_or(force.strength);
            // Thinner lines than this are not seen.
            if share * THICKEST >= FAINTEST {
                let ends = force.between.map(|[x, y]| area.place((x, y)));
                canvas.line(&ends, Stroke::of(colour(FORCES), share * THICKEST));
            }
        }
    });
    Ok(())
}

/// The colours and what they say.
fn colours(
    canvas: &mut Canvas,
    layout: &Layout,
    legend: &[String],
    (left, top): (f64, f64),
) -> Result<(), StudyError> {
    let axis = Axis::over(layout.between, Scale::Linear);
    let ticks = fitting(&axis, COLOURS.0);
    // A long number at the first tick needs room to the left.
    let widths = ticks.iter().map(|&tick| width(&label(tick), NUMBERS));
    let left = left.max(0.5 * widths.fold(0.0, f64::max) + 2.0);
    let shades: Vec<u8> = (0..STEPS).flat_map(shade).collect();
    canvas.picture((left, top), COLOURS, [usize::from(STEPS), 1], &shades)?;
    let below = top + COLOURS.1;
    for tick in ticks {
        let x = left + axis.share(tick) * COLOURS.0;
        canvas.line(
            &[(x, below), (x, below + 0.5 * NUMBER_GAP)],
            Stroke::of(BLACK, 1.0),
        );
        canvas.text(
            &label(tick),
            NUMBERS,
            (x, below + NUMBER_GAP + 0.5 * LINE),
            Anchor::Middle,
        );
    }
    for (k, line) in (0..).zip(legend) {
        let y = below + NUMBER_GAP + LINE * (f64::from(k) + 1.5);
        canvas.text(line, WORDS, (left, y), Anchor::Start);
    }
    Ok(())
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
        let colour = if share.is_nan() {
            NO_NUMBER
        } else {
            shade((share * f64::from(STEPS - 1)).round() as u8)
        };
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

    #[test]
    fn no_words_overlap_and_axes_are_named_once() {
        let long =
            "t = 0.2 s of a run with a name that is longer than its picture is wide, much longer";
        let panel = |caption: &str| Panel {
            caption: caption.into(),
            dots: vec![Dot {
                at: [0.5, 0.5],
                side: 0.1,
                value: 1.0,
            }],
            outlines: vec![vec![[0.1, 0.1], [0.3, 0.1], [0.2, 0.3]]],
            forces: vec![Force {
                between: [[0.2, 0.2], [0.5, 0.5]],
                strength: 3.0,
            }],
        };
        for columns in [1, 2, 3, 5] {
            for between in [[0.0, 1.0], [1.234_567e-7, 1.234_569e-7], [-3e9, 2e12]] {
                let layout = Layout {
                    title: long.repeat(2),
                    legend: format!("a pressure {long}"),
                    columns,
                    window: WINDOW,
                    between,
                    largest_force: Some(3.0),
                };
                let panels: Vec<Panel> = ["short", long, "c", "d", long].map(panel).to_vec();
                let canvas = sheet(&layout, &panels).unwrap();
                assert_eq!(canvas.collisions(), Vec::<String>::new());
                let named = canvas.svg().matches(">x [m]<").count();
                assert_eq!(named, columns);
            }
        }
    }

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
                dot([1.5, 0.75], f64::NAN),
            ],
            outlines: Vec::new(),
            forces: Vec::new(),
        };
        let layout = Layout {
            title: String::new(),
            legend: String::new(),
            columns: 1,
            window: WINDOW,
            between: [0.0, 1.0],
            largest_force: None,
        };
        let pixels = raster(&panel, &layout, [200, 100]);
        let colour = |x: usize, y: usize| -> [u8; 3] {
            std::array::from_fn(|c| pixels[3 * (y * 200 + x) + c])
        };
        assert_eq!(colour(50, 25), VIRIDIS[0]);
        assert_eq!(colour(150, 75), VIRIDIS[8]);
        assert_eq!(colour(50, 75), [255; 3]);
        // It had the colour of the least value.
        assert_eq!(colour(150, 25), NO_NUMBER);
        let drawn = pixels.chunks(3).filter(|p| *p != [255; 3]).count();
        assert_eq!(drawn, 3 * 20 * 20);
    }
}
