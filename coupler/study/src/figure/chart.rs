//! Charts: areas with axes, and series in them that share a legend.

use std::path::Path;

use super::area::{Area, Plan};
use super::axis::{Axis, Scale};
use super::canvas::{Anchor, BLACK, Canvas, Colour, Paint, Place, Stroke};
use super::file;
use super::legend::{Legend, Sample};
use super::sheet::Sheet;
use super::style::{LINE, MARGIN, WORDS, colour};
use super::text::wrapped;
use crate::StudyError;

/// Width and height in pixels of what is within the axes, of one area in a row and of several.
const SIZES: [(f64, f64); 2] = [(660.0, 380.0), (440.0, 300.0)];
/// Dash and gap of expected curves in pixels, in turn.
const DASHES: [(f64, f64); 4] = [(8.0, 5.0), (2.0, 4.0), (16.0, 5.0), (5.0, 9.0)];

/// Positive numbers along x and y of at least this ratio lie along a logarithmic axis, unless a scale is given.
const MANY: [f64; 2] = [8.0, 100.0];

/// How the points of a series are drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Mark {
    /// A line of this width in pixels, in a colour of its own.
    Line(f64),
    /// Discs in a colour of their own.
    Dots,
    /// A line with markers, both of its own.
    Marked,
    /// Markers alone.
    Markers,
    /// A black dashed line: what is expected.
    Expected,
    /// Black rings around points of another series.
    Rings,
    /// Grey discs: runs that were stable.
    Stable,
    /// Grey rings: runs that were not.
    Unstable,
}

/// Points that belong together.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// What the legend says; a series without a name is not in it.
    pub label: String,
    /// How it is drawn.
    pub mark: Mark,
    /// In the axes' units, by panel. What has no place on an axis is left out.
    pub points: Vec<Vec<(f64, f64)>>,
}

/// An area.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Panel {
    /// Above.
    pub caption: String,
    /// Below and beside.
    pub words: [String; 2],
    /// Of x and of y; by their numbers where it is left out.
    pub scales: [Option<Scale>; 2],
    /// First and last number of x and of y, where they are given.
    pub limits: [[Option<f64>; 2]; 2],
}

/// A chart.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Chart {
    /// Above all.
    pub title: String,
    /// Below all.
    pub note: String,
    /// Panels in a row.
    pub columns: usize,
    /// What the numbers 0, 1, 2, ... along x stand for, where they are no numbers of their own.
    pub names: Option<Vec<String>>,
    /// The areas.
    pub panels: Vec<Panel>,
    /// What is drawn in them, one over the other.
    pub series: Vec<Series>,
}

impl Chart {
    /// Draws it to `path`.
    ///
    /// # Errors
    /// [`StudyError::Figure`] and [`StudyError::File`].
    pub fn draw(&self, path: &Path) -> Result<(), StudyError> {
        file::write(path, &self.sheet())
    }

    fn sheet(&self) -> Canvas {
        let cells = (self.panels.iter().enumerate())
            .map(|(k, panel)| (&*panel.caption, self.plan(k, panel)))
            .collect();
        let sheet = Sheet::new(&self.title, cells, self.columns, SIZES[1].0);
        let samples = samples(&self.series);
        let named = self.series.iter().zip(&samples);
        let named = named.filter(|(series, _)| !series.label.is_empty());
        let entries: Vec<_> = named.map(|(s, sample)| (*sample, &*s.label)).collect();
        let legend = Legend::new(&entries, sheet.width - 2.0 * MARGIN);
        let note = wrapped(&self.note, WORDS, sheet.width - 2.0 * MARGIN);
        let note_height = note.len() as f64 * LINE;
        let (mut canvas, areas, below) = sheet.draw(legend.height() + note_height + MARGIN);
        for (k, area) in areas.iter().enumerate() {
            area.within(&mut canvas, |canvas| {
                for (series, sample) in self.series.iter().zip(&samples) {
                    put(canvas, area, &series.points[k], *sample);
                }
            });
        }
        legend.draw(&mut canvas, (MARGIN, below));
        for (k, line) in (0..).zip(&note) {
            let y = below + legend.height() + (f64::from(k) + 0.5) * LINE;
            canvas.text(line, WORDS, (MARGIN, y), Anchor::Start);
        }
        canvas
    }

    fn plan(&self, k: usize, panel: &Panel) -> Plan {
        let points = || self.series.iter().flat_map(|series| &series.points[k]);
        let axis = |i: usize, of: fn(&(f64, f64)) -> f64| {
            let scale = panel.scales[i].unwrap_or_else(|| Scale::of(points().map(of), MANY[i]));
            Axis::around(points().map(of), scale, panel.limits[i])
        };
        let size = SIZES[usize::from(self.columns > 1)];
        let (x, y) = (axis(0, |p| p.0), axis(1, |p| p.1));
        let words = [0, 1].map(|i| &*panel.words[i]);
        match &self.names {
            Some(names) => {
                let x = Axis::over([-0.5, names.len() as f64 - 0.5], Scale::Linear);
                Plan::with_names(size, [x, y], words, names)
            }
            None => Plan::new(size, [x, y], words),
        }
    }
}

