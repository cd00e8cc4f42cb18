//! Columns of the history and the scene's checks: recorded sample by sample, evaluated at the end.
//!
//! ```text
//! let mut recorder = Recorder::new(columns, checks, end);      // header() for history.csv
//! let row = recorder.record(&sample);            // at every history output, from t_0 to the end
//! let results = recorder.finish();               // for summary.json
//! ```

use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};

use mechanics::expression::Expression;

/// A column of the history.
#[derive(Debug, Clone)]
pub struct Column {
    /// Name in the header.
    pub name: String,
    /// Unit in the header.
    pub unit: String,
    /// Over `[sample, initial sample]`.
    pub value: Expression,
}

/// A condition that a run must meet.
#[derive(Debug, Clone)]
pub struct Check {
    /// What is checked.
    pub name: String,
    /// Over `[sample, initial sample]`.
    pub value: Expression,
    /// How the value's history becomes one number.
    pub when: When,
    /// Begin and end of the window in s.
    pub window: [f64; 2],
    /// What the number must be.
    pub expected: Expected<Expression, Reference>,
    /// Where the expected figure comes from.
    pub source: String,
}

impl Check {
    /// The reference at a time; NaN if there is a bound instead.
    fn reference(&self, slots: &[f64], time: f64) -> f64 {
        match &self.expected.reference {
            Some(Reference::Expression(expression)) => expression.evaluate(slots),
            Some(Reference::Table(table)) => interpolate(table, time),
            None => f64::NAN,
        }
    }

    /// What it expects, as the scene writes it; `show` formats a number.
    pub fn expectation(&self, show: impl Fn(f64) -> String) -> String {
        let words = |expression: &Expression| {
            let number = expression.as_number().map(&show);
            number.or_else(|| Some(expression.source().to_owned()))
        };
        let reference = |reference: &Reference| match reference {
            Reference::Expression(reference) => words(reference),
            Reference::Table(_) => Some("a table over time".to_owned()),
        };
        let expected = self.expected.in_words(words, reference);
        expected.unwrap_or_default()
    }
}

/// How the value's history becomes one number.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum When<Time = f64> {
    /// The last value of the window.
    #[default]
    End,
    /// The value at this time in s, interpolated between history outputs.
    At(Time),
    /// The largest value of the window.
    Max,
    /// The smallest value of the window.
    Min,
    /// The largest rise above the least value before it in the window.
    Rise,
    /// The time in s at which the value is largest in the window.
    TimeOfMax,
    /// The mean over the window's time.
    Mean,
    /// The root of the mean square over the window's time.
    Rms,
    /// The largest distance from the reference, which may depend on time.
    MaxError,
    /// The root mean square distance from the reference, which may depend on time.
    RmsError,
}

impl<Time> When<Time> {
    /// The same with another form of the time.
    pub fn map<T>(&self, time: impl FnOnce(&Time) -> T) -> When<T> {
        match self {
            Self::End => When::End,
            Self::At(at) => When::At(time(at)),
            Self::Max => When::Max,
            Self::Min => When::Min,
            Self::Rise => When::Rise,
            Self::TimeOfMax => When::TimeOfMax,
            Self::Mean => When::Mean,
            Self::Rms => When::Rms,
            Self::MaxError => When::MaxError,
            Self::RmsError => When::RmsError,
        }
    }
}

/// What the number must be, under the keys of the scene: one of `at_least`, `at_most`, `between` and `reference`, and with
/// `reference` a tolerance. `N` is a number and `R` a reference: as the scene writes them, as expressions, or as a run has
/// found them. Bounds, tolerances and scales depend on nothing but constants and initial quantities.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct Expected<N, R = N> {
    /// The value must not be below this. A check has one of `at_least`, `at_most`, `between`, `reference`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at_least: Option<N>,
    /// The value must not be above this.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at_most: Option<N>,
    /// The value must lie between these two, or on them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub between: Option<[N; 2]>,
    /// What the value must be, within a tolerance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reference: Option<R>,
    /// Largest distance from the reference, in the unit of the value (or of `scale`). This or `relative_tolerance`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<N>,
    /// Largest distance from the reference, as a fraction of it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub relative_tolerance: Option<N>,
    /// Distances are divided by this, such as the largest value of the reference.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale: Option<N>,
}

