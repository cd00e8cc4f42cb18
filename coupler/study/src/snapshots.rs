//! `tandem plot --frames`: pictures of a run's frames.

use std::path::Path;

use coupler::record::frames::vtu::Mesh;
use coupler::record::frames::{Frame, FrameError, times};
use mechanics::expression::{Expression, Meaning};

use crate::StudyError;
use crate::figure::axis;
use crate::figure::file::Kind;
use crate::figure::panels::{Dot, Force, Layout, Panel, draw, film};
use crate::plot::Labelled;

/// What can be said of a point, and its unit, in the order of [`numbers`].
const FIELDS: [(&str, &str); 16] = [
    ("x", "m"),
    ("y", "m"),
    ("vx", "m/s"),
    ("vy", "m/s"),
    ("speed", "m/s"),
    ("stress_xx", "Pa"),
    ("stress_yy", "Pa"),
    ("stress_zz", "Pa"),
    ("stress_xy", "Pa"),
    ("pressure", "Pa"),
    ("volume", "m^2"),
    ("mass", "kg/m"),
    ("density", "kg/m^3"),
    ("group", "1"),
    ("id", "1"),
    ("plastic_strain", "1"),
];
/// The place in [`FIELDS`] of the only one that not every run has.
const PLASTIC_STRAIN: usize = FIELDS.len() - 1;

/// Which frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Which {
    /// All that the run has.
    All,
    /// That of this time in s.
    At(f64),
}

/// What is asked for.
#[derive(Debug, Clone)]
pub struct SnapshotOptions {
    /// Run directories.
    pub runs: Vec<Labelled>,
    /// The frames.
    pub at: Vec<Which>,
    /// What colours say: an expression of the fields of a point.
    pub colour: Labelled,
    /// Values of the first and the last colour; what the points have, where it is left out.
    pub between: Option<[f64; 2]>,
    /// Whether contact forces are drawn.
    pub forces: bool,
    /// First and last x and y in m; as far as anything is, where they are left out.
    pub limits: [[Option<f64>; 2]; 2],
    /// Panels in a row; by default 2, and 1 of a single picture or a film.
    pub columns: Option<usize>,
    /// Pictures a second of a film.
    pub rate: f64,
    /// Above the figure.
    pub title: String,
}

/// Draws the frames to `path`.
///
/// # Errors
/// [`StudyError::Asked`]: a frame cannot be read, or the expression is invalid; [`StudyError::Figure`] and
/// [`StudyError::File`].
pub fn snapshots(options: &SnapshotOptions, path: &Path) -> Result<(), StudyError> {
    let colour = compile(&options.colour.what)?;
    let kind = Kind::of(path)?;
    if !options.between.is_none_or(|[low, high]| low < high) {
        return Err(StudyError::asked("--clim: not in order", "give LOW,HIGH"));
    }
    if options.rate.is_nan() || options.rate <= 0.0 {
        return Err(StudyError::asked(
            format!("--rate {}: not a rate", options.rate),
            "give a number above 0, of pictures a second",
        ));
    }
    let mut panels = Vec::new();
    for run in &options.runs {
        for time in times_of(Path::new(&run.what), &options.at)? {
            let frame = Frame::read(Path::new(&run.what), time).map_err(|e| unread(&e))?;
            let label = run.label.as_ref().map(|label| format!("{label}, "));
            let caption = format!("{}t = {} s", label.unwrap_or_default(), axis::label(time));
            if colour.uses(&|slot| slot == PLASTIC_STRAIN) {
                has_plastic_strain(&run.what, &frame)?;
            }
            let mut panel = panel(caption, &frame, &colour)?;
            if options.forces {
                panel.forces = forces(&frame)?;
            }
            panels.push(panel);
        }
    }
    let dots = || panels.iter().flat_map(|panel| &panel.dots);
    let between = options
        .between
        .unwrap_or_else(|| ends(dots().map(|d| d.value)));
    let outlines = panels
        .iter()
        .flat_map(|panel| panel.outlines.iter().flatten());
    let places: Vec<[f64; 2]> = dots().map(|d| d.at).chain(outlines.copied()).collect();
    let window = [0, 1].map(|axis| {
        let all = ends(places.iter().map(|place| place[axis]));
        [0, 1].map(|k| options.limits[axis][k].unwrap_or(all[k]))
    });
    if let Some([low, high]) = window.into_iter().find(|[low, high]| low >= high) {
        return Err(StudyError::asked(
            format!("nothing is shown from {low} to {high} m"),
            "give --xlim LEFT,RIGHT and --ylim BOTTOM,TOP in m where something is",
        ));
    }
    let window = [[window[0][0], window[1][0]], [window[0][1], window[1][1]]];
    let legend = match (
        &options.colour.label,
        FIELDS.iter().find(|f| f.0 == options.colour.what),
    ) {
        (Some(label), _) => label.clone(),
        (None, Some((name, unit))) if *unit != "1" => format!("{name} [{unit}]"),
        (None, _) => options.colour.what.clone(),
    };
    let legend = if dots().any(|dot| dot.value.is_nan()) {
        format!("{legend}; grey: no number")
    } else {
        legend
    };
    let layout = Layout {
        title: options.title.clone(),
        legend,
        columns: options.columns.unwrap_or_else(|| {
            let at_once = if kind.moves() { 1 } else { panels.len() };
            at_once.min(2)
        }),
        window,
        between,
        largest_force: options.forces.then(|| largest(&panels)),
    };
    if kind.moves() {
        return film(path, &layout, &panels, options.rate);
    }
    draw(path, &layout, &panels)
}

