//! Colours, markers and sizes that all figures share.

use super::canvas::{Anchor, Canvas, Colour, Paint, Place};
use super::text::wrapped;

/// Okabe and Ito's colours, which the colour-blind can distinguish; black last.
const COLOURS: [Colour; 7] = [
    Colour(0, 114, 178),
    Colour(213, 94, 0),
    Colour(0, 158, 115),
    Colour(204, 121, 167),
    Colour(230, 159, 0),
    Colour(86, 180, 233),
    Colour(0, 0, 0),
];
/// Sizes of text in pixels.
pub(super) const HEADING: f64 = 20.0;
pub(super) const WORDS: f64 = 14.0;
pub(super) const NUMBERS: f64 = 13.0;
/// Height of a line of words.
pub(super) const LINE: f64 = 20.0;
/// Room around everything.
pub(super) const MARGIN: f64 = 12.0;

/// The colour of the `k`-th curve.
pub(super) fn colour(k: usize) -> Colour {
    COLOURS[k % COLOURS.len()]
}

/// The marker of the `k`-th curve: a disc, a square, a triangle in turn.
pub(super) fn marker(canvas: &mut Canvas, (x, y): Place, k: usize) {
    let fill = Paint::Filled(colour(k));
    match k % 3 {
        0 => canvas.circle((x, y), 4.0, fill),
        1 => canvas.rectangle((x - 3.6, y - 3.6), (7.2, 7.2), fill),
        _ => canvas.polygon(
            &[(x - 4.6, y + 3.2), (x + 4.6, y + 3.2), (x, y - 4.8)],
            colour(k),
            None,
        ),
    }
}

/// Lines of a heading, as wide as the sheet.
pub(super) fn heading(title: &str, width: f64) -> Vec<String> {
    if title.is_empty() {
        return Vec::new();
    }
    wrapped(title, HEADING, width - 2.0 * MARGIN)
}

/// Height of a heading.
pub(super) fn heading_height(lines: &[String]) -> f64 {
    lines.len() as f64 * 1.3 * HEADING + 0.5 * MARGIN
}

/// Writes a heading at the top of a sheet, or of a part that begins at `top`.
pub(super) fn write_heading(canvas: &mut Canvas, lines: &[String], top: f64) {
    for (k, line) in (0..).zip(lines) {
        let y = top + 0.5 * MARGIN + (f64::from(k) + 0.5) * 1.3 * HEADING;
        canvas.text(line, HEADING, (MARGIN, y), Anchor::Start);
    }
}
