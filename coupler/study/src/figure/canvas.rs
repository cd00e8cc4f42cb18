//! A sheet on which lines, areas, words and pictures are put; an SVG file, or pixels of it.

use std::fmt::Write as _;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::text;
use crate::StudyError;

/// A place in pixels, from the upper left corner.
pub(super) type Place = (f64, f64);

/// Red, green and blue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Colour(pub u8, pub u8, pub u8);

/// Black.
pub(super) const BLACK: Colour = Colour(0, 0, 0);

/// How a line is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stroke {
    pub colour: Colour,
    pub width: f64,
    /// Lengths of a dash and of the gap after it.
    pub dashes: Option<(f64, f64)>,
}

/// How a shape is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Paint {
    Filled(Colour),
    Outlined(Stroke),
}

/// Where the words are from their place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Anchor {
    /// They begin there.
    Start,
    /// Their middle is there.
    Middle,
    /// They end there.
    End,
}

/// A box: left, top, right, bottom.
pub(super) type Bounds = [f64; 4];

/// The sheet.
#[derive(Debug, Clone)]
pub(super) struct Canvas {
    size: (f64, f64),
    body: String,
    clips: usize,
    /// What the words take up, and the words.
    words: Vec<(Bounds, String)>,
}

/// A number of pixels, to a hundredth.
fn px(number: f64) -> String {
    let text = format!("{number:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" {
        "0".to_owned()
    } else {
        text.to_owned()
    }
}

fn points(places: &[Place]) -> String {
    let pairs: Vec<String> = places
        .iter()
        .map(|p| format!("{},{}", px(p.0), px(p.1)))
        .collect();
    pairs.join(" ")
}

fn escaped(words: &str) -> String {
    words
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

impl Colour {
    fn hex(self) -> String {
        format!("#{:02X}{:02X}{:02X}", self.0, self.1, self.2)
    }
}

impl Stroke {
    /// A line without gaps.
    pub fn of(colour: Colour, width: f64) -> Self {
        Self {
            colour,
            width,
            dashes: None,
        }
    }

    fn attributes(self) -> String {
        let mut text = format!(
            "fill=\"none\" stroke=\"{}\" stroke-width=\"{}\"",
            self.colour.hex(),
            px(self.width)
        );
        if let Some((dash, gap)) = self.dashes {
            let _ = write!(text, " stroke-dasharray=\"{} {}\"", px(dash), px(gap));
        }
        text
    }
}

impl Paint {
    fn attributes(self) -> String {
        match self {
            Self::Filled(colour) => format!("fill=\"{}\"", colour.hex()),
            Self::Outlined(stroke) => stroke.attributes(),
        }
    }
}

impl Canvas {
    /// A white sheet of this size in pixels.
    pub fn new(width: f64, height: f64) -> Self {
        let mut canvas = Self {
            size: (width.ceil(), height.ceil()),
            body: String::new(),
            clips: 0,
            words: Vec::new(),
        };
        let size = canvas.size;
        canvas.rectangle((0.0, 0.0), size, Paint::Filled(Colour(255, 255, 255)));
        canvas
    }

    fn add(&mut self, element: &str) {
        self.body.push_str(element);
        self.body.push('\n');
    }

    /// A line through these places.
    pub fn line(&mut self, places: &[Place], stroke: Stroke) {
        let element = format!(
            "<polyline points=\"{}\" {} stroke-linejoin=\"round\"/>",
            points(places),
            stroke.attributes()
        );
        self.add(&element);
    }

    /// An area with these corners.
    pub fn polygon(&mut self, places: &[Place], fill: Colour, outline: Option<Stroke>) {
        let mut attributes = format!("fill=\"{}\"", fill.hex());
        if let Some(Stroke { colour, width, .. }) = outline {
            let _ = write!(
                attributes,
                " stroke=\"{}\" stroke-width=\"{}\"",
                colour.hex(),
                px(width)
            );
        }
        self.add(&format!(
            "<polygon points=\"{}\" {attributes}/>",
            points(places)
        ));
    }

    /// A circle.
    pub fn circle(&mut self, (x, y): Place, radius: f64, paint: Paint) {
        let element = format!(
            "<circle cx=\"{}\" cy=\"{}\" r=\"{}\" {}/>",
            px(x),
            px(y),
            px(radius),
            paint.attributes()
        );
        self.add(&element);
    }

    /// A rectangle from its upper left corner.
    pub fn rectangle(&mut self, (x, y): Place, (width, height): (f64, f64), paint: Paint) {
        let element = format!(
            "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" {}/>",
            px(x),
            px(y),
            px(width),
            px(height),
            paint.attributes()
        );
        self.add(&element);
    }

    /// Words of a size in pixels, the middle of their height at this place.
    pub fn text(&mut self, words: &str, size: f64, (x, y): Place, anchor: Anchor) {
        self.put(words, size, (x, y), anchor, "");
        let width = text::width(words, size);
        let left = match anchor {
            Anchor::Start => x,
            Anchor::Middle => x - 0.5 * width,
            Anchor::End => x - width,
        };
        let bounds = [left, y - 0.5 * size, left + width, y + 0.5 * size];
        self.words.push((bounds, words.to_owned()));
    }

    /// Words from below upwards, their middle at this place.
    pub fn upright(&mut self, words: &str, size: f64, (x, y): Place) {
        let turn = format!(" transform=\"rotate(-90 {} {})\"", px(x), px(y));
        self.put(words, size, (x, y), Anchor::Middle, &turn);
        let half = 0.5 * text::width(words, size);
        let bounds = [x - 0.5 * size, y - half, x + 0.5 * size, y + half];
        self.words.push((bounds, words.to_owned()));
    }

    fn put(&mut self, words: &str, size: f64, (x, y): Place, anchor: Anchor, more: &str) {
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        // The base line is below the middle by about a third of the size.
        let element = format!(
            "<text x=\"{}\" y=\"{}\" text-anchor=\"{anchor}\" font-family=\"sans-serif\" font-size=\"{}\"{more}>{}</text>",
            px(x),
            px(y + 0.35 * size),
            px(size),
            escaped(words)
        );
        self.add(&element);
    }

    /// A picture of `columns` by `rows` pixels with its upper left corner here, drawn in this size; red, green and blue of
    /// each pixel, row by row from above.
    pub fn picture(
        &mut self,
        (x, y): Place,
        (width, height): (f64, f64),
        [columns, rows]: [usize; 2],
        pixels: &[u8],
    ) -> Result<(), StudyError> {
        let png =
            encoded([columns, rows], pixels).map_err(|e| StudyError::Figure(e.to_string()))?;
        let element = format!(
            "<image x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" preserveAspectRatio=\"none\" href=\"data:image/png;base64,{}\"/>",
            px(x),
            px(y),
            px(width),
            px(height),
            STANDARD.encode(png)
        );
        self.add(&element);
        Ok(())
    }

    /// Draws what is within a rectangle only.
    pub fn clipped(
        &mut self,
        (x, y): Place,
        (width, height): (f64, f64),
        draw: impl FnOnce(&mut Self),
    ) {
        self.clips += 1;
        let name = format!("clip{}", self.clips);
        let element = format!(
            "<clipPath id=\"{name}\"><rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"/></clipPath>\n<g clip-path=\"url(#{name})\">",
            px(x),
            px(y),
            px(width),
            px(height)
        );
        self.add(&element);
        draw(self);
        self.add("</g>");
    }

    /// The file.
    pub fn svg(&self) -> String {
        let (width, height) = (px(self.size.0), px(self.size.1));
        format!(
            "<svg width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" xmlns=\"http://www.w3.org/2000/svg\">\n{}</svg>\n",
            self.body
        )
    }

    /// Words that overlap others or leave the sheet, if there are any.
    #[cfg(test)]
    pub fn collisions(&self) -> Vec<String> {
        let apart =
            |a: &Bounds, b: &Bounds| a[2] <= b[0] || b[2] <= a[0] || a[3] <= b[1] || b[3] <= a[1];
        let mut found = Vec::new();
        for (k, (bounds, words)) in self.words.iter().enumerate() {
            let [left, top, right, bottom] = *bounds;
            if left < 0.0 || top < 0.0 || right > self.size.0 || bottom > self.size.1 {
                found.push(format!("`{words}` leaves the sheet: {bounds:?}"));
            }
            for (other, others) in &self.words[..k] {
                if !apart(bounds, other) {
                    found.push(format!(
                        "`{words}` {bounds:?} overlaps `{others}` {other:?}"
                    ));
                }
            }
        }
        found
    }
}

/// A PNG file of red, green and blue.
fn encoded([columns, rows]: [usize; 2], pixels: &[u8]) -> Result<Vec<u8>, png::EncodingError> {
    let side = |n: usize| u32::try_from(n).expect("no picture has 2^32 rows");
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, side(columns), side(rows));
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(pixels)?;
    writer.finish()?;
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_that_overlap_or_leave_the_sheet_are_found() {
        let mut canvas = Canvas::new(200.0, 100.0);
        canvas.text("left", 14.0, (10.0, 20.0), Anchor::Start);
        canvas.text("right", 14.0, (190.0, 20.0), Anchor::End);
        canvas.upright("up", 14.0, (100.0, 50.0));
        assert_eq!(canvas.collisions(), Vec::<String>::new());
        canvas.text("over left", 14.0, (20.0, 22.0), Anchor::Start);
        canvas.text("over up", 14.0, (95.0, 50.0), Anchor::Start);
        assert_eq!(canvas.collisions().len(), 2, "{:?}", canvas.collisions());
        canvas.upright("out of the sheet by much", 14.0, (150.0, 70.0));
        assert!(
            canvas
                .collisions()
                .iter()
                .any(|c| c.contains("leaves the sheet"))
        );
    }

    #[test]
    fn words_are_escaped_and_numbers_short() {
        let mut canvas = Canvas::new(10.0, 10.0);
        canvas.text("a < b & c", 1.0, (1.0 / 3.0, -0.001), Anchor::Start);
        let svg = canvas.svg();
        assert!(svg.contains(">a &lt; b &amp; c</text>"), "{svg}");
        assert!(svg.contains("x=\"0.33\" y=\"0.35\""), "{svg}");
        assert!(!svg.contains("-0\""));
    }
}