/// What a check expects, in numbers: `None` is one that could not be computed. A reference that depends on time has its value at
/// the time of the check's value. Empty if the run has no sample.
pub type Meant = Expected<Option<f64>>;

/// What a value must be near.
#[derive(Debug, Clone)]
pub enum Reference {
    /// Over `[sample, initial sample]`.
    Expression(Expression),
    /// Times in s and values, in order of time; between them linear, outside constant.
    Table(Vec<[f64; 2]>),
}

/// The verdict on a check, as in `summary.json`. Numbers that could not be computed are NaN, which JSON writes as null.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct CheckResult {
    /// What was checked.
    pub name: String,
    /// The value of the run. For `max_error`: the value where the distance is largest.
    #[serde(deserialize_with = "number")]
    pub value: f64,
    /// What the scene expects, in its own terms.
    pub expected: Meant,
    /// The number from which the error is counted: the reference, the bound, or the middle of `between`.
    #[serde(deserialize_with = "number")]
    pub reference: f64,
    /// Distance of the value from the reference, or beyond the bound; 0 within the bound.
    #[serde(deserialize_with = "number")]
    pub error: f64,
    /// Largest error that passes. It is 0 for bounds, since their error is the distance beyond them.
    #[serde(deserialize_with = "number")]
    pub tolerance: f64,
    /// Whether it passes. A NaN never does.
    pub pass: bool,
    /// Where the expected figure comes from.
    pub source: String,
    /// Why it fails, if the numbers do not show it: for people.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
}

/// A number that JSON writes as null where it is not finite.
///
/// # Errors
/// It is neither a number nor null.
pub fn number<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Option::deserialize(from).map(|number| number.unwrap_or(f64::NAN))
}

impl Meant {
    /// The verdict on a value that has this distance from the reference. Without a reference the distance does not count.
    #[must_use]
    pub fn judge(&self, value: f64, distance: f64) -> CheckResult {
        let number = |meant: Option<f64>| meant.unwrap_or(f64::NAN);
        // An infinite bound, tolerance or scale would pass for any run.
        let (reference, error, tolerance, bounds);
        let mut divisor = ("", 1.0);
        if let Some(ends) = self.between {
            let [lower, upper] = ends.map(number);
            reference = 0.5 * (lower + upper);
            (error, tolerance) = (beyond(lower - value) + beyond(value - upper), 0.0);
            bounds = lower.is_finite() && upper.is_finite();
        } else if let Some(bound) = self.at_least.or(self.at_most).map(number) {
            let excess = if self.at_least.is_some() {
                bound - value
            } else {
                value - bound
            };
            (reference, error, tolerance) = (bound, beyond(excess), 0.0);
            bounds = bound.is_finite();
        } else {
            reference = number(self.reference.flatten());
            let scale = self.scale.map(number);
            divisor = if self.relative_tolerance.is_some() {
                ("reference", reference.abs())
            } else {
                ("scale", scale.map_or(1.0, f64::abs))
            };
            (error, tolerance) = (
                distance / divisor.1,
                number(self.relative_tolerance.or(self.tolerance).flatten()),
            );
            bounds = [reference, tolerance, scale.unwrap_or(1.0)]
                .into_iter()
                .all(f64::is_finite);
        }
        let reason = match (value.is_finite(), bounds, divisor) {
            (false, ..) => Some("the value is not a finite number".to_owned()),
            (_, false, _) => Some("the expected value is not a finite number".to_owned()),
            (.., (name, 0.0)) => Some(format!("the {name}, which divides the distance, is 0")),
            _ => None,
        };
        CheckResult {
            value,
            expected: *self,
            reference,
            error,
            tolerance,
            // False for NaN.
            pass: error <= tolerance && reason.is_none(),
            reason,
            ..CheckResult::default()
        }
    }
}

/// Takes samples; returns rows of the history and verdicts.
#[derive(Debug, Clone)]
pub struct Recorder {
    columns: Vec<Column>,
    checks: Vec<Check>,
    /// What later records depend on; a run that goes on takes that of another recorder of its scene.
    pub recorded: Recorded,
    /// Times that are nearer than this (s) to an end of a window count as within it, because output times are rounded.
    time_slack: f64,
}

