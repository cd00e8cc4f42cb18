//! A sheet: words in lines, and rows of areas with axes, one below the other.

use plotters::style::{RGBColor, text_anchor::HPos};

use super::axis::Axis;
use super::shape::{
    Form, GAP, HEADING, NUMBERS, Place, Shape, WHOLE, WORDS, Words, width, wrapped,
};

/// Room around everything.
pub(crate) const MARGIN: f64 = 12.0;
/// Least width of a sheet.
const LEAST: f64 = 440.0;

/// An area with axes, and what is drawn in it.
pub(crate) struct Area {
    /// Width and height in pixels of what is within the axes.
    pub size: (f64, f64),
    pub axes: [Axis; 2],
    /// Above, below, and above the axis of y.
    pub words: [String; 3],
    /// What the numbers 0, 1, 2, ... along x stand for, where they are no numbers of their own.
    pub names: Option<Vec<String>>,
    /// In the axes' numbers; what is beyond them is left out.
    pub shapes: Vec<Shape>,
}

/// What is drawn, in pixels.
pub(crate) struct Sheet {
    pub shapes: Vec<Shape>,
    pub(super) words: Vec<Words>,
    pub width: f64,
    /// Where what comes next begins.
    pub height: f64,
}

fn most(numbers: impl Iterator<Item = f64>) -> f64 {
    numbers.fold(0.0, f64::max)
}

impl Area {
    /// What stands below at which share of the width, in lines.
    fn below(&self) -> Vec<(f64, Vec<String>)> {
        let Some(names) = &self.names else {
            let numbers = self.axes[0].numbers(self.size.0, true).into_iter();
            let lines = |(share, number)| (share, vec![number]);
            return numbers.map(lines).collect();
        };
        let room = self.size.0 / names.len() as f64 - 2.0 * GAP;
        let shares = (0..).map(|k| self.axes[0].share(f64::from(k)));
        let lines = names.iter().map(|name| wrapped(name, NUMBERS, room));
        shares.zip(lines).collect()
    }

    /// Room that it needs to the left and to the right: half of what stands at the last number may reach beyond the end.
    fn room(&self) -> [f64; 2] {
        let wide = |text: &String| width(text, NUMBERS);
        let beside = self.axes[1].numbers(self.size.1, false);
        let beside = most(beside.iter().map(|(_, number)| wide(number)));
        let below = self.below();
        let below = most(below.iter().flat_map(|(_, lines)| lines).map(wide));
        [MARGIN + beside + GAP, MARGIN.max(0.5 * below)]
    }

    fn head(&self) -> Vec<String> {
        let [above, _, beside] = &self.words;
        let lines = |words: &String| wrapped(words, WORDS, self.size.0);
        [above, beside].into_iter().flat_map(lines).collect()
    }

    /// Its shapes as far as they are within the axes, with its upper left corner here.
    fn drawn(&self, (left, top): Place) -> Vec<Shape> {
        let (wide, high) = self.size;
        let place = |&(x, y): &Place| {
            let [x, y] = [self.axes[0].share(x), self.axes[1].share(y)];
            (left + x * wide, top + (1.0 - y) * high)
        };
        let nearest = |(x, y): Place| (x.clamp(left, left + wide), y.clamp(top, top + high));
        // Rounding must not leave out an end. A number without a logarithm is nowhere.
        let within = |at: &Place| (nearest(*at).0 - at.0).hypot(nearest(*at).1 - at.1) < 1e-6;
        let mut drawn = Vec::new();
        for Shape(points, colour, form) in &self.shapes {
            let mut places: Vec<Place> = points.iter().map(place).collect();
            let mut put = |places| drawn.push(Shape(places, *colour, *form));
            match form {
                Form::Discs(..) => {
                    places.retain(within);
                    put(places);
                }
                Form::Rectangle if !places.iter().any(within) => {}
                Form::Rectangle => put(places.into_iter().map(nearest).collect()),
                Form::Polygon => put(fine(&places, within).into_iter().map(nearest).collect()),
                Form::Line(..) => {
                    // Of places within half a pixel, one.
                    places.dedup_by_key(|(x, y)| [2.0 * *x, 2.0 * *y].map(f64::round));
                    let parts = fine(&places, within);
                    let parts = parts.split(|at| !within(at));
                    parts.for_each(|part| put(part.to_vec()));
                }
            }
        }
        drawn
    }
}

