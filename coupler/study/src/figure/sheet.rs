//! A sheet: a title, areas in rows with captions above them, and room below.

use super::area::{Area, Plan};
use super::canvas::{Anchor, Canvas};
use super::style::{HEADING, LINE, MARGIN, WORDS};
use super::text::wrapped;

/// The sheet before it is drawn.
#[derive(Debug, Clone)]
pub(super) struct Sheet {
    title: Vec<String>,
    cells: Vec<(Vec<String>, Plan)>,
    columns: usize,
    pub width: f64,
}

impl Sheet {
    /// Areas with their captions, so many in a row. It is at least `least` pixels wide.
    pub fn new(title: &str, cells: Vec<(&str, Plan)>, columns: usize, least: f64) -> Self {
        let wrap = |(caption, plan): (&str, Plan)| (wrapped(caption, WORDS, plan.size.0), plan);
        let cells: Vec<_> = cells.into_iter().map(wrap).collect();
        let columns = columns.min(cells.len()).max(1);
        let mut sheet = Self {
            title: Vec::new(),
            cells,
            columns,
            width: 0.0,
        };
        sheet.width = (0..columns).map(|k| sheet.wide(k)).sum::<f64>().max(least);
        sheet.title = wrapped(title, HEADING, sheet.width - 2.0 * MARGIN);
        sheet
    }

    fn wide(&self, column: usize) -> f64 {
        let column = self.cells.iter().skip(column).step_by(self.columns);
        column.map(|(_, plan)| plan.outer().0).fold(0.0, f64::max)
    }

    /// Draws it with so many pixels of room below: what it is drawn on, the areas, and where the room begins.
    pub fn draw(&self, below: f64) -> (Canvas, Vec<Area>, f64) {
        let heading = self.title.len() as f64 * 1.3 * HEADING + 0.5 * MARGIN;
        let rows: Vec<(f64, f64)> = (self.cells.chunks(self.columns))
            .map(|row| {
                let captions = row.iter().map(|(caption, _)| caption.len() as f64 * LINE);
                let areas = row.iter().map(|(_, plan)| plan.outer().1);
                (captions.fold(0.0, f64::max), areas.fold(0.0, f64::max))
            })
            .collect();
        let end = heading
            + rows
                .iter()
                .map(|(caption, area)| caption + area)
                .sum::<f64>();
        let mut canvas = Canvas::new(self.width, end + below);
        for (k, line) in (0..).zip(&self.title) {
            let y = 0.5 * MARGIN + (f64::from(k) + 0.5) * 1.3 * HEADING;
            canvas.text(line, HEADING, (MARGIN, y), Anchor::Start);
        }
        let mut areas = Vec::new();
        let mut top = heading;
        for (row, (caption, area)) in self.cells.chunks(self.columns).zip(rows) {
            let mut left = 0.0;
            for (column, (words, plan)) in row.iter().enumerate() {
                for (line, words) in (0..).zip(words) {
                    let y = top + (f64::from(line) + 0.5) * LINE + 0.5 * MARGIN;
                    canvas.text(words, WORDS, (left + plan.around[0], y), Anchor::Start);
                }
                areas.push(plan.draw(&mut canvas, (left, top + caption)));
                left += self.wide(column);
            }
            top += caption + area;
        }
        (canvas, areas, end)
    }
}
