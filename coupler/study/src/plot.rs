//! `tandem plot`: curves out of what runs and studies have written.

use std::path::PathBuf;

use mechanics::expression::{Expression, Meaning};
use plotters::style::BLACK;

use coupler::record::Table;

use crate::StudyError;
use crate::figure::axis::{Scale, extent};
use crate::figure::chart::{CURVE, Chart, DISCS, Panel, Series};
use crate::figure::file::kind;
use crate::figure::shape::Form;
use crate::plot_options::{Labelled, PlotOptions, compile};
use crate::snapshots::snapshots;

/// Points of an expected curve.
const EXPECTED: usize = 401;
/// Its dash and gap in pixels: each has others.
const DASHES: [(f64, f64); 4] = [(8.0, 5.0), (2.0, 4.0), (16.0, 5.0), (5.0, 9.0)];

/// Rows that have the same text, if they were grouped by one, and their points.
type Group<'a> = (Option<&'a str>, Vec<(f64, f64)>);

/// The curves of the data, and the units of x and y.
fn measured(options: &PlotOptions) -> Result<(Vec<Series>, [String; 2]), StudyError> {
    let mut curves: Vec<Series> = Vec::new();
    let mut units: Option<[String; 2]> = None;
    let many = (options.data.len() > 1, options.y.len() > 1);
    for data in &options.data {
        let table = read(&data.what)?;
        for y in &options.y {
            let [across, up] = [&options.x, &y.what].map(|e| over(&table, e));
            let rows = points(&table, &across?, &up?);
            for (group, points) in grouped(&table, options.by.as_deref(), rows)? {
                let mut words: Vec<&str> = Vec::new();
                words.extend((many.0 || data.label.is_some()).then_some(data.name()));
                words.extend((many.1 || y.label.is_some()).then_some(y.name()));
                words.extend(group);
                if words.is_empty() {
                    words.push(y.name());
                }
                let label = words.join(", ");
                let points = match options.slope {
                    Some(width) => slope(&points, width, &label)?,
                    None => points,
                };
                let points: Vec<(f64, f64)> =
                    points.into_iter().filter(|p| options.shows(*p)).collect();
                if points.is_empty() {
                    return Err(StudyError::usage(
                        format!("`{label}` has nothing to draw"),
                        "check the columns, --xlim, --slope, and that what has a logarithmic axis is above 0",
                    ));
                }
                curves.push(Series {
                    label,
                    colour: None,
                    forms: vec![if options.dots { DISCS } else { CURVE }],
                    points: vec![points],
                });
            }
            let unit = |e: &str| table.column(e).map_or_else(String::new, |c| c.unit.clone());
            let of_curve = [unit(&options.x), unit(&y.what)];
            // An axis has a unit if all curves have it.
            let shared = units.get_or_insert_with(|| of_curve.clone());
            for (unit, own) in shared.iter_mut().zip(of_curve) {
                if *unit != own {
                    unit.clear();
                }
            }
        }
    }
    let [across, mut up] = units.unwrap_or_default();
    if options.slope.is_some() {
        up = quotient(&up, &across);
    }
    Ok((curves, [across, up]))
}

/// Draws curves, or frames where these are asked for.
///
/// # Errors
/// [`StudyError::Usage`]: data cannot be read, a name is no column, or nothing is there to be drawn; [`StudyError::Figure`]
/// and [`StudyError::File`].
pub fn plot(options: &PlotOptions) -> Result<(), StudyError> {
    let path = &options.out;
    if !options.frames.is_empty() {
        return snapshots(options);
    }
    if kind(path)? == "gif" {
        return Err(StudyError::usage(
            format!("--out {}: one figure is no film", path.display()),
            "a film is of frames: `--frames all --out FILE.gif`",
        ));
    }
    options.assert_sound()?;
    let (mut curves, [x_unit, y_unit]) = measured(options)?;
    let across = extent(curves.iter().flat_map(|c| &c.points[0]).map(|p| p.0));
    for (line, dashes) in options.expected.iter().zip(DASHES.into_iter().cycle()) {
        let form = Form::Line(1.3, dashes);
        curves.push(expected(line, across, options.scales()[0], form)?);
    }
    let with_unit = |e: &str, unit: &str| match unit {
        "" | "1" => e.to_owned(),
        unit => format!("{e} [{unit}]"),
    };
    let x = || with_unit(&options.x, &x_unit);
    let of = options.slope.map_or("", |_| "slope of ");
    let y = || match &options.y[..] {
        [only] => with_unit(&format!("{of}{}", only.what), &y_unit),
        _ => y_unit.clone(),
    };
    let panel = Panel {
        words: [
            String::new(),
            options.xlabel.clone().unwrap_or_else(x),
            options.ylabel.clone().unwrap_or_else(y),
        ],
        scales: options.scales().map(Some),
        limits: options.limits(),
    };
    let named_after = || {
        let name = path.file_stem().unwrap_or_default();
        name.to_string_lossy().into_owned()
    };
    let chart = Chart {
        title: options.title.clone().unwrap_or_else(named_after),
        panels: vec![panel],
        series: curves,
        ..Chart::default()
    };
    chart.draw(path)
}