/// The times in s of the frames that are asked for.
fn times_of(run: &Path, wanted: &[Which]) -> Result<Vec<f64>, StudyError> {
    let mut all = Vec::new();
    for which in wanted {
        match which {
            Which::At(time) => all.push(*time),
            Which::All => all.extend(times(run).map_err(|e| unread(&e))?),
        }
    }
    if all.is_empty() {
        let what = format!("{} has no frames", run.display());
        return Err(StudyError::asked(
            what,
            "give `output.frames`, and run again",
        ));
    }
    Ok(all)
}

fn unread(error: &FrameError) -> StudyError {
    StudyError::asked(
        error.to_string(),
        "give `output.frames`, run, and name one of its times",
    )
}

fn compile(text: &str) -> Result<Expression, StudyError> {
    let slot = |name: &str| {
        FIELDS
            .iter()
            .position(|field| field.0 == name)
            .map(Meaning::Slot)
    };
    Expression::compile(text, &slot).map_err(|error| {
        let names = FIELDS.map(|field| field.0).join(", ");
        StudyError::asked(
            format!("`{text}`: {}", error.message),
            format!("a point has {names}"),
        )
    })
}

/// The smallest and the largest number, apart even where there is only one.
fn ends(numbers: impl Iterator<Item = f64>) -> [f64; 2] {
    let none = (f64::INFINITY, f64::NEG_INFINITY);
    let (low, high) = numbers.fold(none, |(low, high), n| (low.min(n), high.max(n)));
    match (low < high, low.is_finite()) {
        (true, _) => [low, high],
        (false, true) => [low, low + low.abs().max(1.0)],
        (false, false) => [0.0, 1.0],
    }
}

fn panel(caption: String, frame: &Frame, colour: &Expression) -> Result<Panel, StudyError> {
    let bodies = frame.bodies.iter().flat_map(Mesh::cells);
    Ok(Panel {
        caption,
        dots: frame
            .points
            .as_ref()
            .map_or(Ok(Vec::new()), |points| dots(points, colour))?,
        outlines: bodies.map(<[_]>::to_vec).collect(),
        forces: Vec::new(),
    })
}

/// Refuses a frame of points without plastic strain.
fn has_plastic_strain(run: &str, frame: &Frame) -> Result<(), StudyError> {
    let points = frame.points.as_ref();
    if points.is_none_or(|points| points.array("plastic_strain").is_some()) {
        return Ok(());
    }
    Err(StudyError::asked(
        format!(
            "the points of {run} have no `plastic_strain` at {} s",
            frame.time
        ),
        "a run has it if one of its materials keeps it (`von_mises`, `mu_i`, sand with `critical_state` or `separates`) \
         and `output.fields` names it or is left out; else choose another quantity for --colour",
    ))
}

/// The contact forces of a frame.
fn forces(frame: &Frame) -> Result<Vec<Force>, StudyError> {
    let told = frame.contacts.as_ref();
    let contacts = told.ok_or_else(|| {
        StudyError::asked(
            format!("the frame at {} s has no contacts", frame.time),
            "run again with `contacts` among `output.fields`, or all of them, and a solver that tells contacts",
        )
    })?;
    let force = contacts.array("force");
    let force = force.ok_or_else(|| StudyError::Figure("contacts without a force".into()))?;
    let strengths = force.values.chunks(force.components);
    let strengths = strengths.map(|f| f.iter().map(|f| f * f).sum::<f64>().sqrt());
    let lines = contacts.cells().zip(strengths);
    Ok(lines
        .filter_map(|(line, strength)| match *line {
            [from, to] => Some(Force {
                between: [from, to],
                strength,
            }),
            _ => None,
        })
        .collect())
}

/// The largest contact force of all panels in N/m.
fn largest(panels: &[Panel]) -> f64 {
    let forces = panels.iter().flat_map(|panel| &panel.forces);
    forces.map(|force| force.strength).fold(0.0, f64::max)
}

fn dots(points: &Mesh, colour: &Expression) -> Result<Vec<Dot>, StudyError> {
    let missing = |name: &str| StudyError::Figure(format!("the frame has no `{name}` of points"));
    let array = |name: &str| points.array(name).ok_or_else(|| missing(name));
    let [velocity, stress, volume, mass, group, id] =
        ["velocity", "stress", "volume", "mass", "group", "id"].map(array);
    let (velocity, stress, volume) = (velocity?, stress?, volume?);
    let (mass, group, id) = (mass?, group?, id?);
    // Whether it is needed was asked before.
    let plastic = points.array("plastic_strain");
    let rows = points.points.iter().enumerate().map(|(k, &[x, y])| {
        let of = |array: &coupler::record::frames::vtu::Array, component: usize| {
            array.values[k * array.components + component]
        };
        let [vx, vy] = [0, 1].map(|c| of(velocity, c));
        let [xx, yy, zz, xy] = [0, 1, 2, 3].map(|c| of(stress, c));
        let pressure = -(xx + yy + zz) / 3.0;
        let volume = of(volume, 0);
        let row = [
            x,
            y,
            vx,
            vy,
            vx.hypot(vy),
            xx,
            yy,
            zz,
            xy,
            pressure,
            volume,
            of(mass, 0),
            of(mass, 0) / volume,
            of(group, 0),
            of(id, 0),
            plastic.map_or(f64::NAN, |strain| of(strain, 0)),
        ];
        Dot {
            at: [x, y],
            side: volume.sqrt(),
            value: colour.evaluate(&row),
        }
    });
    Ok(rows.collect())
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
            ("group + 10*id", 51.0),
            ("100*plastic_strain", 12.5),
        ] {
            let dots = dots(&mesh, &compile(name).unwrap()).unwrap();
            assert_eq!((dots[0].value, dots[0].side), (value, 0.5), "{name}");
        }
        assert!(
            compile("sigma")
                .unwrap_err()
                .to_string()
                .contains("stress_xx")
        );
    }
}
