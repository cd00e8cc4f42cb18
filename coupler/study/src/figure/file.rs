//! What is drawn as a file: SVG, or pixels as PNG and as films, by the name's end.

use std::path::Path;
use std::sync::{Arc, OnceLock};

use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree, fontdb};

use super::canvas::Canvas;
use crate::StudyError;
use crate::output;

/// Pixels of a picture for one of the sheet: screens have many.
const FINE: f32 = 2.0;
/// Faces in the order in which letters of a picture are drawn with them, of those that the machine has.
const FACES: [&str; 6] = [
    "DejaVu Sans",
    "Liberation Sans",
    "Arial",
    "Helvetica",
    "Noto Sans",
    "Nimbus Sans",
];

/// What a file is, by the end of its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Lines and letters.
    Svg,
    /// Pixels.
    Png,
    /// Pictures one after another, of 256 colours.
    Gif,
}

impl Kind {
    /// Of a path.
    ///
    /// # Errors
    /// [`StudyError::Asked`] for any other end.
    pub fn of(path: &Path) -> Result<Self, StudyError> {
        let end = path
            .extension()
            .map(|end| end.to_string_lossy().to_lowercase());
        match end.as_deref() {
            Some("svg") => Ok(Self::Svg),
            Some("png") => Ok(Self::Png),
            Some("gif") => Ok(Self::Gif),
            _ => Err(StudyError::asked(
                format!("--out {}: no figure is written as this", path.display()),
                "end its name with .svg or .png; frames also with .gif, as a film",
            )),
        }
    }

    /// Whether it is a film.
    pub fn moves(self) -> bool {
        self == Self::Gif
    }
}

/// Writes a sheet.
pub(super) fn write(path: &Path, canvas: &Canvas) -> Result<(), StudyError> {
    let bytes = match Kind::of(path)? {
        Kind::Svg => canvas.svg().into_bytes(),
        Kind::Png => pixels(canvas, FINE)?.encode_png().map_err(failed)?,
        Kind::Gif => {
            return Err(StudyError::asked(
                format!("--out {}: one figure is no film", path.display()),
                "a film is of frames: `--frames all --out FILE.gif`",
            ));
        }
    };
    output::write(path, bytes)
}

/// Writes sheets of one size as a film that begins anew at its end, each shown for so many hundredths of a second. A sheet is
/// drawn when it is written: all at once would be gigabytes.
pub(super) fn write_film(
    path: &Path,
    sheets: impl Iterator<Item = Result<Canvas, StudyError>>,
    delay: u16,
) -> Result<(), StudyError> {
    let pictures = sheets.map(|sheet| pixels(&sheet?, 1.0));
    output::write(path, gif(pictures, delay)?)
}

fn gif(
    mut pictures: impl Iterator<Item = Result<Pixmap, StudyError>>,
    delay: u16,
) -> Result<Vec<u8>, StudyError> {
    let mut bytes = Vec::new();
    let Some(first) = pictures.next().transpose()? else {
        return Ok(bytes);
    };
    let large = |_| failed("a GIF is at most 65,535 pixels wide and high");
    let width = u16::try_from(first.width()).map_err(large)?;
    let height = u16::try_from(first.height()).map_err(large)?;
    let mut film = gif::Encoder::new(&mut bytes, width, height, &[]).map_err(failed)?;
    film.set_repeat(gif::Repeat::Infinite).map_err(failed)?;
    for picture in std::iter::once(Ok(first)).chain(pictures) {
        let mut all = picture?.data().to_vec();
        let mut frame = gif::Frame::from_rgba_speed(width, height, &mut all, 10);
        frame.delay = delay;
        film.write_frame(&frame).map_err(failed)?;
    }
    drop(film);
    Ok(bytes)
}

fn pixels(canvas: &Canvas, scale: f32) -> Result<Pixmap, StudyError> {
    let letters = letters().ok_or_else(|| {
        StudyError::asked(
            "there is no font on this machine to draw letters with",
            "write an .svg, or install a font such as DejaVu Sans (Debian: fonts-dejavu-core)",
        )
    })?;
    let options = Options {
        fontdb: Arc::clone(letters),
        ..Options::default()
    };
    let tree = Tree::from_str(&canvas.svg(), &options).map_err(failed)?;
    let size = tree.size();
    let side = |length: f32| (length * scale).ceil() as u32;
    let mut pixmap = Pixmap::new(side(size.width()), side(size.height()))
        .ok_or_else(|| failed("it is too large to be drawn as pixels"))?;
    resvg::render(
        &tree,
        Transform::from_scale(scale, scale),
        &mut pixmap.as_mut(),
    );
    Ok(pixmap)
}

/// The machine's fonts; nothing where there are none.
fn letters() -> Option<&'static Arc<fontdb::Database>> {
    static LETTERS: OnceLock<Option<Arc<fontdb::Database>>> = OnceLock::new();
    let letters = LETTERS.get_or_init(|| {
        let mut all = fontdb::Database::new();
        all.load_system_fonts();
        let names: Vec<String> = all
            .faces()
            .flat_map(|face| face.families.iter().map(|(name, _)| name.clone()))
            .collect();
        let known = FACES
            .iter()
            .find(|face| names.iter().any(|name| name == *face));
        let family = known
            .map(ToString::to_string)
            .or_else(|| names.first().cloned())?;
        all.set_sans_serif_family(family);
        Some(Arc::new(all))
    });
    letters.as_ref()
}

