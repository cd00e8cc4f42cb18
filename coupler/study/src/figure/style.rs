//! Colours, markers and sizes that all figures share.

use super::canvas::{Canvas, Colour, Paint, Place};

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
