//! Maps over two scene keys: the columns are given, the edge along each is looked for.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use coupler::record::summary::Criteria;
use plotters::style::RGBColor;

use super::edge::Edge;
use super::{STEP_FACTOR, StabilityOptions, freed, is_stable, setting, usable};
use crate::StudyError;
use crate::case::{Case, Source};
use crate::figure::axis::Scale;
use crate::figure::chart::{Chart, DISCS, Panel, Series};
use crate::figure::shape::{Form, WHOLE};
use crate::output::{number, write_table};
use crate::runner::Runner;
use crate::vary::{Vary, with_unit};
use crate::work::{Row, write_rows};

/// Columns of a scene's map unless others are asked for: decades of its own stiffness, from itself up, and how many.
const STIFFNESS: &str = "contact.linear.normal_stiffness";
const DECADES: i32 = 7;

/// A column of a map.
#[derive(Debug, Clone)]
pub struct Column {
    /// Its value.
    pub at: f64,
    /// Where it becomes unstable.
    pub edge: Edge,
    /// The runs, in the order of [`Edge::tried`].
    pub rows: Vec<Row>,
}

/// A map.
#[derive(Debug, Clone)]
pub struct MapReport {
    /// Title of the scene.
    pub title: String,
    /// The key of the columns.
    pub column: String,
    /// The columns.
    pub columns: Vec<Column>,
}

/// Makes the map of each scene over its columns; writes `stability.csv`, `edges.csv` and `stability.svg`.
///
/// # Errors
/// [`StudyError`].
pub fn maps(
    wanted: &[Source],
    options: &StabilityOptions,
    interrupt: Arc<AtomicBool>,
) -> Result<Vec<MapReport>, StudyError> {
    let (mut sources, mut reports) = (Vec::new(), Vec::new());
    for source in wanted {
        let vary = match &options.vary {
            Some(vary) => Vary::parse(vary)?,
            None => decades(source)?,
        };
        let Some(values) = vary.numbers() else {
            return Err(StudyError::asked(
                format!("--vary {}: a map has numbers along its axis", vary.key),
                "for values that are no numbers make a map each",
            ));
        };
        let title = source.title();
        tracing::info!("{title}: {} columns over {}", values.len(), vary.key);
        sources.push(freed(source)?);
        reports.push(MapReport {
            title,
            column: vary.key,
            columns: values.into_iter().map(Column::at).collect(),
        });
    }
    // Every key is known and every value allowed before anything is started.
    let mut round = next_round(&reports, &sources, options)?;
    let runner = Runner::new(&options.runs, interrupt)?;
    while !round.is_empty() {
        let (places, cases): (Vec<_>, Vec<Case>) = round.into_iter().unzip();
        let ended = runner.timed(&cases, 1, &mut |_| ())?;
        for ((map, column, value), (case, ended)) in
            places.into_iter().zip(cases.into_iter().zip(ended))
        {
            let row = Row::new(
                &runner,
                case,
                ended,
                reports[map].title.clone(),
                Some(value),
            );
            if value <= 1.0 {
                usable(&row)?;
            }
            let column = &mut reports[map].columns[column];
            column
                .edge
                .take(value, is_stable(row.outcome(), options.residual));
            column.rows.push(row);
        }
        round = next_round(&reports, &sources, options)?;
    }
    write(&reports, options, runner.alone())?;
    Ok(reports)
}

/// The stiffness of a scene's contact and decades above it.
fn decades(source: &Source) -> Result<Vary, StudyError> {
    let own = source.case(&[])?.number(STIFFNESS).ok_or_else(|| {
        StudyError::asked(
            format!("{} has no `{STIFFNESS}` to vary", source.path.display()),
            "name the columns: `--vary KEY=N1,N2,...`",
        )
    })?;
    let values = (0..DECADES).map(|k| (own * 10f64.powi(k)).to_string());
    Ok(Vary {
        key: STIFFNESS.to_owned(),
        values: values.collect(),
    })
}

/// A run: its map, its column, and its value along that.
type Wanted = ((usize, usize, f64), Case);

/// The runs that come next in all columns.
fn next_round(
    reports: &[MapReport],
    sources: &[Source],
    options: &StabilityOptions,
) -> Result<Vec<Wanted>, StudyError> {
    let mut round = Vec::new();
    for (map, (report, source)) in reports.iter().zip(sources).enumerate() {
        for (k, column) in report.columns.iter().enumerate() {
            for value in options.search.next(&column.edge) {
                let settings = [
                    setting(&report.column, column.at),
                    setting(STEP_FACTOR, value),
                ];
                round.push(((map, k, value), source.case(&settings)?));
            }
        }
    }
    Ok(round)
}

impl Column {
    fn at(at: f64) -> Self {
        Self {
            at,
            edge: Edge::default(),
            rows: Vec::new(),
        }
    }

    fn in_words(&self) -> String {
        match (self.edge.stable, self.edge.unstable) {
            (Some(low), Some(high)) => format!("stable up to {low}, unstable from {high}"),
            (Some(low), None) => format!("stable up to {low}, the largest tried"),
            (None, Some(high)) => format!("unstable at {high}, the smallest tried"),
            (None, None) => "nothing tried".to_owned(),
        }
    }

    /// The steps of the criteria as the first run has them, the one with the smallest step.
    fn criteria(&self) -> Option<&Criteria> {
        Some(&self.rows.first()?.outcome().criteria)
    }

