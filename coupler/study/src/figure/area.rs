//! An area with axes: numbers, words and a grid around what is drawn in it.

use super::axis::{Axis, label};
use super::canvas::{Anchor, Canvas, Colour, Place, Stroke};
use super::style::{LINE, MARGIN, NUMBERS, WORDS};
use super::text::{width, wrapped};

/// Between an axis and its numbers.
pub(super) const NUMBER_GAP: f64 = 6.0;
/// Least distance between two numbers along an axis.
const APART: f64 = 12.0;
/// Words along a shorter axis are not broken any more.
const SHORTEST: f64 = 60.0;
/// Most numbers along an axis.
const MOST: usize = 9;

/// The area before it has a place: its size, its axes and what they say.
#[derive(Debug, Clone)]
pub(super) struct Plan {
    /// Width and height in pixels of what is within the axes.
    pub size: (f64, f64),
    axes: [Axis; 2],
    /// Numbers below with the lines that stand at them, and beside.
    below: Vec<(f64, Vec<String>)>,
    beside: Vec<f64>,
    words: [Vec<String>; 2],
    /// Room that it needs around it: left, above, right, below.
    pub around: [f64; 4],
}

/// An area on a sheet.
#[derive(Debug, Clone)]
pub(super) struct Area {
    at: Place,
    size: (f64, f64),
    axes: [Axis; 2],
}

impl Plan {
    /// An area of this size in pixels, with words below and beside it.
    pub fn new(size: (f64, f64), axes: [Axis; 2], words: [&str; 2]) -> Self {
        let numbers = fitting(&axes[0], size.0).into_iter();
        let below = numbers.map(|tick| (tick, vec![label(tick)])).collect();
        Self::of(size, axes, words, below)
    }

    /// Likewise, with names in place of the numbers 0, 1, 2, ... below.
    pub fn with_names(
        size: (f64, f64),
        axes: [Axis; 2],
        words: [&str; 2],
        names: &[String],
    ) -> Self {
        let room = (axes[0].share(1.0) - axes[0].share(0.0)) * size.0 - APART;
        let lines = |name: &String| wrapped(name, NUMBERS, room);
        let below = names.iter().enumerate();
        let below = below.map(|(k, name)| (k as f64, lines(name))).collect();
        Self::of(size, axes, words, below)
    }

    fn of(
        size: (f64, f64),
        axes: [Axis; 2],
        words: [&str; 2],
        below: Vec<(f64, Vec<String>)>,
    ) -> Self {
        let wide = |text: &String| width(text, NUMBERS);
        let beside = spaced(&axes[1], size.1, 3.0, |_| NUMBERS);
        let widest = beside.iter().map(|t| wide(&label(*t))).fold(0.0, f64::max);
        // Half of what stands at the last number may reach beyond the end.
        let beyond = below.iter().flat_map(|(tick, lines)| {
            let after = (1.0 - axes[0].share(*tick)) * size.0;
            lines.iter().map(move |line| 0.5 * wide(line) - after)
        });
        let beyond = beyond.fold(0.0, f64::max);
        let sides = [size.0, size.1].map(|side| side.max(SHORTEST));
        let words = [0, 1].map(|axis| wrapped(words[axis], WORDS, sides[axis]));
        // Beside a low area words reach beyond both of its ends.
        let longest = words[1].iter().map(|line| width(line, WORDS));
        let over = (0.5 * (longest.fold(0.0, f64::max) - size.1)).max(0.0);
        let [x_lines, y_lines] = [&words[0], &words[1]].map(|lines| lines.len() as f64 * LINE);
        let around = [
            MARGIN + y_lines + widest + 2.0 * NUMBER_GAP,
            MARGIN + over,
            MARGIN.max(beyond + 2.0),
            (NUMBER_GAP + high(&below) + x_lines + 0.5 * MARGIN).max(over),
        ];
        Self {
            size,
            axes,
            below,
            beside,
            words,
            around,
        }
    }

    /// Width and height with all that is around it.
    pub fn outer(&self) -> (f64, f64) {
        let [left, above, right, below] = self.around;
        (self.size.0 + left + right, self.size.1 + above + below)
    }

