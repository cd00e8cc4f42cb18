//! Curves over linear axes: histories of runs, measured values as dots, expected ones dashed.

use std::ops::Range;
use std::path::Path;

use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint, Ranged};
use plotters::element::DashedPathElement;
use plotters::prelude::{Circle, Color, PathElement};
use plotters::style::RGBColor;

use super::{TICKS, chart, colour, failed, lines, sheet, write};
use crate::StudyError;

/// Width of the axes in pixels, and their height.
const AXES: (i32, i32) = (760, 440);
/// Height of the title.
const TITLE: i32 = 34;
/// Dash and gap of expected curves in pixels, in turn.
const DASHES: [(i32, i32); 4] = [(8, 5), (2, 4), (16, 5), (5, 9)];

/// How a curve is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stroke {
    /// A line in a colour of its own.
    Line,
    /// Dots in a colour of their own.
    Dots,
    /// A black dashed line: what is expected.
    Expected,
}

/// A curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// What the legend says.
    pub label: String,
    /// In the axes' units; all finite.
    pub points: Vec<(f64, f64)>,
    /// How it is drawn.
    pub stroke: Stroke,
}

/// What stands around the axes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Words {
    /// Above.
    pub title: String,
    /// Below.
    pub x: String,
    /// Beside.
    pub y: String,
}

/// Draws the figure to `path`.
///
/// # Errors
/// [`StudyError::Figure`] and [`StudyError::File`].
pub fn draw(path: &Path, words: &Words, curves: &[Curve]) -> Result<(), StudyError> {
    let below = TITLE + AXES.1 + 8;
    let height = below + lines(curves.len().div_ceil(2)) + 8;
    sheet(path, (AXES.0 as u32, height as u32), |area| {
        write(area, &words.title, 22, (14, 8))?;
        let part = area
            .clone()
            .shrink((0, TITLE), (AXES.0 as u32, AXES.1 as u32));
        let all = || curves.iter().flat_map(|curve| &curve.points);
        let axes = [
            Linear::around(all().map(|p| p.0)),
            Linear::around(all().map(|p| p.1)),
        ];
        let (x, y) = (axes[0].range.clone(), axes[1].range.clone());
        let mut chart = chart(&part, axes, [&words.x, &words.y])?;
        let sketch = |e: &dyn std::fmt::Display| failed(e.to_string());
        let (mut own, mut expected) = (0, 0);
        for (k, curve) in curves.iter().enumerate() {
            let left = if k % 2 == 0 { 20 } else { 20 + AXES.0 / 2 };
            let at = (left, below + lines(k / 2) + 7);
            let sample = vec![at, (at.0 + 30, at.1)];
            match curve.stroke {
                Stroke::Line => {
                    let style = colour(own).stroke_width(2);
                    let line = thinned(&curve.points, &x, &y);
                    chart
                        .draw_series([PathElement::new(line, style)])
                        .map_err(|e| sketch(&e))?;
                    area.draw(&PathElement::new(sample, style))
                        .map_err(failed)?;
                }
                Stroke::Dots => {
                    let style = colour(own).filled();
                    let dots = curve.points.iter().map(|&at| Circle::new(at, 4, style));
                    chart.draw_series(dots).map_err(|e| sketch(&e))?;
                    area.draw(&Circle::new((at.0 + 15, at.1), 4, style))
                        .map_err(failed)?;
                }
                Stroke::Expected => {
                    let style = RGBColor(0, 0, 0).stroke_width(1);
                    let (dash, gap) = DASHES[expected % DASHES.len()];
                    let line = thinned(&curve.points, &x, &y);
                    let dashed = DashedPathElement::new(line, dash, gap, style);
                    chart.draw_series([dashed]).map_err(|e| sketch(&e))?;
                    area.draw(&DashedPathElement::new(sample, dash, gap, style))
                        .map_err(failed)?;
                }
            }
            match curve.stroke {
                Stroke::Line | Stroke::Dots => own += 1,
                Stroke::Expected => expected += 1,
            }
            write(area, &curve.label, 15, (at.0 + 40, at.1 - 7))?;
        }
        Ok(())
    })
}

/// A linear axis with round ticks.
pub(super) struct Linear {
    range: Range<f64>,
    ticks: Vec<f64>,
}

impl Linear {
    /// Just this range.
    pub(super) fn over(range: Range<f64>) -> Self {
        let ticks = ticks(&range);
        Self { range, ticks }
    }

