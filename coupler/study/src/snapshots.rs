//! `tandem plot --frames`: pictures of a run's frames.

use std::path::Path;

use coupler::record::frames::numbers::{Column, Number};
use coupler::record::frames::vtu::Mesh;
use coupler::record::frames::{Frame, FrameError, FrameList};
use mechanics::expression::{Expression, Meaning};
use plotters::style::colors::colormaps::{ColorMap, ViridisRGB};
use plotters::style::text_anchor::HPos;
use plotters::style::{BLACK, RGBColor};

use crate::StudyError;
use crate::figure::axis::{Axis, Scale, extent, label};
use crate::figure::file::{kind, write};
use crate::figure::shape::{Form, GAP, NUMBERS, Place, Shape, WHOLE, WORDS};
use crate::figure::sheet::{Area, MARGIN, Sheet};
use crate::plot_options::{PlotOptions, Which, compile};

/// Where a point is, in m: what expressions may name besides [`Number::ALL`], before them.
const PLACE: [&str; 2] = ["x", "y"];

/// Width in pixels of what the pictures of a row have together, without axes.
const ROW: f64 = 700.0;
/// Width and height of the colours, and how many there are.
const BAR: (f64, f64) = (320.0, 14.0);
const STEPS: u8 = 128;
/// Side in pixels of the smallest square of a point.
const LEAST: f64 = 1.5;
/// Width in pixels of the line of the largest contact force, and of the smallest that is drawn.
const THICKEST: f64 = 6.0;
const FAINTEST: f64 = 0.1;
/// Of force lines; distinct from the colours of points and bodies.
const FORCES: RGBColor = RGBColor(213, 94, 0);
const BODIES: RGBColor = RGBColor(225, 225, 225);
/// Of a point whose value is no number: no colour of Viridis.
const NO_NUMBER: RGBColor = RGBColor(170, 170, 170);

/// A frame: points and contact forces with their numbers, and outlines of bodies.
struct Picture {
    caption: String,
    dots: Vec<Dot>,
    outlines: Vec<Vec<Place>>,
    /// The centres of the two that touch, and the force in N/m.
    forces: Vec<([Place; 2], f64)>,
}

/// A point.
struct Dot {
    at: Place,
    /// Of its square.
    side: f64,
    /// What its colour says.
    value: f64,
}

/// Draws the frames.
///
/// # Errors
/// [`StudyError::Usage`]: a frame cannot be read, or the expression is invalid; [`StudyError::Figure`] and
/// [`StudyError::File`].
pub(crate) fn snapshots(options: &PlotOptions) -> Result<(), StudyError> {
    let path = &options.out;
    let film = kind(path)? == "gif";
    if !options.clim.is_none_or(|[low, high]| low < high) {
        return Err(StudyError::usage("--clim: not in order", "give LOW,HIGH"));
    }
    if options.rate.is_nan() || options.rate <= 0.0 {
        return Err(StudyError::usage(
            format!("--rate {}: not a rate", options.rate),
            "give a number above 0, of pictures a second",
        ));
    }
    let pictures = pictures(options)?;
    let dots = || pictures.iter().flat_map(|picture| &picture.dots);
    let outlines = || pictures.iter().flat_map(|picture| &picture.outlines);
    let corners = || outlines().flatten().copied();
    let places = || dots().map(|dot| dot.at).chain(corners());
    let x = ends(places().map(|place| place.0), options.limits()[0]);
    let y = ends(places().map(|place| place.1), options.limits()[1]);
    if let Some([low, high]) = [x, y].into_iter().find(|[low, high]| low >= high) {
        return Err(StudyError::usage(
            format!("nothing is shown from {low} to {high} m"),
            "give --xlim LEFT,RIGHT and --ylim BOTTOM,TOP in m where something is",
        ));
    }
    let given = options.clim.map_or([None; 2], |ends| ends.map(Some));
    let between = ends(dots().map(|dot| dot.value), given);
    let forces = pictures.iter().flat_map(|picture| &picture.forces);
    let largest = forces.map(|(_, force)| *force).fold(0.0, f64::max);
    let legend = legend(options, dots().any(|dot| dot.value.is_nan()), largest);
    let at_once = if film { 1 } else { pictures.len() };
    let columns = options.columns.unwrap_or(at_once.min(2)).max(1);
    let width = (ROW / columns as f64).round();
    let scale = width / (x[1] - x[0]);
    let height = (scale * (y[1] - y[0])).round().max(1.0);
    let axes = [x, y].map(|range| Axis::over(range, Scale::Linear));
    let sheet = |pictures: &[Picture]| {
        let area = |(k, picture): (usize, &Picture)| {
            // Words stand at the outer pictures only.
            let outer = [
                true,
                k + columns >= pictures.len(),
                k.is_multiple_of(columns),
            ];
            let words = [picture.caption.as_str(), "x [m]", "y [m]"];
            let words = [0, 1, 2].map(|i| if outer[i] { words[i] } else { "" });
            Area {
                size: (width, height),
                axes,
                words: words.map(String::from),
                names: None,
                shapes: picture.shapes(between, scale, largest),
            }
        };
        let areas: Vec<Area> = pictures.iter().enumerate().map(area).collect();
        let mut sheet = Sheet::new(
            options.title.as_deref().unwrap_or_default(),
            &areas,
            columns,
        );
        bar(&mut sheet, between);
        sheet.note(&legend, WORDS);
        sheet.height += MARGIN;
        sheet
    };
    write(path, pictures.chunks(at_once).map(sheet), options.rate)
}

