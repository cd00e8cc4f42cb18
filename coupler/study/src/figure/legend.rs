//! What the curves are: a sample and words each, in columns that have room for them.

use super::canvas::{Anchor, Canvas, Paint, Place, Stroke};
use super::style::{LINE, WORDS, colour, marker};
use super::text::{width, wrapped};

/// Width of a sample with the gap after it.
const SAMPLE: f64 = 40.0;
/// Between two columns.
const GAP: f64 = 24.0;
/// Most columns.
const COLUMNS: usize = 3;

/// What stands for a series.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Sample {
    /// A line.
    Line(Stroke),
    /// A disc or a ring of this radius.
    Dot(Paint, f64),
    /// The marker of the `k`-th series, with its line or alone.
    Marked(usize, bool),
}

impl Sample {
    /// The line that joins its points, if one does.
    pub fn line(self) -> Option<Stroke> {
        match self {
            Self::Line(line) => Some(line),
            Self::Marked(k, true) => Some(Stroke::of(colour(k), 2.0)),
            Self::Dot(..) | Self::Marked(_, false) => None,
        }
    }

    /// Draws what is at a point of the series.
    pub fn mark(self, canvas: &mut Canvas, at: Place) {
        match self {
            Self::Dot(paint, radius) => canvas.circle(at, radius, paint),
            Self::Marked(k, _) => marker(canvas, at, k),
            Self::Line(_) => {}
        }
    }
}

/// The legend before it has a place.
#[derive(Debug, Clone)]
pub(super) struct Legend {
    entries: Vec<(Sample, Vec<String>)>,
    columns: usize,
    column: f64,
}

impl Legend {
    /// Of samples and their words, at most as wide as this.
    pub fn new(entries: &[(Sample, &str)], most: f64) -> Self {
        let widest = entries
            .iter()
            .map(|(_, words)| width(words, WORDS))
            .fold(0.0, f64::max);
        let needs = SAMPLE + widest + GAP;
        let columns = ((most / needs) as usize)
            .clamp(1, COLUMNS)
            .min(entries.len().max(1));
        let column = most / columns as f64;
        let wrap = |words: &str| wrapped(words, WORDS, column - SAMPLE);
        let entries = entries
            .iter()
            .map(|(sample, words)| (*sample, wrap(words)))
            .collect();
        Self {
            entries,
            columns,
            column,
        }
    }

    fn rows(&self) -> impl Iterator<Item = (&[(Sample, Vec<String>)], f64)> {
        self.entries.chunks(self.columns).map(|row| {
            let lines = row.iter().map(|(_, lines)| lines.len()).max().unwrap_or(0);
            (row, lines as f64 * LINE)
        })
    }

    /// Its height.
    pub fn height(&self) -> f64 {
        self.rows().map(|(_, height)| height).sum()
    }

    /// Draws it with its upper left corner here.
    pub fn draw(&self, canvas: &mut Canvas, (left, top): Place) {
        let mut top = top;
        for (row, height) in self.rows() {
            for (k, (sample, lines)) in (0..).zip(row) {
                let x = left + f64::from(k) * self.column;
                let middle = top + 0.5 * LINE;
                if let Some(line) = sample.line() {
                    canvas.line(&[(x, middle), (x + 30.0, middle)], line);
                }
                sample.mark(canvas, (x + 15.0, middle));
                for (line, words) in (0..).zip(lines) {
                    let y = middle + f64::from(line) * LINE;
                    canvas.text(words, WORDS, (x + SAMPLE, y), Anchor::Start);
                }
            }
            top += height;
        }
    }
}
