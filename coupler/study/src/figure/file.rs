//! A figure as a file: SVG, or pixels as PNG and as films, by the name's end.

use std::ffi::OsStr;
use std::path::Path;

use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{Pos, VPos};

use super::shape::{Form, Place, Shape, Words, letters};
use super::sheet::Sheet;
use crate::StudyError;
use crate::output;

/// plotters has whole pixels: an SVG is drawn this much larger, and shown in its size.
const LARGE: u32 = 8;
/// plotters draws words above a place; so far below it, in sizes, their middle is there.
const LOWER: f64 = 0.65;

/// What a file is, by the end of its name: lines and letters (`svg`), pixels (`png`), or a film of 256 colours (`gif`).
pub fn kind(path: &Path) -> Result<&'static str, StudyError> {
    let end = path.extension().and_then(OsStr::to_str).unwrap_or_default();
    let mut kinds = ["svg", "png", "gif"].into_iter();
    let kind = kinds.find(|kind| end.eq_ignore_ascii_case(kind));
    kind.ok_or_else(|| {
        StudyError::usage(
            format!("--out {}: no figure is written as this", path.display()),
            "end its name with .svg or .png; frames also with .gif, as a film",
        )
    })
}

/// Writes a sheet, or sheets of one size as a film of so many pictures a second. Each is made and drawn when it is written: all
/// at once would be gigabytes.
pub(crate) fn write(
    path: &Path,
    mut sheets: impl Iterator<Item = Sheet>,
    rate: f64,
) -> Result<(), StudyError> {
    let first = sheets.next().expect("there is a sheet");
    let bytes = match kind(path)? {
        "svg" => svg(&first)?.into_bytes(),
        "png" => png(&first).map_err(failed)?,
        _ => gif(first, sheets, rate)?,
    };
    output::write(path, bytes)
}

pub(super) fn svg(sheet: &Sheet) -> Result<String, StudyError> {
    let mut text = String::new();
    let [width, height] = sheet.size();
    let large = (LARGE * width, LARGE * height);
    let backend = SVGBackend::with_string(&mut text, large);
    draw(backend, sheet, f64::from(LARGE)).map_err(failed)?;
    let drawn = format!("width=\"{}\" height=\"{}\"", large.0, large.1);
    let shown = format!("width=\"{width}\" height=\"{height}\" stroke-linejoin=\"round\"");
    Ok(text.replacen(&drawn, &shown, 1))
}

/// Twice as many pixels as the sheet has: screens have many.
fn png(sheet: &Sheet) -> Result<Vec<u8>, Box<dyn std::error::Error>> {
    let mut file = Vec::new();
    let [width, height] = sheet.size().map(|side| 2 * side);
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_color(png::ColorType::Rgb);
    let pixels = pixels(sheet, 2)?;
    encoder.write_header()?.write_image_data(&pixels)?;
    Ok(file)
}

fn gif(first: Sheet, more: impl Iterator<Item = Sheet>, rate: f64) -> Result<Vec<u8>, StudyError> {
    let mut file = Vec::new();
    let [width, height] = first.size().map(u16::try_from);
    let (Ok(width), Ok(height)) = (width, height) else {
        return Err(failed("a GIF is at most 65,535 pixels wide and high"));
    };
    let mut film = gif::Encoder::new(&mut file, width, height, &[]).map_err(failed)?;
    film.set_repeat(gif::Repeat::Infinite).map_err(failed)?;
    for sheet in std::iter::once(first).chain(more) {
        let mut frame = gif::Frame::from_rgb_speed(width, height, &pixels(&sheet, 1)?, 10);
        frame.delay = (100.0 / rate).round().clamp(1.0, 6e4) as u16;
        film.write_frame(&frame).map_err(failed)?;
    }
    drop(film);
    Ok(file)
}

/// Red, green and blue of each pixel, row by row from above. Each is the mean of four, since plotters draws slanted edges in
/// steps. Plain loops: this crate is not optimised, and iterators took two thirds of the time of a film.
pub(super) fn pixels(sheet: &Sheet, scale: u32) -> Result<Vec<u8>, StudyError> {
    let [width, height] = sheet.size().map(|side| 2 * scale * side);
    let row = 3 * width as usize;
    let mut fine = vec![0; row * height as usize];
    let backend = BitMapBackend::with_buffer(&mut fine, (width, height));
    draw(backend, sheet, f64::from(2 * scale)).map_err(failed)?;
    let mut colours = Vec::with_capacity(fine.len() / 4);
    for rows in fine.chunks_exact(2 * row) {
        let (upper, lower) = rows.split_at(row);
        for left in (0..row).step_by(6) {
            for c in left..left + 3 {
                let above = u16::from(upper[c]) + u16::from(upper[c + 3]);
                let below = u16::from(lower[c]) + u16::from(lower[c + 3]);
                colours.push(((above + below + 2) / 4) as u8);
            }
        }
    }
    Ok(colours)
}