fn failed(error: impl std::fmt::Display) -> StudyError {
    StudyError::Figure(error.to_string())
}

/// Boxes of the words as a renderer with the machine's fonts draws them; nothing where there are no fonts.
#[cfg(test)]
pub(super) fn boxes_of_words(canvas: &Canvas) -> Option<Vec<[f32; 4]>> {
    use resvg::usvg::{Group, Node};
    fn collect(group: &Group, found: &mut Vec<[f32; 4]>) {
        for node in group.children() {
            match node {
                Node::Group(group) => collect(group, found),
                Node::Text(text) => {
                    let b = text.abs_bounding_box();
                    found.push([b.left(), b.top(), b.right(), b.bottom()]);
                }
                _ => {}
            }
        }
    }
    let options = Options {
        fontdb: Arc::clone(letters()?),
        ..Options::default()
    };
    let tree = Tree::from_str(&canvas.svg(), &options).expect("what is drawn is SVG");
    let mut found = Vec::new();
    collect(tree.root(), &mut found);
    Some(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::canvas::{Anchor, Colour, Paint};
    use std::fs;

    fn sheet(colour: Colour) -> Canvas {
        let mut canvas = Canvas::new(40.0, 20.0);
        canvas.rectangle((10.0, 5.0), (20.0, 10.0), Paint::Filled(colour));
        canvas
    }

    #[test]
    fn the_file_extension_selects_the_format() {
        assert_eq!(Kind::of(Path::new("a.b/c.PNG")).unwrap(), Kind::Png);
        assert!(Kind::of(Path::new("film.gif")).unwrap().moves());
        for refused in ["a", "a.pdf", "svg"] {
            let said = Kind::of(Path::new(refused)).unwrap_err().to_string();
            assert!(said.contains(".svg or .png"), "{said}");
        }
        let said = write(Path::new("a.gif"), &sheet(Colour(0, 0, 0)))
            .unwrap_err()
            .to_string();
        assert!(said.contains("--frames"), "{said}");
    }

    #[test]
    fn pixels_are_those_of_the_sheet() {
        if letters().is_none() {
            return;
        }
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.png");
        write(&path, &sheet(Colour(200, 100, 50))).unwrap();
        let picture = Pixmap::load_png(&path).unwrap();
        assert_eq!((picture.width(), picture.height()), (80, 40));
        let at = |x, y| {
            let pixel = picture.pixel(x, y).unwrap();
            [pixel.red(), pixel.green(), pixel.blue()]
        };
        assert_eq!(at(5, 5), [255; 3]);
        assert_eq!(at(40, 20), [200, 100, 50]);
    }

    /// Points and colour bars are pictures within the sheet; they were missing from PNG and films.
    #[test]
    fn a_picture_within_the_sheet_is_drawn() {
        let mut canvas = Canvas::new(40.0, 20.0);
        let green = [0, 200, 0];
        canvas
            .picture((10.0, 5.0), (20.0, 10.0), [2, 1], &green.repeat(2))
            .unwrap();
        let picture = pixels(&canvas, 1.0).unwrap();
        let at = |x, y| {
            let pixel = picture.pixel(x, y).unwrap();
            [pixel.red(), pixel.green(), pixel.blue()]
        };
        assert_eq!((at(20, 10), at(2, 2)), (green, [255; 3]));
    }

    #[test]
    fn a_film_has_all_its_pictures() {
        if letters().is_none() {
            return;
        }
        let dir = tempfile::tempdir().unwrap();
        let colours = [Colour(255, 0, 0), Colour(0, 255, 0), Colour(0, 0, 255)];
        let sheets = colours.into_iter().map(|colour| Ok(sheet(colour)));
        let path = dir.path().join("a.gif");
        write_film(&path, sheets, 8).unwrap();
        let mut options = gif::DecodeOptions::new();
        options.set_color_output(gif::ColorOutput::RGBA);
        let mut film = options.read_info(fs::File::open(&path).unwrap()).unwrap();
        let mut seen = Vec::new();
        while let Some(frame) = film.read_next_frame().unwrap() {
            let middle = 4 * (10 * 40 + 20);
            seen.push([0, 1, 2].map(|k| frame.buffer[middle + k] > 128));
        }
        assert_eq!(
            seen,
            [
                [true, false, false],
                [false, true, false],
                [false, false, true]
            ]
        );
    }

    #[test]
    fn words_take_no_more_room_than_was_measured() {
        let mut canvas = Canvas::new(800.0, 60.0);
        let words = "Coefficient of restitution [1], 0.123456789e-10 & WMQ (%)";
        canvas.text(words, 14.0, (5.0, 20.0), Anchor::Start);
        let Some(boxes) = boxes_of_words(&canvas) else {
            return;
        };
        let width = crate::figure::text::width(words, 14.0);
        assert!(
            f64::from(boxes[0][2]) <= 5.0 + 1.01 * width,
            "{boxes:?}, {width}"
        );
        assert!(f64::from(boxes[0][2]) > 5.0 + 0.7 * width);
    }
}