    /// A range around numbers, 3 % wider on either side; one around 0 where there is none.
    fn around(numbers: impl IntoIterator<Item = f64>) -> Self {
        let none = (f64::INFINITY, f64::NEG_INFINITY);
        let ends = |(low, high): (f64, f64), n: f64| (low.min(n), high.max(n));
        let (low, high) = numbers.into_iter().fold(none, ends);
        let (low, high) = if low > high { (0.0, 0.0) } else { (low, high) };
        let width = high - low;
        let margin = if width > 0.0 {
            0.03 * width
        } else {
            low.abs().max(1.0)
        };
        Self::over(low - margin..high + margin)
    }
}

impl Ranged for Linear {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (first, last): (i32, i32)) -> i32 {
        let share = (value - self.range.start) / (self.range.end - self.range.start);
        (f64::from(first) + share * f64::from(last - first)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        if hint.weight().allow_light_points() {
            return Vec::new();
        }
        self.ticks.clone()
    }

    fn range(&self) -> Range<f64> {
        self.range.clone()
    }
}

/// Multiples of 1, 2 or 5 times a power of ten, as many as fit.
fn ticks(range: &Range<f64>) -> Vec<f64> {
    let least = (range.end - range.start) / TICKS as f64;
    let power = 10f64.powf(least.log10().floor());
    let fits = [1.0, 2.0, 5.0, 10.0].map(|m| m * power);
    let step = fits.into_iter().find(|s| *s >= least).unwrap_or(fits[3]);
    let first = (range.start / step).ceil() as i64;
    let last = (range.end / step).floor() as i64;
    (first..=last).map(|k| k as f64 * step).collect()
}

/// The curve that looks the same: of consecutive points in one column of pixels the first, the lowest, the highest and the
/// last.
fn thinned(points: &[(f64, f64)], x: &Range<f64>, y: &Range<f64>) -> Vec<(f64, f64)> {
    let place = |value: f64, range: &Range<f64>, pixels: i32| -> i64 {
        ((value - range.start) / (range.end - range.start) * f64::from(pixels)) as i64
    };
    let column = |p: &(f64, f64)| place(p.0, x, AXES.0);
    let mut kept: Vec<(f64, f64)> = Vec::new();
    for run in points.chunk_by(|a, b| column(a) == column(b)) {
        let by_height = |a: &usize, b: &usize| run[*a].1.total_cmp(&run[*b].1);
        let low = (0..run.len()).min_by(by_height).expect("a run has a point");
        let high = (0..run.len()).max_by(by_height).expect("a run has a point");
        let mut ends = [0, low, high, run.len() - 1];
        ends.sort_unstable();
        kept.extend(ends.map(|k| run[k]));
    }
    kept.dedup_by_key(|p| (column(p), place(p.1, y, AXES.1)));
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_few_and_within() {
        assert_eq!(
            ticks(&(-0.1..1.1)),
            [0.0, 0.2, 0.4, 0.600_000_000_000_000_1, 0.8, 1.0]
        );
        assert_eq!(ticks(&(0.0..25.0)), [0.0, 5.0, 10.0, 15.0, 20.0, 25.0]);
        for range in [1e-9..1.15e-9, -3e12..1e11, 0.7..0.71] {
            let ticks = ticks(&range);
            assert!((2..=TICKS + 1).contains(&ticks.len()), "{ticks:?}");
            let inside =
                |t: &f64| *t > range.start - 1e-9 * t.abs() && *t < range.end + 1e-9 * t.abs();
            assert!(ticks.iter().all(inside), "{ticks:?}");
        }
        assert!(Linear::around([]).range.contains(&0.0));
        assert!(Linear::around([5.0]).range.contains(&5.0));
    }

    #[test]
    fn a_spike_outlives_the_thinning() {
        let spike = 5000;
        let at = |k: usize| (k as f64 * 1e-4, if k == spike { 9.0 } else { 0.0 });
        let points: Vec<(f64, f64)> = (0..10_000).map(at).collect();
        let kept = thinned(&points, &(0.0..1.0), &(0.0..10.0));
        assert!(kept.contains(&at(spike)));
        assert!(kept.len() < 4 * AXES.0 as usize, "{}", kept.len());
        assert_eq!(kept.first(), points.first());
    }
}