/// Draws a sheet with so many pixels for one of its own.
fn draw<D: DrawingBackend>(
    backend: D,
    sheet: &Sheet,
    scale: f64,
) -> Result<(), DrawingAreaErrorKind<D::ErrorType>> {
    let root = backend.into_drawing_area();
    let px = |length: f64| (scale * length).round() as i32;
    let at = |(x, y): Place| (px(x), px(y));
    root.fill(&WHITE)?;
    for Shape(places, colour, form) in &sheet.shapes {
        let places: Vec<_> = places.iter().copied().map(at).collect();
        match *form {
            Form::Line(width, (dash, gap)) => {
                let style = colour.stroke_width(px(width).max(1) as u32);
                root.draw(&DashedPathElement::new(places, px(dash), px(gap), style))?;
            }
            Form::Polygon => root.draw(&Polygon::new(places, colour))?,
            Form::Rectangle => {
                root.draw(&Rectangle::new([places[0], places[1]], colour.filled()))?;
            }
            Form::Discs(radius, filled) => {
                let ring = colour.stroke_width(px(1.0) as u32);
                let style = if filled { colour.filled() } else { ring };
                for at in places {
                    root.draw(&Circle::new(at, px(radius), style))?;
                }
            }
        }
    }
    for Words(words, size, (x, y), part) in &sheet.words {
        let style = TextStyle::from(letters(scale * size));
        let style = style.pos(Pos::new(*part, VPos::Bottom));
        let at = at((*x, y + LOWER * size));
        root.draw(&Text::new(words.as_str(), at, style))?;
    }
    root.present()
}

fn failed(error: impl std::fmt::Display) -> StudyError {
    StudyError::Figure(error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::shape::width;
    use plotters::style::text_anchor::HPos;

    fn sheet(colour: RGBColor) -> Sheet {
        let mut sheet = Sheet::new("", &[], 1);
        (sheet.width, sheet.height) = (40.0, 20.0);
        let corners = vec![(10.0, 5.0), (30.0, 15.0)];
        sheet.shapes.push(Shape(corners, colour, Form::Rectangle));
        sheet
    }

    #[test]
    fn an_svg_has_the_size_of_its_sheet() {
        let mut sheet = sheet(RGBColor(0, 0, 0));
        sheet.note("< &", 14.0);
        sheet.height = 20.0;
        let svg = svg(&sheet).unwrap();
        let head =
            "<svg width=\"40\" height=\"20\" stroke-linejoin=\"round\" viewBox=\"0 0 320 160\"";
        assert!(svg.starts_with(head), "{svg}");
        for word in ["\n&lt;\n", "\n&amp;\n"] {
            assert!(svg.contains(word), "{svg}");
        }
    }

    #[test]
    fn pixels_are_those_of_the_sheet() {
        let file = png(&sheet(RGBColor(200, 100, 50))).unwrap();
        let mut picture = png::Decoder::new(std::io::Cursor::new(file))
            .read_info()
            .unwrap();
        let mut colours = vec![0; picture.output_buffer_size().unwrap()];
        let frame = picture.next_frame(&mut colours).unwrap();
        assert_eq!((frame.width, frame.height), (80, 40));
        let at = |x: usize, y: usize| &colours[3 * (80 * y + x)..][..3];
        assert_eq!(at(75, 35), [255; 3]);
        assert_eq!(at(40, 25), [200, 100, 50]);
    }

    #[test]
    fn a_film_has_all_its_pictures() {
        let mut colours = [
            RGBColor(255, 0, 0),
            RGBColor(0, 255, 0),
            RGBColor(0, 0, 255),
        ]
        .map(sheet)
        .into_iter();
        let file = gif(colours.next().unwrap(), colours, 12.5).unwrap();
        let mut options = gif::DecodeOptions::new();
        options.set_color_output(gif::ColorOutput::RGBA);
        let mut film = options.read_info(&file[..]).unwrap();
        let mut seen = Vec::new();
        while let Some(frame) = film.read_next_frame().unwrap() {
            assert_eq!(frame.delay, 8);
            let middle = 4 * (12 * 40 + 25);
            seen.push([0, 1, 2].map(|k| u8::from(frame.buffer[middle + k] > 128)));
        }
        assert_eq!(seen, [[1, 0, 0], [0, 1, 0], [0, 0, 1]]);
    }

    #[test]
    fn words_are_drawn_where_they_were_measured() {
        let words = "Coefficient of restitution [1], 0.123456789e-10 & WMQ (%)";
        let mut sheet = Sheet::new("", &[], 1);
        (sheet.width, sheet.height) = (500.0, 40.0);
        sheet
            .words
            .push(Words(words.into(), 14.0, (10.0, 20.0), HPos::Left));
        let pixels = pixels(&sheet, 1).unwrap();
        let dark = |k: &usize| pixels[3 * k] < 128;
        let dark: Vec<usize> = (0..500 * 40).filter(dark).collect();
        let (left, right) = (
            dark.iter().map(|k| k % 500).min(),
            dark.iter().map(|k| k % 500).max(),
        );
        let end = 10.0 + width(words, 14.0);
        let right = right.unwrap() as f64;
        assert!((9..12).contains(&left.unwrap()), "{left:?}");
        assert!(right <= end + 1.0 && right > end - 5.0, "{right} of {end}");
        let (top, bottom) = (dark[0] / 500, dark[dark.len() - 1] / 500);
        assert!(
            (12..16).contains(&top) && (23..28).contains(&bottom),
            "{top}, {bottom}"
        );
    }
}
