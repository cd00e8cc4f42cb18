//! The table over scenes: how long a step the composed criterion gives against others, and how far it is from the edge.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use coupler::record::summary::Status;

use super::edge::Edge;
use super::{STEP_FACTOR, StabilityOptions, Trial, freed, setting};
use crate::StudyError;
use crate::case::Source;
use crate::engine::Queue;
use crate::output::{number, write, write_table};
use crate::runner::Runner;

/// Share of a step that is asked for, below which something else held it back: steps are up to 3 % below their limit, and
/// shortened to meet the next row.
const HELD: f64 = 0.8;
/// A multiple of every limit that leaves the cap alone to bind.
const ANY: f64 = 1e9;

/// A scene's line.
#[derive(Debug, Clone)]
pub struct Line {
    /// Title of the scene and its variant.
    pub title: String,
    /// With the composed step.
    pub composed: Trial,
    /// With the step of eq. 51.
    pub jiang2020: Trial,
    /// With the step of the contact alone, where there is a contact.
    pub contact_alone: Option<Trial>,
    /// Where multiples of the composed step become unstable.
    pub edge: Edge,
    /// The multiple that the largest stable step was in fact, where something else than the criterion bound it.
    pub held: Option<f64>,
}

/// The table.
#[derive(Debug, Clone)]
pub struct TableReport {
    /// A line a scene.
    pub lines: Vec<Line>,
    /// Scenes that stop by themselves, whatever the step: title and reason.
    pub left_out: Vec<(String, String)>,
}

/// Makes the table of these scenes, and writes `stability.csv` and `stability.md`.
///
/// # Errors
/// [`StudyError`].
pub fn table(
    sources: &[Source],
    options: &StabilityOptions,
    interrupt: Arc<AtomicBool>,
) -> Result<TableReport, StudyError> {
    let freed_sources: Vec<Source> = sources.iter().map(freed).collect::<Result<_, _>>()?;
    let runner = Runner::new(&options.runs, Queue::default(), interrupt)?;
    let tried = runner.each(&freed_sources, |source| line(source, options, &runner))?;
    let out = &options.runs.out;
    let mut report = TableReport {
        lines: Vec::new(),
        left_out: Vec::new(),
    };
    for (source, tried) in freed_sources.iter().zip(tried) {
        match tried {
            Tried::Line(line) => report.lines.push(*line),
            Tried::Stops(reason) => report.left_out.push((source.title(), reason)),
        }
    }
    write_table(&out.join("stability.csv"), &report.rows())?;
    write(&out.join("stability.md"), report.to_string())?;
    Ok(report)
}

/// A scene, tried.
enum Tried {
    Line(Box<Line>),
    /// It stops by itself, for this reason: there is no edge to look for.
    Stops(String),
}

fn line(source: &Source, options: &StabilityOptions, runner: &Runner) -> Result<Tried, StudyError> {
    let trial = |settings: &[(String, String)]| -> Result<Trial, StudyError> {
        let case = source.case(settings)?;
        let outcome = runner.run(&case)?;
        Ok(Trial::new(case, outcome, options.residual))
    };
    let composed = trial(&[])?;
    if composed.outcome.status == Status::Failed {
        let reason = composed.outcome.reason.unwrap_or_default();
        return Ok(Tried::Stops(reason));
    }
    let jiang2020 = trial(&[("time.criterion".to_owned(), "jiang2020".to_owned())])?;
    // A criterion that allows any step, and a cap: every step is of this length.
    let constant = |dt: f64| trial(&[setting(STEP_FACTOR, ANY), setting("time.max_step", dt)]);
    let contact_alone = composed.outcome.criteria.contact_alone;
    let contact_alone = contact_alone.map(constant).transpose()?;
    let mut steps = Vec::new();
    let edge = options.search.find(|factor| {
        let forced = trial(&[setting(STEP_FACTOR, factor)])?;
        steps.push((factor, forced.outcome.dt_max));
        Ok(forced.stable)
    })?;
    let held = held(&composed, &edge, &steps);
    let line = Line {
        title: source.title(),
        composed,
        jiang2020,
        contact_alone,
        edge,
        held,
    };
    tracing::info!("{}", line.markdown());
    Ok(Tried::Line(Box::new(line)))
}