fn samples(series: &[Series]) -> Vec<Sample> {
    let (mut own, mut expected) = (0, 0);
    let mut next = || {
        own += 1;
        own - 1
    };
    let grey = |shade| Colour(shade, shade, shade);
    let mut sample = |series: &Series| match series.mark {
        Mark::Line(width) => Sample::Line(Stroke::of(colour(next()), width)),
        Mark::Dots => Sample::Dot(Paint::Filled(colour(next())), 4.0),
        Mark::Marked => Sample::Marked(next(), true),
        Mark::Markers => Sample::Marked(next(), false),
        Mark::Expected => {
            expected += 1;
            let dashes = Some(DASHES[(expected - 1) % DASHES.len()]);
            let line = Stroke::of(BLACK, 1.3);
            Sample::Line(Stroke { dashes, ..line })
        }
        Mark::Rings => Sample::Dot(Paint::Outlined(Stroke::of(BLACK, 1.0)), 9.0),
        Mark::Stable => Sample::Dot(Paint::Filled(grey(90)), 4.0),
        Mark::Unstable => Sample::Dot(Paint::Outlined(Stroke::of(grey(150), 1.0)), 4.0),
    };
    series.iter().map(&mut sample).collect()
}

fn put(canvas: &mut Canvas, area: &Area, points: &[(f64, f64)], sample: Sample) {
    // A number without a logarithm is nowhere on a logarithmic axis: a line has a gap there.
    let pieces = points.split(|p| !area.has(*p));
    for piece in pieces.filter(|piece| !piece.is_empty()) {
        let places: Vec<Place> = piece.iter().map(|p| area.place(*p)).collect();
        if let Some(line) = sample.line() {
            canvas.line(&thinned(&places), line);
        }
        for at in places {
            sample.mark(canvas, at);
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

    fn series(label: &str, mark: Mark, points: Vec<Vec<(f64, f64)>>) -> Series {
        let label = label.into();
        Series {
            label,
            mark,
            points,
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
        assert_eq!((kept.first(), kept.last()), (places.first(), places.last()));
    }

    #[test]
    fn no_words_overlap_however_long_they_are() {
        let long = "a name that goes on and on, as names of runs with three settings in them do, and then some more";
        let names = [
            "linear",
            "ugimp",
            "quadratic_bspline",
            "{ blend = { pic_fraction = 0.01 } }",
        ];
        let names = Some(names.map(String::from).to_vec());
        let marks = [Mark::Marked, Mark::Expected, Mark::Stable, Mark::Rings];
        for (labels, scales, range) in [
            (vec!["a", "b", "c"], [None; 2], [1.0, 2.0]),
            (
                vec![long, "b", long, "d"],
                [Some(Scale::Log); 2],
                [0.001_234, 0.001_236],
            ),
            (vec!["one"; 17], [None, Some(Scale::Log)], [-1.0e-7, 3.0e11]),
            (vec![long], [Some(Scale::Log), None], [1e-200, 1e200]),
        ] {
            for (count, title) in [(0, ""), (1, "short"), (2, long), (5, &*long.repeat(3))] {
                for (columns, names) in [(1, &None), (2, &None), (2, &names)] {
                    let ends = range.map(|end| (end, end)).to_vec();
                    let all = vec![ends; count];
                    let all = (labels.iter().zip(marks.iter().cycle()))
                        .map(|(label, mark)| series(label, *mark, all.clone()));
                    let panel = Panel {
                        caption: title.into(),
                        words: [long.repeat(2), format!("{long} [kg m/s]")],
                        scales,
                        limits: [[None; 2]; 2],
                    };
                    let chart = Chart {
                        title: title.into(),
                        note: title.into(),
                        columns,
                        names: names.clone(),
                        panels: vec![panel; count],
                        series: all.collect(),
                    };
                    assert_eq!(chart.sheet().collisions(), Vec::<String>::new());
                }
            }
        }
    }

    #[test]
    fn a_logarithmic_axis_leaves_out_what_has_no_logarithm() {
        let points = vec![(1.0, 1.0), (10.0, 0.0), (100.0, 4.0), (1000.0, 2.0)];
        let rings = vec![(1.0, 1.0), (0.0, 1.0)];
        let chart = Chart {
            panels: vec![Panel {
                scales: [Some(Scale::Log); 2],
                ..Panel::default()
            }],
            series: vec![
                series("c", Mark::Line(2.0), vec![points]),
                series("", Mark::Rings, vec![rings]),
            ],
            ..Chart::default()
        };
        let svg = chart.sheet().svg();
        let within = svg.split("<g clip-path").nth(1).expect("what is clipped");
        let within = within.split("</g>").next().unwrap();
        assert_eq!(within.matches("<polyline").count(), 2);
        assert_eq!(within.matches("r=\"9\"").count(), 1);
    }
}
