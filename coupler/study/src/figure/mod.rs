//! Figures as SVG: axes with units, a legend in words, colours that the colour-blind tell apart.

pub mod curves;
pub mod map;
pub mod panels;
pub mod precision;

use std::ops::Range;
use std::path::Path;

use plotters::coord::Shift;
use plotters::coord::combinators::{BindKeyPoints, WithKeyPoints};
use plotters::coord::ranged1d::{Ranged, ValueFormatter};
use plotters::prelude::{
    Cartesian2d, ChartBuilder, ChartContext, DrawingArea, DrawingBackend, IntoDrawingArea,
    IntoFont, IntoLogRange, LogCoord, RGBColor, SVGBackend, TextStyle,
};

use crate::StudyError;

/// Okabe and Ito's colours, black last.
const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 0, 0),
];
/// Most labels along an axis.
const TICKS: usize = 8;
/// Height of a line of text in pixels.
const LINE: i32 = 20;

/// The colour of the `k`-th curve.
fn colour(k: usize) -> RGBColor {
    COLOURS[k % COLOURS.len()]
}

/// Height of lines of text in pixels.
fn lines(count: usize) -> i32 {
    LINE * i32::try_from(count).expect("a legend has no 2^31 lines")
}

/// A style of plain text of a size in pixels.
fn text(size: u32) -> TextStyle<'static> {
    ("sans-serif", size).into_font().into()
}

/// Draws on a white sheet of this size in pixels and writes it to `path` as a whole.
fn sheet(
    path: &Path,
    size: (u32, u32),
    draw: impl FnOnce(&DrawingArea<SVGBackend, Shift>) -> Result<(), StudyError>,
) -> Result<(), StudyError> {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        area.fill(&RGBColor(255, 255, 255)).map_err(failed)?;
        draw(&area)?;
        area.present().map_err(failed)?;
    }
    std::fs::write(path, svg).map_err(StudyError::file("write", path))
}

/// An error of the drawing library.
fn failed(error: impl std::fmt::Display) -> StudyError {
    StudyError::Figure(error.to_string())
}

/// Draws a line of text with its left middle at a place.
fn write<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    words: &str,
    size: u32,
    at: (i32, i32),
) -> Result<(), StudyError> {
    area.draw_text(words, &text(size), at)
        .map_err(|e| StudyError::Figure(e.to_string()))
}

/// A logarithmic axis with chosen ticks.
type LogAxis = WithKeyPoints<LogCoord<f64>>;

/// The axis of a range.
fn axis(range: &Range<f64>) -> LogAxis {
    range.clone().log_scale().with_key_points(ticks(range))
}

/// Draws these axes on `area`, with what they say.
fn chart<'a, B: DrawingBackend, A>(
    area: &'a DrawingArea<B, Shift>,
    [x, y]: [A; 2],
    [below, beside]: [&str; 2],
) -> Result<ChartContext<'a, B, Cartesian2d<A, A>>, StudyError>
where
    A: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    let mut chart = ChartBuilder::on(area)
        .margin(12)
        .x_label_area_size(48)
        .y_label_area_size(74)
        .build_cartesian_2d(x, y)
        .map_err(|e| failed(e.to_string()))?;
    chart
        .configure_mesh()
        .light_line_style(RGBColor(255, 255, 255))
        .bold_line_style(RGBColor(225, 225, 225))
        .x_desc(below)
        .y_desc(beside)
        .axis_desc_style(text(15))
        .label_style(text(14))
        .x_label_formatter(&|x| label(*x))
        .y_label_formatter(&|x| label(*x))
        .draw()
        .map_err(|e| failed(e.to_string()))?;
    Ok(chart)
}

/// A range around positive numbers, a share of its decades wider on either side; a decade where there is none.
fn around(numbers: impl IntoIterator<Item = f64>) -> Range<f64> {
    let (mut low, mut high) = (f64::INFINITY, 0.0f64);
    for number in numbers.into_iter().filter(|n| n.is_finite() && *n > 0.0) {
        low = low.min(number);
        high = high.max(number);
    }
    if high == 0.0 {
        return 0.1..1.0;
    }
    let margin = (high / low).powf(0.08).max(1.25);
    low / margin..high * margin
}

/// Places of labels: powers of ten over many decades, 1, 2 and 5 times these over few.
fn ticks(range: &Range<f64>) -> Vec<f64> {
    let (first, last) = (
        range.start.log10().floor() as i32,
        range.end.log10().ceil() as i32,
    );
    let within = |x: &f64| *x >= range.start * 0.999_999 && *x <= range.end * 1.000_001;
    let of = |multiples: &[f64], every: i32| -> Vec<f64> {
        (first..=last)
            .filter(|exponent| exponent.rem_euclid(every) == 0)
            .flat_map(|exponent| multiples.iter().map(move |m| m * 10f64.powi(exponent)))
            .filter(within)
            .collect()
    };
    let fine: Vec<f64> = (2..20).map(|m| f64::from(m) * 0.5).collect();
    let choices = [
        of(&fine, 1),
        of(&[1.0, 2.0, 5.0], 1),
        of(&[1.0], 1),
        of(&[1.0], 2),
        of(&[1.0], 4),
    ];
    let fits = choices.into_iter().find(|ticks| ticks.len() <= TICKS);
    fits.unwrap_or_else(|| vec![range.start, range.end])
}

/// A number at a tick.
fn label(number: f64) -> String {
    if number == 0.0 || (1e-3..1e4).contains(&number.abs()) {
        // Multiples of powers of ten carry rounding.
        let rounded: f64 = format!("{number:.6}").parse().unwrap_or(number);
        rounded.to_string()
    } else {
        let text = format!("{number:.3e}");
        match text.split_once('e') {
            Some((mantissa, exponent)) => {
                let mantissa = mantissa.trim_end_matches('0').trim_end_matches('.');
                format!("{mantissa}e{exponent}")
            }
            None => text,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_few() {
        assert_eq!(ticks(&(1e-3..1e2)), [1e-3, 1e-2, 1e-1, 1.0, 10.0, 100.0]);
        let labels = |range: Range<f64>| ticks(&range).into_iter().map(label).collect::<Vec<_>>();
        assert_eq!(labels(0.15..6.0), ["0.2", "0.5", "1", "2", "5"]);
        assert_eq!(
            labels(2e-6..4e-6),
            ["2e-6", "2.5e-6", "3e-6", "3.5e-6", "4e-6"]
        );
        assert_eq!(labels(1e-7..1e9).first().unwrap(), "1e-6");
        assert_eq!(labels(1e-7..1e9).len(), 8);
        for range in [1e-300..1e300, 1.0..1.01, 3.0..4.0] {
            assert!((1..=TICKS).contains(&ticks(&range).len()), "{range:?}");
        }
    }

    #[test]
    fn a_range_has_room_on_both_sides() {
        let range = around([1.0, f64::NAN, 100.0, 0.0, -1.0]);
        assert!(range.start < 0.81 && range.end > 124.0);
        assert_eq!(around([]), 0.1..1.0);
        let single = around([5.0]);
        assert!(single.start < 5.0 && single.end > 5.0);
    }
}