impl Recorder {
    /// A recorder of these columns and checks without samples, for a run that ends at `end` (s).
    pub fn new(columns: &[Column], checks: &[Check], end: f64) -> Self {
        Self {
            columns: columns.to_vec(),
            checks: checks.to_vec(),
            recorded: Recorded {
                slots: Vec::new(),
                checks: vec![Progress::default(); checks.len()],
            },
            time_slack: 1e-9 * end,
        }
    }

    /// Names and units of the history's columns, as `name [unit]`; the first is the time.
    pub fn header(&self) -> Vec<String> {
        let columns = self
            .columns
            .iter()
            .map(|c| format!("{} [{}]", c.name, c.unit));
        std::iter::once("time [s]".to_owned())
            .chain(columns)
            .collect()
    }

    /// Takes a sample, whose first value is the time; returns the row of the history, in the order of [`Self::header`]. The first
    /// sample is that of `t_0`, to which the `initial.` quantities refer.
    pub fn record(&mut self, sample: &[f64]) -> Vec<f64> {
        let time = sample[0];
        let Recorded { slots, checks } = &mut self.recorded;
        let mut before = sample.to_vec();
        if slots.is_empty() {
            *slots = [sample, sample].concat();
        } else {
            before.swap_with_slice(&mut slots[..sample.len()]);
        }
        for (check, progress) in self.checks.iter().zip(checks) {
            let point = Point {
                time,
                value: check.value.evaluate(slots),
                reference: check.reference(slots, time),
            };
            // Between two samples what is recorded is linear. A reference is what the scene says for that time.
            let reference = |at: f64| {
                let w = (at - before[0]) / (time - before[0]);
                let mut there = slots.clone();
                for (now, before) in there.iter_mut().zip(&before) {
                    *now = before + w * (*now - before);
                }
                there[0] = at;
                check.reference(&there, at)
            };
            progress.take(check, point, self.time_slack, &reference);
        }
        let columns = self.columns.iter();
        let columns = columns.map(|column| column.value.evaluate(slots));
        std::iter::once(time).chain(columns).collect()
    }

    /// The values of the first sample; empty before it.
    pub fn initial(&self) -> &[f64] {
        let slots = &self.recorded.slots;
        &slots[slots.len() / 2..]
    }

    /// Whether there has been a sample.
    pub fn has_begun(&self) -> bool {
        !self.recorded.slots.is_empty()
    }

    /// The verdicts that later samples cannot change.
    pub fn so_far(&self) -> Vec<CheckResult> {
        let reached = self
            .recorded
            .slots
            .first()
            .map(|time| time + self.time_slack);
        let over = |check: &Check| match check.when {
            When::At(at) => at,
            _ => check.window[1],
        };
        self.judged(|check| reached.is_some_and(|reached| over(check) <= reached))
    }

    /// The verdicts, in the order of the scene.
    pub fn finish(&self) -> Vec<CheckResult> {
        self.judged(|_| true)
    }

    fn judged(&self, is_asked: impl Fn(&Check) -> bool) -> Vec<CheckResult> {
        let Recorded { slots, checks } = &self.recorded;
        let all = self.checks.iter().zip(checks);
        let asked = all.filter(|(check, _)| is_asked(check));
        asked
            .map(|(check, progress)| judge(check, progress, slots))
            .collect()
    }
}

/// What a recorder must keep of its samples.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Recorded {
    slots: Vec<f64>,
    checks: Vec<Progress>,
}

/// A value and its reference at one time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Point {
    time: f64,
    value: f64,
    reference: f64,
}

impl Point {
    fn distance(&self) -> f64 {
        (self.value - self.reference).abs()
    }

    /// Linear between this and `next`, with the reference of that time.
    fn towards(self, next: Self, time: f64, reference: &dyn Fn(f64) -> f64) -> Self {
        let w = (time - self.time) / (next.time - self.time);
        Self {
            time,
            value: self.value + w * (next.value - self.value),
            reference: reference(time),
        }
    }
}