/// The multiple of the largest stable factor's longest step, if that is shorter than the factor asks for: a history row
/// or the kinematic limit was in the way.
fn held(composed: &Trial, edge: &Edge, steps: &[(f64, Option<f64>)]) -> Option<f64> {
    let stable = edge.stable?;
    let (_, step) = steps.iter().find(|(factor, _)| *factor == stable)?;
    let multiple = (*step)? / composed.outcome.criteria.composed?;
    (multiple < HELD * stable).then_some(multiple)
}

impl Line {
    /// The composed step over that of another criterion.
    fn gain(&self, other: Option<f64>) -> Option<f64> {
        Some(self.composed.outcome.criteria.composed? / other?)
    }

    fn gains(&self) -> [Option<f64>; 3] {
        let criteria = &self.composed.outcome.criteria;
        let others = [
            criteria.jiang2020,
            criteria.lightest_point,
            criteria.contact_alone,
        ];
        others.map(|other| self.gain(other))
    }

    fn markdown(&self) -> String {
        let ratio = |n: Option<f64>| n.map_or_else(|| "-".to_owned(), |n| format!("{n:.2}"));
        let [eq_51, point, contact] = self.gains().map(ratio);
        let asked = &self.composed.outcome.criteria;
        let stable = |trial: &Trial, asked: Option<f64>| match trial.outcome.dt_max {
            _ if !trial.stable => "no",
            Some(longest) if asked.is_some_and(|dt| longest < HELD * dt) => "held back",
            _ => "yes",
        };
        let composed = self.composed.outcome.criteria.composed;
        let edge = match (self.edge.stable, self.edge.unstable) {
            (Some(_), _) if self.held.is_some() => {
                format!("> {:.2}, held back", self.held.unwrap_or_default())
            }
            (Some(low), Some(_)) => format!("{low:.2}"),
            (Some(low), None) => format!("> {low:.2}"),
            (None, Some(high)) => format!("< {high:.2}"),
            (None, None) => "-".to_owned(),
        };
        format!(
            "| `{}` | {} | {eq_51} | {} | {point} | {contact} | {} | {edge} |",
            self.title,
            composed.map_or_else(|| "-".to_owned(), |dt| format!("{:.3}", 1e6 * dt)),
            stable(&self.jiang2020, asked.jiang2020),
            self.contact_alone
                .as_ref()
                .map_or("-", |trial| stable(trial, asked.contact_alone)),
        )
    }
}

impl TableReport {
    fn rows(&self) -> Vec<Vec<String>> {
        let mut header: Vec<String> = vec!["scene".into(), "step".into()];
        header.extend(Trial::COLUMNS.map(String::from));
        header.extend(["stable_to".to_owned(), "unstable_from".to_owned()]);
        let mut rows = vec![header];
        for line in &self.lines {
            let contact_alone = line.contact_alone.iter().map(|t| ("contact_alone", t));
            let others = [("composed", &line.composed), ("jiang2020", &line.jiang2020)];
            for (step, trial) in others.into_iter().chain(contact_alone) {
                let mut row = vec![line.title.clone(), step.to_owned()];
                row.extend(trial.cells());
                row.extend([number(line.edge.stable), number(line.edge.unstable)]);
                rows.push(row);
            }
        }
        rows
    }
}

/// The table in Markdown.
impl fmt::Display for TableReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "| scene | composed step in us | over eq. 51 | eq. 51 is stable | over eq. 51 with m_p | over sqrt(m/k_n) \
             | sqrt(m/k_n) is stable | largest stable multiple |"
        )?;
        writeln!(f, "| --- | --- | --- | --- | --- | --- | --- | --- |")?;
        for line in &self.lines {
            writeln!(f, "{}", line.markdown())?;
        }
        for (title, reason) in &self.left_out {
            writeln!(f, "\nLeft out, `{title}` stops by itself: {reason}")?;
        }
        Ok(())
    }
}