/// The frames that are asked for.
fn pictures(options: &PlotOptions) -> Result<Vec<Picture>, StudyError> {
    let colour = of_point(&options.colour.what)?;
    let mut pictures = Vec::new();
    for run in &options.data {
        let list = FrameList::read(Path::new(&run.what)).map_err(|e| unread(&e))?;
        for time in times_of(&run.what, &list, &options.frames)? {
            let frame = list.frame(time).map_err(|e| unread(&e))?;
            let of = run.label.as_ref().map(|label| format!("{label}, "));
            let caption = format!("{}t = {} s", of.unwrap_or_default(), label(time));
            let dots = frame.points.as_ref().map(|points| dots(points, &colour));
            let dots = dots.unwrap_or(Ok(Vec::new()));
            pictures.push(Picture {
                caption,
                dots: dots.map_err(|name| without(&name, &run.what, time))?,
                outlines: outlines(&frame),
                forces: if options.forces {
                    forces(&frame)?
                } else {
                    Vec::new()
                },
            });
        }
    }
    Ok(pictures)
}

/// What colours say, and lines of contact forces, with the largest in N/m to three digits.
fn legend(options: &PlotOptions, grey: bool, largest: f64) -> String {
    let named = Number::named(&options.colour.what);
    let mut legend = match (&options.colour.label, named) {
        (Some(label), _) => label.clone(),
        (None, Some(n)) if n.unit != "1" => format!("{} [{}]", n.name, n.unit),
        (None, _) => options.colour.what.clone(),
    };
    if grey {
        legend += "; grey: no number";
    }
    if options.forces && largest == 0.0 {
        legend += "; no contact presses";
    } else if options.forces {
        let unit = 10_f64.powf(largest.log10().floor() - 2.0);
        let rounded = label((largest / unit).round() * unit);
        legend = format!("{legend}; lines: contact forces, the thickest {rounded} N/m");
    }
    legend
}

impl Picture {
    /// In m, with so many pixels for one, and the force of the thickest line.
    fn shapes(&self, between: [f64; 2], scale: f64, largest: f64) -> Vec<Shape> {
        let square = |dot: &Dot| {
            let ((x, y), half) = (dot.at, 0.5 * dot.side.max(LEAST / scale));
            let corners = vec![(x - half, y - half), (x + half, y + half)];
            Shape(corners, shade(dot.value, between), Form::Rectangle)
        };
        let mut shapes: Vec<Shape> = self.dots.iter().map(square).collect();
        for outline in &self.outlines {
            let closed = [&outline[..], &outline[..1]].concat();
            shapes.push(Shape(closed.clone(), BODIES, Form::Polygon));
            shapes.push(Shape(closed, BLACK, Form::Line(1.0, WHOLE)));
        }
        for (ends, force) in &self.forces {
            let width = THICKEST * force / largest;
            // Thinner lines are not seen.
            if width >= FAINTEST {
                let form = Form::Line(width, WHOLE);
                shapes.push(Shape(ends.to_vec(), FORCES, form));
            }
        }
        shapes
    }
}

/// The colours and their numbers.
fn bar(sheet: &mut Sheet, between: [f64; 2]) {
    let (left, top) = (4.0 * MARGIN, sheet.height + 0.5 * MARGIN);
    let bottom = top + BAR.1;
    for k in 0..STEPS {
        // Each up to the end, so that there is no gap before the next.
        let begin = left + f64::from(k) / f64::from(STEPS) * BAR.0;
        let colour = shade(f64::from(k), [0.0, f64::from(STEPS - 1)]);
        let rest = vec![(begin, top), (left + BAR.0, bottom)];
        sheet.shapes.push(Shape(rest, colour, Form::Rectangle));
    }
    for (share, number) in Axis::over(between, Scale::Linear).numbers(BAR.0, true) {
        let x = left + share * BAR.0;
        sheet.line(&[(x, bottom), (x, bottom + 0.5 * GAP)], BLACK);
        let below = (x, bottom + GAP);
        sheet.height = sheet.lines(&[number], NUMBERS, below, HPos::Center);
    }
}