/// What a check must keep of the history so far: a few numbers, for any length of the run.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
struct Progress {
    /// Last sample, in the window or not.
    before: Option<Point>,
    /// Last sample of the window.
    last: Option<Point>,
    /// The sample that decides the check, if there is a single one.
    chosen: Option<Point>,
    /// The least value in the window so far, if the check is about rises.
    least: Option<f64>,
    /// Time in the window so far, and integrals over it of value, value^2, reference^2, distance^2.
    span: f64,
    integrals: [f64; 4],
}

impl Progress {
    /// Takes a sample; `reference` gives those since the sample before.
    fn take(&mut self, check: &Check, point: Point, slack: f64, reference: &dyn Fn(f64) -> f64) {
        let relative = check.expected.relative_tolerance.is_some();
        if let When::At(time) = check.when {
            self.take_at(time, point, slack, reference);
        }
        let [from, to] = check.window;
        if point.time >= from - slack && point.time <= to + slack {
            if check.when == When::Rise {
                let risen = self.risen(point);
                self.choose(When::Max, risen, relative);
            } else {
                self.choose(check.when, point, relative);
            }
            self.last = Some(point);
        }
        let crosses = |p: &Point| p.time < to - slack && point.time > from + slack;
        if let Some(before) = self.before.filter(crosses) {
            // The ends of the window may lie between samples.
            let end = |p: Point, is_beyond: bool, time: f64| {
                if is_beyond {
                    before.towards(point, time, reference)
                } else {
                    p
                }
            };
            self.integrate(
                end(before, before.time < from - slack, from),
                end(point, point.time > to + slack, to),
            );
        }
        self.before = Some(point);
    }

    /// Interpolates at `time` once it lies between two samples.
    fn take_at(&mut self, time: f64, point: Point, slack: f64, reference: &dyn Fn(f64) -> f64) {
        if self.chosen.is_some() {
            return;
        }
        if (point.time - time).abs() <= slack {
            self.chosen = Some(point);
        } else if let Some(before) = self.before.filter(|p| p.time < time && time < point.time) {
            self.chosen = Some(before.towards(point, time, reference));
        }
    }

    /// The rise of the value above its least value so far.
    fn risen(&mut self, point: Point) -> Point {
        let least = self.least.map_or(point.value, |l| l.min(point.value));
        self.least = Some(least);
        Point {
            value: point.value - least,
            ..point
        }
    }

    /// Keeps the extreme sample. The first NaN is kept for good: it must fail the check.
    fn choose(&mut self, when: When, point: Point, relative: bool) {
        let measure = |p: &Point| match when {
            When::Max | When::TimeOfMax => p.value,
            When::Min => -p.value,
            When::MaxError if relative && p.distance() > 0.0 => p.distance() / p.reference.abs(),
            When::MaxError => p.distance(),
            _ => 0.0,
        };
        match when {
            When::End => self.chosen = Some(point),
            When::Max | When::TimeOfMax | When::Min | When::MaxError => {
                let held = self.chosen.as_ref().map(measure);
                let better = held.is_none_or(|held| {
                    !held.is_nan() && (measure(&point) > held || measure(&point).is_nan())
                });
                if better {
                    self.chosen = Some(point);
                }
            }
            When::At(_) | When::Rise | When::Mean | When::Rms | When::RmsError => {}
        }
    }

    /// Trapezoidal rule.
    fn integrate(&mut self, a: Point, b: Point) {
        let width = b.time - a.time;
        self.span += width;
        let integrands = |p: Point| {
            [
                p.value,
                p.value.powi(2),
                p.reference.powi(2),
                p.distance().powi(2),
            ]
        };
        let (at_a, at_b) = (integrands(a), integrands(b));
        for (k, integral) in self.integrals.iter_mut().enumerate() {
            *integral += 0.5 * width * (at_a[k] + at_b[k]);
        }
    }

