//! Curves: histories of runs, measured values as dots, expected ones dashed.

use std::path::Path;

use super::area::{Area, Plan};
use super::axis::{Axis, Scale};
use super::canvas::{BLACK, Canvas, Paint, Place, Stroke as Line};
use super::file;
use super::legend::{Legend, Sample};
use super::style::{MARGIN, colour, heading, heading_height, write_heading};
use crate::StudyError;

/// Width of what is within the axes in pixels, and its height.
const SIZE: (f64, f64) = (660.0, 380.0);
/// Dash and gap of expected curves in pixels, in turn.
const DASHES: [(f64, f64); 4] = [(8.0, 5.0), (2.0, 4.0), (16.0, 5.0), (5.0, 9.0)];

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

/// What stands around the axes, and how numbers lie along them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Frame {
    /// Above.
    pub title: String,
    /// Below and beside.
    pub words: [String; 2],
    /// Of x and of y.
    pub scales: [Scale; 2],
    /// First and last number of x and of y, where they are given.
    pub limits: [[Option<f64>; 2]; 2],
}

/// Draws the figure to `path`.
///
/// # Errors
/// [`StudyError::Figure`] and [`StudyError::File`].
pub fn draw(path: &Path, frame: &Frame, curves: &[Curve]) -> Result<(), StudyError> {
    file::write(path, &sheet(frame, curves))
}

fn sheet(frame: &Frame, curves: &[Curve]) -> Canvas {
    let all = || curves.iter().flat_map(|curve| &curve.points);
    let axes = [
        Axis::around(all().map(|p| p.0), frame.scales[0], frame.limits[0]),
        Axis::around(all().map(|p| p.1), frame.scales[1], frame.limits[1]),
    ];
    let plan = Plan::new(SIZE, axes, [&frame.words[0], &frame.words[1]]);
    let (width, height) = plan.outer();
    let samples = samples(curves);
    let entries = samples
        .iter()
        .copied()
        .zip(curves.iter().map(|c| c.label.clone()));
    let legend = Legend::new(&entries.collect::<Vec<_>>(), width - 2.0 * MARGIN);
    let title = heading(&frame.title, width);
    let top = heading_height(&title);
    let mut canvas = Canvas::new(width, top + height + legend.height() + MARGIN);
    write_heading(&mut canvas, &title, 0.0);
    let area = plan.draw(&mut canvas, (0.0, top));
    area.within(&mut canvas, |canvas| {
        for (curve, sample) in curves.iter().zip(samples) {
            put(canvas, &area, &curve.points, sample);
        }
    });
    legend.draw(&mut canvas, (MARGIN, top + height));
    canvas
}

fn samples(curves: &[Curve]) -> Vec<Sample> {
    let (mut own, mut expected) = (0, 0);
    let sample = |curve: &Curve| match curve.stroke {
        Stroke::Expected => {
            expected += 1;
            let dashes = Some(DASHES[(expected - 1) % DASHES.len()]);
            Sample::Line(Line {
                dashes,
                ..Line::of(BLACK, 1.3)
            })
        }
        drawn => {
            own += 1;
            let colour = colour(own - 1);
            if drawn == Stroke::Line {
                Sample::Line(Line::of(colour, 2.0))
            } else {
                Sample::Dot(Paint::Filled(colour))
            }
        }
    };
    curves.iter().map(sample).collect()
}

fn put(canvas: &mut Canvas, area: &Area, points: &[(f64, f64)], sample: Sample) {
    // A number without a logarithm is nowhere on a logarithmic axis: the line has a gap there.
    for piece in points
        .split(|p| !area.has(*p))
        .filter(|piece| !piece.is_empty())
    {
        let places: Vec<Place> = piece.iter().map(|p| area.place(*p)).collect();
        match sample {
            Sample::Dot(paint) => places.iter().for_each(|at| canvas.circle(*at, 4.0, paint)),
            Sample::Line(line) | Sample::Marked(line, _) => canvas.line(&thinned(&places), line),
        }
    }
}

/// The line that looks the same: of consecutive places in one half of a pixel across the first, the lowest, the highest and
/// the last.
fn thinned(places: &[Place]) -> Vec<Place> {
    let column = |p: &Place| (2.0 * p.0).floor();
    let mut kept: Vec<Place> = Vec::new();
    for run in places.chunk_by(|a, b| column(a) == column(b)) {
        let by_height = |a: &usize, b: &usize| run[*a].1.total_cmp(&run[*b].1);
        let low = (0..run.len()).min_by(by_height).expect("a run has a place");
        let high = (0..run.len()).max_by(by_height).expect("a run has a place");
        let mut ends = [0, low, high, run.len() - 1];
        ends.sort_unstable();
        kept.extend(ends.map(|k| run[k]));
    }
    kept.dedup();
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(label: &str, points: &[(f64, f64)], stroke: Stroke) -> Curve {
        Curve {
            label: label.into(),
            points: points.to_vec(),
            stroke,
        }
    }

    #[test]
    fn a_spike_outlives_the_thinning() {
        let spike = 5000;
        let at = |k: usize| (k as f64 * 0.066, if k == spike { 9.0 } else { 0.0 });
        let places: Vec<Place> = (0..10_000).map(at).collect();
        let kept = thinned(&places);
        assert!(kept.contains(&at(spike)));
        assert!(kept.len() < 8 * 660, "{}", kept.len());
        assert_eq!(kept.first(), places.first());
        assert_eq!(kept.last(), places.last());
    }

    #[test]
    fn no_words_overlap_however_long_they_are() {
        let long = "a name that goes on and on, as names of runs with three settings in them do, and then some more";
        for (labels, scales, range) in [
            (
                vec!["a", "b", "c"],
                [Scale::Linear, Scale::Linear],
                [1.0, 2.0],
            ),
            (
                vec![long, "b", long, "d"],
                [Scale::Log, Scale::Log],
                [0.001_234, 0.001_236],
            ),
            (
                vec!["one"; 17],
                [Scale::Linear, Scale::Log],
                [-1.0e-7, 3.0e11],
            ),
            (vec![long], [Scale::Log, Scale::Linear], [1e-200, 1e200]),
        ] {
            let curves: Vec<Curve> = labels
                .iter()
                .map(|label| {
                    curve(
                        label,
                        &[(range[0], range[0]), (range[1], range[1])],
                        Stroke::Line,
                    )
                })
                .collect();
            for title in ["", "short", long, &long.repeat(3)] {
                let frame = Frame {
                    title: title.into(),
                    words: [long.repeat(2), format!("{long} [kg m/s]")],
                    scales,
                    ..Frame::default()
                };
                let canvas = sheet(&frame, &curves);
                assert_eq!(canvas.collisions(), Vec::<String>::new());
            }
        }
    }

    #[test]
    fn a_logarithmic_axis_leaves_out_what_has_no_logarithm() {
        let points = [(1.0, 1.0), (10.0, 0.0), (100.0, 4.0), (1000.0, 2.0)];
        let frame = Frame {
            scales: [Scale::Log; 2],
            ..Frame::default()
        };
        let svg = sheet(&frame, &[curve("c", &points, Stroke::Line)]).svg();
        let within = svg.split("<g clip-path").nth(1).expect("what is clipped");
        assert_eq!(
            within
                .split("</g>")
                .next()
                .unwrap()
                .matches("<polyline")
                .count(),
            2
        );
    }
}