/// A line with a place at each pixel where it leaves an area.
fn fine(places: &[Place], within: impl Fn(&Place) -> bool) -> Vec<Place> {
    let mut all = Vec::new();
    for ends in places.windows(2) {
        let ((a, b), (c, d)) = (ends[0], ends[1]);
        let long = (c - a).hypot(d - b);
        let leaves = long.is_finite() && !ends.iter().all(&within);
        let count = if leaves { long.min(1e5) } else { 1.0 };
        let shares = (1..count as u32).map(|k| f64::from(k) / count);
        all.push(ends[0]);
        all.extend(shares.map(|share| (a + share * (c - a), b + share * (d - b))));
    }
    all.extend(places.last());
    all
}

impl Sheet {
    /// Areas in rows of so many, below a title.
    pub fn new(title: &str, areas: &[Area], columns: usize) -> Self {
        // Measuring words takes long, and a film does it for each picture.
        let rooms: Vec<[f64; 2]> = areas.iter().map(Area::room).collect();
        let [before, after] = [0, 1].map(|side| most(rooms.iter().map(|room| room[side])));
        let pitch = before + most(areas.iter().map(|area| area.size.0)) + after;
        let mut sheet = Self {
            shapes: Vec::new(),
            words: Vec::new(),
            width: LEAST.max(columns.clamp(1, areas.len().max(1)) as f64 * pitch),
            height: 0.5 * MARGIN,
        };
        sheet.note(title, HEADING);
        for row in areas.chunks(columns.max(1)) {
            let start = sheet.height;
            let heads: Vec<Vec<String>> = row.iter().map(Area::head).collect();
            let high = most(heads.iter().map(|head| head.len() as f64));
            let top = start + high * (WORDS + GAP) + GAP;
            for (k, (area, head)) in (0..).zip(row.iter().zip(&heads)) {
                let left = f64::from(k) * pitch + before;
                sheet.lines(head, WORDS, (left, start), HPos::Left);
                let end = sheet.area(area, (left, top));
                sheet.height = sheet.height.max(end + GAP);
            }
        }
        sheet
    }

    /// Draws an area with this corner; where its words end.
    fn area(&mut self, area: &Area, (left, top): Place) -> f64 {
        let grid = RGBColor(225, 225, 225);
        let (right, bottom) = (left + area.size.0, top + area.size.1);
        let mut end = bottom;
        for (share, lines) in area.below() {
            let x = left + share * area.size.0;
            self.line(&[(x, top), (x, bottom)], grid);
            end = end.max(self.lines(&lines, NUMBERS, (x, bottom + GAP), HPos::Center));
        }
        for (share, number) in area.axes[1].numbers(area.size.1, false) {
            let y = bottom - share * area.size.1;
            self.line(&[(left, y), (right, y)], grid);
            let at = (left - GAP, y - 0.5 * (NUMBERS + GAP));
            self.lines(&[number], NUMBERS, at, HPos::Right);
        }
        let axes = [(left, top), (left, bottom), (right, bottom)];
        self.line(&axes, RGBColor(120, 120, 120));
        self.shapes.extend(area.drawn((left, top)));
        let words = wrapped(&area.words[1], WORDS, area.size.0);
        self.lines(&words, WORDS, (0.5 * (left + right), end), HPos::Center)
    }

    pub fn size(&self) -> [u32; 2] {
        [self.width, self.height].map(|side| side.ceil() as u32)
    }

    /// Lines of words below a place, and where they end.
    pub fn lines(&mut self, lines: &[String], size: f64, (x, y): Place, part: HPos) -> f64 {
        let high = size + GAP;
        for (k, line) in (0..).zip(lines) {
            let at = (x, y + (f64::from(k) + 0.5) * high);
            self.words.push(Words(line.clone(), size, at, part));
        }
        y + lines.len() as f64 * high
    }

    /// Words across the sheet.
    pub fn note(&mut self, words: &str, size: f64) {
        let lines = wrapped(words, size, self.width - 2.0 * MARGIN);
        self.height = self.lines(&lines, size, (MARGIN, self.height), HPos::Left);
    }

