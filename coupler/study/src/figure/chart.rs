//! Charts: areas with axes, and series in them that share a legend.

use std::path::Path;

use plotters::style::{RGBColor, text_anchor::HPos};

use super::axis::{Axis, Scale};
use super::file;
use super::shape::{Form, GAP, Place, Shape, WHOLE, WORDS, wrapped};
use super::sheet::{Area, MARGIN, Sheet};
use crate::StudyError;

/// Okabe and Ito's colours, which the colour-blind can distinguish; black last.
const COLOURS: [u32; 7] = [
    0x00_72B2, 0xD5_5E00, 0x00_9E73, 0xCC_79A7, 0xE6_9F00, 0x56_B4E9, 0x00_0000,
];
/// Width and height in pixels of what is within the axes, of one area in a row and of several.
const SIZES: [(f64, f64); 2] = [(660.0, 380.0), (440.0, 300.0)];
/// Positive numbers along x and y of at least this ratio lie along a logarithmic axis, unless a scale is given.
const MANY: [f64; 2] = [8.0, 100.0];

pub(crate) const CURVE: Form = Form::Line(2.0, WHOLE);
pub(crate) const DISCS: Form = Form::Discs(4.0, true);

/// Points that belong together.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// What the legend says; a series without a name is not in it.
    pub label: String,
    /// One of its own where it is left out.
    pub colour: Option<RGBColor>,
    /// What is drawn at its points.
    pub forms: Vec<Form>,
    /// In the axes' units, by panel. What has no place on an axis is left out.
    pub points: Vec<Vec<Place>>,
}

#[derive(Debug, Clone, PartialEq, Default)]
pub struct Panel {
    /// Above, below and beside.
    pub words: [String; 3],
    /// Of x and of y; by their numbers where it is left out.
    pub scales: [Option<Scale>; 2],
    /// First and last number of x and of y, where they are given.
    pub limits: [[Option<f64>; 2]; 2],
}

#[derive(Debug, Clone, PartialEq, Default)]
pub struct Chart {
    pub title: String,
    /// Below all.
    pub note: String,
    /// Panels in a row.
    pub columns: usize,
    /// What the numbers 0, 1, 2, ... along x stand for, where they are no numbers of their own.
    pub names: Option<Vec<String>>,
    pub panels: Vec<Panel>,
    /// One over the other in all of them.
    pub series: Vec<Series>,
}

impl Chart {
    pub fn draw(&self, path: &Path) -> Result<(), StudyError> {
        file::write(path, std::iter::once(self.sheet()), 1.0)
    }

    fn sheet(&self) -> Sheet {
        let own = COLOURS.map(|colour| {
            let [_, red, green, blue] = colour.to_be_bytes();
            RGBColor(red, green, blue)
        });
        let (mut own, mut series) = (own.iter().cycle(), Vec::new());
        for of in &self.series {
            let colour = of.colour.or_else(|| own.next().copied());
            series.push((of, colour.unwrap_or_default()));
        }
        let area = |(k, panel)| self.area(k, panel, &series);
        let areas: Vec<Area> = self.panels.iter().enumerate().map(area).collect();
        let mut sheet = Sheet::new(&self.title, &areas, self.columns);
        for (series, colour) in series.iter().filter(|(series, _)| !series.label.is_empty()) {
            let y = sheet.height + 0.5 * (WORDS + GAP);
            let sample = [MARGIN, MARGIN + 15.0, MARGIN + 30.0].map(|x| (x, y));
            for form in &series.forms {
                let line = matches!(form, Form::Line(..));
                let places = if line { &sample[..] } else { &sample[1..2] };
                sheet.shapes.push(Shape(places.to_vec(), *colour, *form));
            }
            let left = MARGIN + 40.0;
            let lines = wrapped(&series.label, WORDS, sheet.width - left - MARGIN);
            sheet.height = sheet.lines(&lines, WORDS, (left, sheet.height), HPos::Left);
        }
        sheet.note(&self.note, WORDS);
        sheet.height += MARGIN;
        sheet
    }