    /// Draws it with the upper left corner of all here.
    pub fn draw(&self, canvas: &mut Canvas, (left, top): Place) -> Area {
        let at = (left + self.around[0], top + self.around[1]);
        let area = Area {
            at,
            size: self.size,
            axes: self.axes,
        };
        let (width, height) = self.size;
        let grid = Stroke::of(Colour(225, 225, 225), 1.0);
        for (tick, lines) in &self.below {
            let x = at.0 + self.axes[0].share(*tick) * width;
            canvas.line(&[(x, at.1), (x, at.1 + height)], grid);
            for (k, line) in (0..).zip(lines) {
                let y = at.1 + height + NUMBER_GAP + (f64::from(k) + 0.5) * LINE;
                canvas.text(line, NUMBERS, (x, y), Anchor::Middle);
            }
        }
        for &tick in &self.beside {
            let y = at.1 + (1.0 - self.axes[1].share(tick)) * height;
            canvas.line(&[(at.0, y), (at.0 + width, y)], grid);
            canvas.text(&label(tick), NUMBERS, (at.0 - NUMBER_GAP, y), Anchor::End);
        }
        let frame = [
            (at.0, at.1),
            (at.0, at.1 + height),
            (at.0 + width, at.1 + height),
        ];
        canvas.line(&frame, Stroke::of(Colour(120, 120, 120), 1.0));
        for (k, line) in (0..).zip(&self.words[0]) {
            let y = at.1 + height + NUMBER_GAP + high(&self.below) + LINE * (f64::from(k) + 0.5);
            canvas.text(line, WORDS, (at.0 + 0.5 * width, y), Anchor::Middle);
        }
        for (k, line) in (0..).zip(&self.words[1]) {
            let x = left + MARGIN + LINE * (f64::from(k) + 0.5);
            canvas.upright(line, WORDS, (x, at.1 + 0.5 * height));
        }
        area
    }
}

impl Area {
    /// Where a pair of numbers is.
    pub fn place(&self, (x, y): (f64, f64)) -> Place {
        let [x, y] = [self.axes[0].share(x), self.axes[1].share(y)];
        (
            self.at.0 + x * self.size.0,
            self.at.1 + (1.0 - y) * self.size.1,
        )
    }

    /// Whether both have a place.
    pub fn has(&self, (x, y): (f64, f64)) -> bool {
        self.axes[0].has(x) && self.axes[1].has(y)
    }

    /// Its upper left corner.
    pub fn corner(&self) -> Place {
        self.at
    }

    /// Draws what is within its ends only.
    pub fn within(&self, canvas: &mut Canvas, draw: impl FnOnce(&mut Canvas)) {
        canvas.clipped(self.at, self.size, draw);
    }
}

/// As many numbers below an axis of this length as have room beside each other; they are longer the more there are.
pub(super) fn fitting(axis: &Axis, length: f64) -> Vec<f64> {
    spaced(axis, length, APART, |tick| width(&label(tick), NUMBERS))
}

/// As many numbers along an axis of this length as keep so far apart, each as long as `extent` says. At least the first and
/// the last, and the first alone where these have no room.
fn spaced(axis: &Axis, length: f64, apart: f64, extent: impl Fn(f64) -> f64) -> Vec<f64> {
    let fits = |ticks: &Vec<f64>| {
        ticks.windows(2).all(|pair| {
            let [a, b] = [pair[0], pair[1]].map(|tick| (axis.share(tick) * length, extent(tick)));
            b.0 - a.0 - 0.5 * (a.1 + b.1) >= apart
        })
    };
    let mut choices = (4..=MOST).rev().map(|most| axis.ticks(most));
    if let Some(ticks) = choices.find(fits) {
        return ticks;
    }
    let all = axis.ticks(4);
    let ends = vec![all[0], all[all.len() - 1]];
    if fits(&ends) { ends } else { vec![all[0]] }
}

/// Height of what stands at the numbers below.
fn high(below: &[(f64, Vec<String>)]) -> f64 {
    below
        .iter()
        .map(|(_, lines)| lines.len())
        .max()
        .unwrap_or(0) as f64
        * LINE
}