impl PlotOptions {
    /// How numbers lie along x and y.
    fn scales(&self) -> [Scale; 2] {
        [self.xlog, self.ylog].map(|log| if log { Scale::Log } else { Scale::Linear })
    }

    fn assert_sound(&self) -> Result<(), StudyError> {
        for (axis, name) in ["x", "y"].into_iter().enumerate() {
            let below_zero = |end: &Option<f64>| end.is_some_and(|end| end <= 0.0);
            if self.scales()[axis] == Scale::Log && self.limits()[axis].iter().any(below_zero) {
                return Err(StudyError::usage(
                    format!("--{name}lim: a logarithmic axis is above 0"),
                    format!("give ends above 0, or leave out --{name}log"),
                ));
            }
        }
        Ok(())
    }

    /// Whether a point is where x is shown, and has a place there.
    fn shows(&self, (x, y): (f64, f64)) -> bool {
        let ([from, to], scales) = (self.limits()[0], self.scales());
        let has = |scale: Scale, number: f64| scale == Scale::Linear || number > 0.0;
        from.is_none_or(|from| x >= from)
            && to.is_none_or(|to| x <= to)
            && has(scales[0], x)
            && has(scales[1], y)
    }
}

/// The table of a run directory or of a file.
fn read(data: &str) -> Result<Table, StudyError> {
    let mut path = PathBuf::from(data);
    let table = if path.is_dir() {
        let table = Table::of_run(&path, "history.csv");
        path.push("history.csv");
        table
    } else {
        Table::read(&path)
    };
    table.map_err(|error| {
        StudyError::usage(
            format!("cannot read {}: {error}", path.display()),
            "give a run directory or a CSV file, as PATH or LABEL=PATH",
        )
    })
}

/// An expression over the columns of a table.
fn over(table: &Table, text: &str) -> Result<Expression, StudyError> {
    let column = |name: &str| match name {
        "t" => table.index("t").or_else(|| table.index("time")),
        name => table.index(name),
    };
    let columns = format!("the columns are {}", table.names());
    // The name of a column may be none of an expression: `stepping cpu`.
    match table.index(text) {
        Some(k) => compile("it", &|_| Some(Meaning::Slot(k)), &columns),
        None => compile(text, &|name| column(name).map(Meaning::Slot), &columns),
    }
}

/// x and y of each row, in their order.
fn points(table: &Table, x: &Expression, y: &Expression) -> Vec<(f64, f64)> {
    let rows = table.numbers();
    rows.map(|row| (x.evaluate(&row), y.evaluate(&row)))
        .collect()
}

/// The finite points of each group of rows, in the order in which the groups first appear.
fn grouped<'a>(
    table: &'a Table,
    by: Option<&str>,
    rows: Vec<(f64, f64)>,
) -> Result<Vec<Group<'a>>, StudyError> {
    let finite = |p: &(f64, f64)| p.0.is_finite() && p.1.is_finite();
    let Some(by) = by else {
        return Ok(vec![(None, rows.into_iter().filter(finite).collect())]);
    };
    let column = table.column(by).ok_or_else(|| {
        StudyError::usage(
            format!("--by {by} is no column"),
            format!("the columns are {}", table.names()),
        )
    })?;
    let mut groups: Vec<Group> = Vec::new();
    let names = column.cells.iter().map(String::as_str);
    for (name, point) in names.zip(rows).filter(|(_, p)| finite(p)) {
        match groups.iter_mut().find(|(known, _)| *known == Some(name)) {
            Some((_, points)) => points.push(point),
            None => groups.push((Some(name), vec![point])),
        }
    }
    Ok(groups)
}

/// The slope of a curve: its change over a width around each point, for those that are half of it away from both ends.
fn slope(points: &[(f64, f64)], width: f64, label: &str) -> Result<Vec<(f64, f64)>, StudyError> {
    if width.is_nan() || width <= 0.0 {
        return Err(StudyError::usage(
            format!("--slope {width}: not a width"),
            "give a number above 0, in the unit of x",
        ));
    }
    if points.windows(2).any(|pair| pair[1].0 <= pair[0].0) {
        return Err(StudyError::usage(
            format!("`{label}` has no slope: x does not grow from row to row"),
            "--slope is along what grows, such as time",
        ));
    }
    let between = |x: f64| -> Option<f64> {
        let k = points.partition_point(|p| p.0 < x);
        match (k.checked_sub(1).map(|j| points[j]), points.get(k)) {
            (_, Some(&(at, y))) if at == x => Some(y),
            (Some((a, low)), Some(&(b, high))) => Some(low + (high - low) * (x - a) / (b - a)),
            _ => None,
        }
    };
    let of = |&(x, _): &(f64, f64)| {
        let (low, high) = (between(x - 0.5 * width)?, between(x + 0.5 * width)?);
        Some((x, (high - low) / width))
    };
    Ok(points.iter().filter_map(of).collect())
}

