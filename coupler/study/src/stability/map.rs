//! Maps over two scene keys: the columns are given, the edge along each is looked for.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use coupler::record::summary::Criteria;

use super::edge::Edge;
use super::{STEP_FACTOR, StabilityOptions, freed, is_stable, setting, usable};
use crate::StudyError;
use crate::case::{Case, Source};
use crate::output::{number, write_table};
use crate::runner::Runner;
use crate::vary::Vary;
use crate::work::{Row, column, write_rows};

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

/// Makes the map of each scene over its columns; writes `stability.csv` and `edges.csv`.
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
        let vary = Vary::parse(&options.vary)?;
        let Some(values) = vary.numbers() else {
            return Err(StudyError::usage(
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

    /// A criterion's step as a multiple of the shortest composed one; [`STEP_FACTOR`] multiplies that of each moment.
    fn multiple(&self, criterion: fn(&Criteria) -> Option<f64>) -> Option<f64> {
        let criteria = self.criteria()?;
        Some(criterion(criteria)? / criteria.composed?)
    }
}

fn write(reports: &[MapReport], options: &StabilityOptions, alone: bool) -> Result<(), StudyError> {
    let out = &options.runs.out;
    let header = [
        "scene",
        "column",
        "at",
        "stable_to",
        "unstable_from",
        "composed [s]",
        "jiang2020 [composed]",
        "lightest_point [composed]",
    ];
    let mut edges = vec![header.map(String::from).to_vec()];
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
    let bound_by = |row: &Row| {
        let bound = row.outcome().dt_bound_by.iter();
        let bound: Vec<String> = bound
            .map(|(name, steps)| format!("{name} {steps}"))
            .collect();
        bound.join(" ")
    };
    let middle = vec![
        column("stable", |row| {
            is_stable(row.outcome(), options.residual).to_string()
        }),
        column("residual_max [1]", |row| {
            row.outcome().energy.residual_max.to_string()
        }),
        column("bound_by", bound_by),
    ];
    let criterion = |header, of: fn(&Criteria) -> Option<f64>| {
        column(header, move |row| number(of(&row.outcome().criteria)))
    };
    let end = vec![
        criterion("composed [s]", |k| k.composed),
        criterion("jiang2020 [s]", |k| k.jiang2020),
        criterion("lightest_point [s]", |k| k.lightest_point),
    ];
    write_rows(&out.join("stability.csv"), &rows, alone, [middle, end])
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
                write!(
                    f,
                    "; of the run's shortest step eq. 51 is {eq_51:.3}, with the point's mass {point:.3}"
                )?;
            }
            writeln!(f)?;
        }
        Ok(())
    }
}