    fn area(&self, k: usize, panel: &Panel, series: &[(&Series, RGBColor)]) -> Area {
        let points = || series.iter().flat_map(|(series, _)| &series.points[k]);
        let axis = |i: usize, of: fn(&Place) -> f64| {
            let scale = panel.scales[i].unwrap_or_else(|| Scale::of(points().map(of), MANY[i]));
            Axis::around(points().map(of), scale, panel.limits[i])
        };
        let x = match &self.names {
            Some(names) => Axis::over([-0.5, names.len() as f64 - 0.5], Scale::Linear),
            None => axis(0, |p| p.0),
        };
        let mut shapes = Vec::new();
        for (series, colour) in series {
            let shape = |form: &Form| Shape(series.points[k].clone(), *colour, *form);
            shapes.extend(series.forms.iter().map(shape));
        }
        Area {
            size: SIZES[usize::from(self.columns > 1)],
            axes: [x, axis(1, |p| p.1)],
            words: panel.words.clone(),
            names: self.names.clone(),
            shapes,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(label: &str, forms: &[Form], points: Vec<Vec<Place>>) -> Series {
        Series {
            label: label.into(),
            colour: None,
            forms: forms.to_vec(),
            points,
        }
    }

    #[test]
    fn no_words_overlap_however_long_they_are() {
        let long = "a name that goes on and on, as names of runs with three settings in them do, and then some more";
        let names = [
            "linear",
            "ugimp",
            "quadratic_bspline",
            "{ blend = { pic_fraction = 0.01 } }",
        ];
        let names = Some(names.map(String::from).to_vec());
        let forms: [&[Form]; 2] = [&[CURVE, DISCS], &[Form::Discs(9.0, false)]];
        for (labels, scales, range) in [
            (vec!["a", "b", "c"], [None; 2], [1.0, 2.0]),
            (
                vec![long, "b", long, "d"],
                [Some(Scale::Log); 2],
                [0.001_234, 0.001_236],
            ),
            (vec!["one"; 17], [None, Some(Scale::Log)], [-1.0e-7, 3.0e11]),
            (vec![long], [Some(Scale::Log), None], [1e-200, 1e200]),
        ] {
            for (count, title) in [(0, ""), (1, "short"), (2, long), (5, &*long.repeat(3))] {
                for (columns, names) in [(1, &None), (2, &None), (2, &names)] {
                    let ends = range.map(|end| (end, end)).to_vec();
                    let all = vec![ends; count];
                    let all = (labels.iter().zip(forms.iter().cycle()))
                        .map(|(label, forms)| series(label, forms, all.clone()));
                    let panel = Panel {
                        words: [title.into(), long.repeat(2), format!("{long} [kg m/s]")],
                        scales,
                        limits: [[None; 2]; 2],
                    };
                    let chart = Chart {
                        title: title.into(),
                        note: title.into(),
                        columns,
                        names: names.clone(),
                        panels: vec![panel; count],
                        series: all.collect(),
                    };
                    assert_eq!(chart.sheet().collisions(), Vec::<String>::new());
                }
            }
        }
    }

    #[test]
    fn each_series_has_a_colour_of_its_own_and_a_sample() {
        let all = [&[CURVE, DISCS][..], &[CURVE]];
        let points = vec![vec![(0.0, 0.0), (1.0, 1.0)]];
        let chart = Chart {
            panels: vec![Panel::default()],
            series: all
                .map(|forms| series("name", forms, points.clone()))
                .to_vec(),
            ..Chart::default()
        };
        let svg = file::svg(&chart.sheet()).unwrap();
        assert_eq!(svg.matches("\nname\n").count(), 2);
        // Two points and one in the legend; a line and a sample of each colour.
        assert_eq!(svg.matches("<circle").count(), 3);
        for colour in ["#0072B2", "#D55E00"] {
            let line = format!("<polyline fill=\"none\" opacity=\"1\" stroke=\"{colour}\"");
            assert_eq!(svg.matches(&line).count(), 2, "{svg}");
        }
    }
}
