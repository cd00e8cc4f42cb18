//! What a figure is made of, shapes and words, and the size of words.

use std::sync::Once;

use plotters::style::{FontDesc, FontStyle, IntoFont, RGBColor, register_font, text_anchor::HPos};

/// A place: a pair of numbers, or pixels from the upper left corner.
pub(crate) type Place = (f64, f64);

/// Sizes of text in pixels.
pub(super) const HEADING: f64 = 20.0;
pub(crate) const WORDS: f64 = 14.0;
pub(crate) const NUMBERS: f64 = 13.0;
/// Between an axis and its numbers, and between lines.
pub(crate) const GAP: f64 = 6.0;
/// The size that plotters wants for letters of size 1: it shrinks them, as pixels by 1.16 and in SVG by 1.24.
const FONT: f64 = 1.2;

/// What is drawn at places: in the numbers of an area's axes, or in pixels.
pub(crate) struct Shape(pub Vec<Place>, pub RGBColor, pub Form);

/// Lengths are in pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Form {
    /// A line of a width, with the lengths of its dashes and gaps.
    Line(f64, (f64, f64)),
    Polygon,
    /// Between two corners.
    Rectangle,
    /// Discs of a radius, or rings.
    Discs(f64, bool),
}

/// Without gaps.
pub(crate) const WHOLE: (f64, f64) = (1e5, 0.0);

/// Words of a size, of which the start, the middle or the end is at a place.
pub(super) struct Words(pub String, pub f64, pub Place, pub HPos);

/// The letters, on every machine the same.
pub(super) fn letters(size: f64) -> FontDesc<'static> {
    static REGISTERED: Once = Once::new();
    REGISTERED.call_once(|| {
        let file = include_bytes!("font/DejaVuSans.ttf");
        assert!(register_font("sans-serif", FontStyle::Normal, file).is_ok());
    });
    ("sans-serif", FONT * size).into_font()
}

/// Width of a line of words of this size.
pub(super) fn width(words: &str, size: f64) -> f64 {
    // plotters counts whole pixels.
    let size_of = letters(100.0).box_size(words);
    0.01 * size * f64::from(size_of.expect("the font is registered").0)
}

/// The words in lines of at most this width, none if there are no words. A word that is wider is cut.
pub(super) fn wrapped(words: &str, size: f64, most: f64) -> Vec<String> {
    let (mut lines, mut line) = (Vec::new(), String::new());
    let fits = |line: &str| width(line.trim_start(), size) <= most;
    for word in words.split_whitespace() {
        let longer = format!("{line} {word}");
        if fits(&longer) {
            line = longer;
            continue;
        }
        lines.push(std::mem::take(&mut line));
        for letter in word.chars() {
            if !fits(&format!("{line}{letter}")) {
                lines.push(std::mem::take(&mut line));
            }
            line.push(letter);
        }
    }
    lines.push(line);
    let lines = lines.iter().map(|line| line.trim_start().to_owned());
    lines.filter(|line| !line.is_empty()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_no_wider_than_they_may_be_and_lose_nothing() {
        let words = "error of \"largest error\", of the reference, averylongwordwithoutanyspace";
        for most in [60.0, 100.0, 1000.0] {
            let lines = wrapped(words, 14.0, most);
            assert!(
                lines.iter().all(|line| width(line, 14.0) <= most),
                "{lines:?}"
            );
            let letters = |text: &str| text.replace(' ', "");
            assert_eq!(letters(&lines.concat()), letters(words));
        }
        assert_eq!(wrapped(words, 14.0, 1000.0), [words]);
        assert!(wrapped("", 14.0, 10.0).is_empty());
    }
}