/// The colour of a value. One beyond the ends has the colour of the end.
fn shade(value: f64, [from, to]: [f64; 2]) -> RGBColor {
    let share = ((value - from) / (to - from)).clamp(0.0, 1.0);
    if share.is_nan() {
        return NO_NUMBER;
    }
    let steps = f64::from(STEPS - 1);
    ViridisRGB.get_color((share * steps).round() / steps)
}

/// The times in s of the frames that are asked for.
fn times_of(run: &str, list: &FrameList, wanted: &[Which]) -> Result<Vec<f64>, StudyError> {
    let mut all = Vec::new();
    for which in wanted {
        match which {
            Which::At(time) => all.push(*time),
            Which::All => all.extend(list.times()),
        }
    }
    if all.is_empty() {
        let what = format!("{run} has no frames");
        return Err(StudyError::usage(
            what,
            "give `output.frames`, and run again",
        ));
    }
    Ok(all)
}

fn unread(error: &FrameError) -> StudyError {
    StudyError::usage(
        error.to_string(),
        "give `output.frames`, run, and name one of its times",
    )
}

/// An expression of what a point has.
fn of_point(text: &str) -> Result<Expression, StudyError> {
    let names = || PLACE.into_iter().chain(Number::ALL.iter().map(|n| n.name));
    let slot = |name: &str| names().position(|known| known == name).map(Meaning::Slot);
    let help = format!("a point has {}", names().collect::<Vec<_>>().join(", "));
    compile(text, &slot, &help)
}

/// The smallest and the largest number, apart even where there is only one, but for the ends that are given.
fn ends(numbers: impl Iterator<Item = f64>, given: [Option<f64>; 2]) -> [f64; 2] {
    let [low, high] = extent(numbers);
    let all = match (low < high, low.is_finite()) {
        (true, _) => [low, high],
        (false, true) => [low, low + low.abs().max(1.0)],
        (false, false) => [0.0, 1.0],
    };
    [0, 1].map(|k| given[k].unwrap_or(all[k]))
}

/// The outlines of the bodies of a frame.
fn outlines(frame: &Frame) -> Vec<Vec<Place>> {
    let bodies = frame.bodies.iter().flat_map(Mesh::cells);
    let outline = |body: &[[f64; 2]]| body.iter().map(|p| (p[0], p[1])).collect();
    bodies.map(outline).collect()
}

/// Refuses a frame without a number of points.
fn without(name: &str, run: &str, time: f64) -> StudyError {
    let help = match name {
        "plastic_strain" => {
            "a run has it if one of its materials keeps it (`von_mises`, `mu_i`, sand with `critical_state` or `separates`) \
             and `output.fields` names it or is left out; else choose another quantity for --colour"
        }
        _ => "name it in `output.fields`, and run again; or choose another quantity for --colour",
    };
    StudyError::usage(
        format!("the points of {run} have no `{name}` at {time} s"),
        help,
    )
}

/// The contact forces of a frame.
fn forces(frame: &Frame) -> Result<Vec<([Place; 2], f64)>, StudyError> {
    let states = frame.contacts.as_ref();
    let contacts = states.ok_or_else(|| {
        StudyError::usage(
            format!("the frame at {} s has no contacts", frame.time),
            "run again with `contacts` among `output.fields`, or all of them, and a solver that reports contacts",
        )
    })?;
    let force = contacts.array("force");
    let force = force.ok_or_else(|| StudyError::Figure("contacts without a force".into()))?;
    let strengths = force.values.chunks(force.components);
    let strengths = strengths.map(|f| f.iter().map(|f| f * f).sum::<f64>().sqrt());
    let lines = contacts.cells().zip(strengths);
    Ok(lines
        .filter_map(|(line, strength)| match *line {
            [from, to] => Some(([from, to].map(|[x, y]| (x, y)), strength)),
            _ => None,
        })
        .collect())
}