    pub fn line(&mut self, places: &[Place], colour: RGBColor) {
        let form = Form::Line(1.0, WHOLE);
        self.shapes.push(Shape(places.to_vec(), colour, form));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::axis::Scale;

    impl Sheet {
        /// Words that overlap others or leave the sheet, if there are any.
        pub fn collisions(&self) -> Vec<String> {
            let boxed = |Words(words, size, (x, y), part): &Words| {
                let wide = width(words, *size);
                let left = match part {
                    HPos::Left => *x,
                    HPos::Center => x - 0.5 * wide,
                    HPos::Right => x - wide,
                };
                let bounds = [left, y - 0.5 * size, left + wide, y + 0.5 * size];
                (bounds, words.clone())
            };
            let all: Vec<([f64; 4], String)> = self.words.iter().map(boxed).collect();
            let mut found = Vec::new();
            for (k, (a, words)) in all.iter().enumerate() {
                if a[0] < 0.0 || a[1] < 0.0 || a[2] > self.width || a[3] > self.height {
                    found.push(format!("`{words}` leaves the sheet: {a:?}"));
                }
                for (b, others) in &all[..k] {
                    if a[2] > b[0] && b[2] > a[0] && a[3] > b[1] && b[3] > a[1] {
                        found.push(format!("`{words}` {a:?} overlaps `{others}` {b:?}"));
                    }
                }
            }
            found
        }
    }

    fn drawn(axes: [Axis; 2], points: &[Place], form: Form) -> Vec<Vec<Place>> {
        let area = Area {
            size: (100.0, 100.0),
            axes,
            words: <[String; 3]>::default(),
            names: None,
            shapes: vec![Shape(points.to_vec(), RGBColor(0, 0, 0), form)],
        };
        let shapes = area.drawn((0.0, 0.0)).into_iter();
        shapes.map(|shape| shape.0).collect()
    }

    const LINE: Form = Form::Line(1.0, WHOLE);

    #[test]
    fn what_is_beyond_the_axes_is_cut_off() {
        let axes = [Axis::over([0.0, 100.0], Scale::Linear); 2];
        let square = [
            (-50.0, 50.0),
            (50.0, 50.0),
            (50.0, 150.0),
            (-50.0, 150.0),
            (-50.0, 50.0),
        ];
        let cut = &drawn(axes, &square, Form::Polygon)[0];
        let area = cut.windows(2).map(|p| p[0].0 * p[1].1 - p[1].0 * p[0].1);
        assert!(
            (0.5 * area.sum::<f64>().abs() - 2500.0).abs() < 60.0,
            "{cut:?}"
        );
        assert!(cut.iter().all(|p| p.0 >= 0.0 && p.1 >= 0.0));
        // The line around it stands at two of its sides only.
        let sides = drawn(axes, &square, LINE);
        let places: Vec<_> = sides.into_iter().flatten().collect();
        assert!(
            places.iter().all(|p| p.0 == 50.0 || p.1 == 50.0),
            "{places:?}"
        );
        let discs = drawn(axes, &[(0.0, 100.0), (101.0, 3.0)], Form::Discs(4.0, true));
        assert_eq!(discs, [[(0.0, 0.0)]]);
        let outside = drawn(axes, &[(101.0, 3.0), (103.0, 5.0)], Form::Rectangle);
        assert!(outside.is_empty());
    }

    #[test]
    fn a_line_has_a_gap_where_a_number_has_no_logarithm() {
        let points = [
            (1.0, 1.0),
            (10.0, 10.0),
            (50.0, 0.0),
            (80.0, 10.0),
            (100.0, 5.0),
        ];
        let axes = [Axis::over([1.0, 100.0], Scale::Log); 2];
        let parts = drawn(axes, &points, LINE);
        let parts: Vec<_> = parts.iter().filter(|part| !part.is_empty()).collect();
        assert_eq!(parts.len(), 2, "{parts:?}");
        let last = parts[0].last().unwrap();
        assert!((last.0 - 50.0).hypot(last.1 - 50.0) < 1e-9, "{parts:?}");
        assert_eq!(drawn(axes, &points, Form::Discs(1.0, true))[0].len(), 4);
    }

    #[test]
    fn a_spike_outlives_the_thinning() {
        let at = |k: u32| (f64::from(k) * 0.01, if k == 5000 { 90.0 } else { 10.0 });
        let points: Vec<Place> = (0..10_000).map(at).collect();
        let axes = [Axis::over([0.0, 100.0], Scale::Linear); 2];
        let line = &drawn(axes, &points, LINE)[0];
        assert!(line.iter().any(|p| (p.1 - 10.0).abs() < 1e-9), "the spike");
        assert!(line.len() < 300, "{}", line.len());
    }
}