    /// A criterion's step as a multiple of the composed one.
    fn multiple(&self, criterion: fn(&Criteria) -> Option<f64>) -> Option<f64> {
        let criteria = self.criteria()?;
        Some(criterion(criteria)? / criteria.composed?)
    }
}

impl MapReport {
    /// Runs that were stable and those that were not; named lines, of which the last is the measured edge.
    fn series(&self) -> [Series; 6] {
        let series = |label: &str, colour, form, points| Series {
            label: label.to_owned(),
            colour,
            forms: vec![form],
            points: vec![points],
        };
        let line_of = |width| Form::Line(width, WHOLE);
        let grey = |shade| Some(RGBColor(shade, shade, shade));
        let runs = |wanted: bool| {
            let of = |c: &'_ Column| {
                let runs = c.edge.tried.iter().filter(|(_, stable)| *stable == wanted);
                runs.map(|(value, _)| (c.at, *value)).collect::<Vec<_>>()
            };
            self.columns.iter().flat_map(of).collect()
        };
        let line = |of: &dyn Fn(&Column) -> Option<f64>| -> Vec<(f64, f64)> {
            let points = self.columns.iter();
            points.filter_map(|c| Some((c.at, of(c)?))).collect()
        };
        // Where lines lie on one another, the lower ones are seen beside the upper ones.
        [
            series(
                "eq. 51 with the mass of the lightest point",
                None,
                line_of(8.6),
                line(&|c| c.multiple(|k| k.lightest_point)),
            ),
            series(
                "Jiang 2020 eq. 51",
                None,
                line_of(6.4),
                line(&|c| c.multiple(|k| k.jiang2020)),
            ),
            series(
                "the coupler's criterion (composed, its step is 1)",
                None,
                line_of(4.2),
                line(&|_| Some(1.0)),
            ),
            series(
                "measured edge: largest stable value found",
                None,
                line_of(2.0),
                line(&|c| c.edge.unstable.and(c.edge.stable)),
            ),
            series("stable", grey(90), DISCS, runs(true)),
            series("unstable", grey(150), Form::Discs(4.0, false), runs(false)),
        ]
    }

    fn panel(&self) -> Panel {
        Panel {
            words: [
                self.title.clone(),
                with_unit(&self.column),
                "step / composed step".to_owned(),
            ],
            scales: [Some(Scale::Log); 2],
            ..Panel::default()
        }
    }
}

/// The maps below one another.
fn chart(reports: &[MapReport]) -> Chart {
    let mut series: Vec<Series> = Vec::new();
    for of_map in reports.iter().map(MapReport::series) {
        if series.is_empty() {
            series.extend(of_map);
        } else {
            let all = series.iter_mut().zip(of_map);
            all.for_each(|(all, own)| all.points.extend(own.points));
        }
    }
    series.retain(|series| series.points.iter().any(|points| !points.is_empty()));
    Chart {
        columns: 1,
        panels: reports.iter().map(MapReport::panel).collect(),
        series,
        ..Chart::default()
    }
}

fn write(reports: &[MapReport], options: &StabilityOptions, alone: bool) -> Result<(), StudyError> {
    let out = &options.runs.out;
    let text = |words: &[&str]| words.iter().map(ToString::to_string).collect::<Vec<_>>();
    let mut edges = vec![text(&[
        "scene",
        "column",
        "at",
        "stable_to",
        "unstable_from",
        "composed [s]",
        "jiang2020/composed",
        "lightest_point/composed",
    ])];
    let mut rows = Vec::new();
    for report in reports {
        for column in &report.columns {
            rows.extend(column.rows.iter().cloned());
            edges.push(vec![
                report.title.clone(),
                report.column.clone(),
                column.at.to_string(),
                number(column.edge.stable),
                number(column.edge.unstable),
                number(column.criteria().and_then(|criteria| criteria.composed)),
                number(column.multiple(|k| k.jiang2020)),
                number(column.multiple(|k| k.lightest_point)),
            ]);
        }
    }
    write_table(&out.join("edges.csv"), &edges)?;
    let middle = text(&["stable", "residual_max [1]", "bound_by"]);
    let end = text(&["composed [s]", "jiang2020 [s]", "lightest_point [s]"]);
    write_rows(
        &out.join("stability.csv"),
        &rows,
        alone,
        [&middle, &end],
        |row| {
            let outcome = row.outcome();
            let bound = outcome.dt_bound_by.iter();
            let bound: Vec<String> = bound
                .map(|(name, steps)| format!("{name} {steps}"))
                .collect();
            let criteria = &outcome.criteria;
            [
                vec![
                    is_stable(outcome, options.residual).to_string(),
                    outcome.energy.residual_max.to_string(),
                    bound.join(" "),
                ],
                [
                    criteria.composed,
                    criteria.jiang2020,
                    criteria.lightest_point,
                ]
                .map(number)
                .to_vec(),
            ]
        },
    )?;
    chart(reports).draw(&out.join("stability.svg"))
}

/// The edges for people.
impl fmt::Display for MapReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}: {STEP_FACTOR} over {}", self.title, self.column)?;
        for column in &self.columns {
            write!(f, "  {:>10.3e}  {}", column.at, column.in_words())?;
            if let (Some(eq_51), Some(point)) = (
                column.multiple(|k| k.jiang2020),
                column.multiple(|k| k.lightest_point),
            ) {
                write!(f, "; eq. 51 {eq_51:.3}, with the point's mass {point:.3}")?;
            }
            writeln!(f)?;
        }
        Ok(())
    }
}