/// The points of a frame, or the number that they lack.
fn dots(points: &Mesh, colour: &Expression) -> Result<Vec<Dot>, String> {
    let column = |name: &str| Column::of(points, name).ok_or_else(|| name.to_owned());
    let volume = column("volume")?;
    let slots = (PLACE.len()..).zip(&Number::ALL);
    let used = slots.filter(|(slot, _)| colour.uses(&|used| used == *slot));
    let used = used.map(|(slot, number)| Ok((slot, column(number.name)?)));
    let used: Vec<(usize, Column)> = used.collect::<Result<_, String>>()?;
    let mut row = [0.0; PLACE.len() + Number::ALL.len()];
    let dot = |(k, &[x, y]): (usize, &[f64; 2])| {
        [row[0], row[1]] = [x, y];
        for (slot, column) in &used {
            row[*slot] = column.at(k);
        }
        Dot {
            at: (x, y),
            side: volume.at(k).sqrt(),
            value: colour.evaluate(&row),
        }
    };
    Ok(points.points.iter().enumerate().map(dot).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use coupler::record::frames::vtu::{Array, Cell};

    #[test]
    fn a_point_has_the_fields_that_the_manual_names() {
        let array =
            |name: &str, components, values: &[f64]| Array::real(name, components, values.to_vec());
        let mesh = Mesh {
            cell: Cell::Vertex,
            points: vec![[1.0, 2.0]],
            ends: vec![1],
            of_points: vec![
                array("velocity", 3, &[3.0, 4.0, 0.0]),
                array("stress", 6, &[-1.0, -2.0, -6.0, 8.0, 0.0, 0.0]),
                array("volume", 1, &[0.25]),
                array("mass", 1, &[7.0]),
                array("group", 1, &[1.0]),
                array("id", 1, &[5.0]),
                array("plastic_strain", 1, &[0.125]),
            ],
            of_cells: Vec::new(),
            names: Vec::new(),
        };
        for (name, value) in [
            ("x + 10*y", 21.0),
            ("vx + 10*vy", 43.0),
            ("speed", 5.0),
            ("pressure", 3.0),
            (
                "stress_xx + 10*stress_yy + 100*stress_zz + 1000*stress_xy",
                7379.0,
            ),
            ("mass/volume", 28.0),
            ("density", 28.0),
            ("shear", 0.5f64.hypot(8.0)),
            ("group + 10*id", 51.0),
            ("100*plastic_strain", 12.5),
        ] {
            let dots = dots(&mesh, &of_point(name).unwrap()).unwrap();
            assert_eq!((dots[0].value, dots[0].side), (value, 0.5), "{name}");
        }
        assert!(
            of_point("sigma")
                .unwrap_err()
                .to_string()
                .contains("stress_xx")
        );
    }

    /// A point at rest, whose `1/speed` is infinite, gave all points one colour.
    #[test]
    fn colours_are_between_the_numbers_that_are_finite() {
        let values = [2.0, f64::INFINITY, 1.0, f64::NAN];
        assert_eq!(ends(values.into_iter(), [None; 2]), [1.0, 2.0]);
    }

    #[test]
    fn a_point_is_a_square_of_its_size_and_colour() {
        let dot = |value| Dot {
            at: (0.5, 0.75),
            side: 0.2,
            value,
        };
        let picture = Picture {
            caption: String::new(),
            dots: vec![dot(0.0), dot(9.0), dot(f64::NAN)],
            outlines: vec![vec![(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]],
            forces: vec![
                ([(0.0, 0.0), (1.0, 1.0)], 6.0),
                ([(0.0, 0.0), (1.0, 0.0)], 0.01),
            ],
        };
        let shapes = picture.shapes([0.0, 1.0], 100.0, 6.0);
        let colours = [0, 1, 2].map(|k| shapes[k].1);
        assert_eq!(
            colours,
            [RGBColor(68, 1, 84), RGBColor(254, 232, 37), NO_NUMBER]
        );
        assert_eq!(shapes[0].0, [(0.4, 0.65), (0.6, 0.85)]);
        // The outline closes; the weaker force is not seen.
        assert_eq!((shapes[3].0.len(), shapes[4].0.len()), (4, 4));
        assert!(matches!(shapes[5].2, Form::Line(6.0, _)) && shapes.len() == 6);
    }

    #[test]
    fn no_words_of_pictures_overlap() {
        let long =
            "t = 0.2 s of a run with a name that is longer than its picture is wide, much longer";
        for columns in [1, 2, 3, 5] {
            for height in [30.0, 400.0] {
                for between in [[0.0, 1.0], [1.234_567e-7, 1.234_569e-7], [-3e9, 2e12]] {
                    let axes = [[0.0, 2.0], between].map(|range| Axis::over(range, Scale::Linear));
                    let area = |k: usize| Area {
                        size: ((ROW / columns as f64).round(), height),
                        axes,
                        words: [["short", long][k % 2], "x [m]", "y [m]"].map(String::from),
                        names: None,
                        shapes: Vec::new(),
                    };
                    let areas: Vec<Area> = (0..5).map(area).collect();
                    let mut sheet = Sheet::new(&long.repeat(2), &areas, columns);
                    bar(&mut sheet, between);
                    sheet.note(&format!("a pressure {long}"), WORDS);
                    assert_eq!(sheet.collisions(), Vec::<String>::new());
                }
            }
        }
    }
}