/// The unit of a slope; none if one of the two is not known.
fn quotient(up: &str, across: &str) -> String {
    let whole = |unit: &str| {
        if unit.contains(['/', ' ']) {
            format!("({unit})")
        } else {
            unit.to_owned()
        }
    };
    match (up, across) {
        ("", _) | (_, "") => String::new(),
        (_, "1") => up.to_owned(),
        _ => format!("{}/{}", whole(up), whole(across)),
    }
}

/// An expression of `x` from the first to the last of what is drawn.
fn expected(
    line: &Labelled,
    [first, last]: [f64; 2],
    scale: Scale,
    form: Form,
) -> Result<Series, StudyError> {
    let help = "an expected curve is an expression of `x`, such as `--expected \"weight=25\"`";
    let is_x = |name: &str| (name == "x").then_some(Meaning::Slot(0));
    let y = compile(&line.what, &is_x, help)?;
    let count = if y.as_number().is_some() { 2 } else { EXPECTED };
    let at = |k: usize| {
        let share = k as f64 / (count - 1) as f64;
        match scale {
            Scale::Linear => first + (last - first) * share,
            Scale::Log => first * (last / first).powf(share),
        }
    };
    let points = (0..count).map(|k| (at(k), y.evaluate(&[at(k)])));
    let points: Vec<(f64, f64)> = points.filter(|p| p.1.is_finite()).collect();
    if points.is_empty() {
        return Err(StudyError::usage(
            format!("`{}` is nowhere a number", line.what),
            help,
        ));
    }
    Ok(Series {
        label: line.name().to_owned(),
        colour: Some(BLACK),
        forms: vec![form],
        points: vec![points],
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const HISTORY: &str = "time [s],work [J/m],run\n0,0,a\n1,1,b\n2,4,a\n3,9,b\n4,,a\n";

    #[test]
    fn rows_become_points_by_group_and_gaps_are_left_out() {
        let table = Table::parse(HISTORY).unwrap();
        let [x, y] = ["t", "2*work"].map(|e| over(&table, e).unwrap());
        let rows = points(&table, &x, &y);
        assert_eq!(rows[..2], [(0.0, 0.0), (1.0, 2.0)]);
        let all = grouped(&table, None, rows.clone()).unwrap();
        assert_eq!(all[0].1.len(), 4);
        let groups = grouped(&table, Some("run"), rows.clone()).unwrap();
        assert_eq!(groups[0], (Some("a"), vec![(0.0, 0.0), (2.0, 8.0)]));
        assert_eq!(groups[1], (Some("b"), vec![(1.0, 2.0), (3.0, 18.0)]));
        for refused in [
            over(&table, "speed").map(drop),
            grouped(&table, Some("n"), rows).map(drop),
        ] {
            let message = refused.unwrap_err().to_string();
            assert!(message.contains("time, work, run"), "{message}");
        }
    }

    #[test]
    fn the_slope_of_a_parabola_is_a_line() {
        let parabola: Vec<(f64, f64)> = (0..=4).map(f64::from).map(|x| (x, x * x)).collect();
        let slopes = slope(&parabola, 2.0, "work").unwrap();
        assert_eq!(slopes, [(1.0, 2.0), (2.0, 4.0), (3.0, 6.0)]);
        // Between rows the curve is a polygon.
        let narrow = slope(&parabola, 1.0, "work").unwrap();
        assert_eq!(narrow, [(1.0, 2.0), (2.0, 4.0), (3.0, 6.0)]);
        let back: Vec<(f64, f64)> = parabola.into_iter().rev().collect();
        assert!(slope(&back, 1.0, "work").is_err());
    }

    #[test]
    fn an_expected_curve_is_drawn_where_it_is_a_number() {
        let expected =
            |line: &Labelled, first, last| expected(line, [first, last], Scale::Linear, CURVE);
        let line = Labelled::from("law=sqrt(x-1)");
        let curve = expected(&line, 0.0, 5.0).unwrap();
        assert_eq!((curve.label.as_str(), curve.colour), ("law", Some(BLACK)));
        assert_eq!(curve.points[0].last(), Some(&(5.0, 2.0)));
        assert!(curve.points[0].iter().all(|p| p.0 >= 1.0));
        let weight = expected(&Labelled::from("25"), 0.0, 1.0).unwrap();
        assert_eq!(weight.points[0], [(0.0, 25.0), (1.0, 25.0)]);
        assert!(expected(&Labelled::from("y"), 0.0, 1.0).is_err());
        assert!(expected(&Labelled::from("sqrt(x-9)"), 0.0, 1.0).is_err());
    }
}