    /// Value, reference and distance, if the window has the samples that the check needs.
    fn outcome(&self, when: When) -> Option<(f64, f64, f64)> {
        let last = self.last;
        // A window with one sample has no length; its mean is that sample.
        let mean = |k: usize, single: f64| {
            if self.span > 0.0 {
                self.integrals[k] / self.span
            } else {
                single
            }
        };
        match when {
            When::End | When::At(_) | When::Max | When::Min | When::Rise | When::MaxError => {
                self.chosen.map(|p| (p.value, p.reference, p.distance()))
            }
            When::TimeOfMax => self.chosen.map(|p| {
                let time = if p.value.is_nan() { f64::NAN } else { p.time };
                (time, p.reference, (time - p.reference).abs())
            }),
            When::Mean => last.map(|p| {
                let value = mean(0, p.value);
                (value, p.reference, (value - p.reference).abs())
            }),
            When::Rms => last.map(|p| {
                let value = mean(1, p.value.powi(2)).sqrt();
                (value, p.reference, (value - p.reference).abs())
            }),
            When::RmsError => last.map(|p| {
                let rms = |k, single: f64| mean(k, single.powi(2)).sqrt();
                (rms(1, p.value), rms(2, p.reference), rms(3, p.distance()))
            }),
        }
    }
}

impl<N, R> Expected<N, R> {
    /// The same with other forms of numbers and of a reference.
    pub fn map<M, Q>(
        &self,
        number: impl Fn(&N) -> M,
        reference: impl Fn(&R) -> Q,
    ) -> Expected<M, Q> {
        let one = |written: &Option<N>| written.as_ref().map(&number);
        Expected {
            at_least: one(&self.at_least),
            at_most: one(&self.at_most),
            between: self
                .between
                .as_ref()
                .map(|ends| ends.each_ref().map(&number)),
            reference: self.reference.as_ref().map(reference),
            tolerance: one(&self.tolerance),
            relative_tolerance: one(&self.relative_tolerance),
            scale: one(&self.scale),
        }
    }

    /// In words, with these formats of a number and of the reference; `None` if nothing is expected or can be shown.
    pub fn in_words(
        &self,
        number: impl Fn(&N) -> Option<String>,
        reference: impl Fn(&R) -> Option<String>,
    ) -> Option<String> {
        if let Some(ends) = &self.between {
            let ends = ends.each_ref().map(number);
            return Some(
                ends.map(|end| end.unwrap_or("none".to_owned()))
                    .join(" to "),
            );
        }
        let bound = |word, bound: &Option<N>| Some(format!("{word} {}", number(bound.as_ref()?)?));
        bound("at least", &self.at_least)
            .or_else(|| bound("at most", &self.at_most))
            .or_else(|| reference(self.reference.as_ref()?))
    }
}

/// Linear between the rows of `table` and constant outside; NaN if there are no rows.
fn interpolate(table: &[[f64; 2]], time: f64) -> f64 {
    let after = table.partition_point(|row| row[0] < time);
    match (after.checked_sub(1).map(|i| table[i]), table.get(after)) {
        (Some([t0, v0]), Some([t1, v1])) => v0 + (v1 - v0) * (time - t0) / (t1 - t0),
        (None, Some([_, v])) => *v,
        (Some([_, v]), None) => v,
        (None, None) => f64::NAN,
    }
}

fn judge(check: &Check, progress: &Progress, slots: &[f64]) -> CheckResult {
    let outcome = progress.outcome(check.when);
    let (value, reference, distance) = outcome.unwrap_or((f64::NAN, f64::NAN, f64::NAN));
    // Without a sample no expression has a value.
    let expected = if slots.is_empty() {
        Meant::default()
    } else {
        let number = |expression: &Expression| Some(expression.evaluate(slots));
        check.expected.map(number, |_| Some(reference))
    };
    let [from, to] = check.window;
    let judged = match (outcome, check.when) {
        (Some(_), _) => expected.judge(value, distance),
        (None, when) => CheckResult {
            value,
            expected,
            reference,
            error: distance,
            reason: Some(match when {
                When::At(time) => format!("the run has no samples around {time} s"),
                _ => format!("the run has no sample between {from} s and {to} s"),
            }),
            ..CheckResult::default()
        },
    };
    CheckResult {
        name: check.name.clone(),
        source: check.source.clone(),
        ..judged
    }
}

/// `excess` if it is positive, else 0. It is NaN for NaN, which `f64::max` would lose.
fn beyond(excess: f64) -> f64 {
    if excess <= 0.0 { 0.0 } else { excess }
}

#[cfg(test)]
mod tests;
