//! Constants, columns and checks: compiles every expression, resolves every name, and reads every reference.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use interface::config::MaterialModel;

use crate::diagnostic::suggestion;
use mechanics::expression::{Expression, ExpressionError, Meaning, reserved_names};
use record::Table;
use record::check::{Check, Column, Expected, Reference, When};
use record::frames::Field;
use record::quantity::Quantities;

use super::problems::Problems;
use super::written::{
    CheckWritten, ColumnWritten, NumberOrExpression, OutputWritten, ReferenceWritten, TableWritten,
};

/// Most names of a circle of constants that a message shows.
const CIRCLE_LIMIT: usize = 20;

/// The constants as numbers. Each may use the others, in any order.
pub(super) fn constants(
    problems: &mut Problems,
    written: &BTreeMap<String, NumberOrExpression>,
) -> BTreeMap<String, f64> {
    let mut known: BTreeMap<String, f64> = BTreeMap::new();
    let mut pending: Vec<(&String, &String)> = Vec::new();
    let mut taken = BTreeSet::from([
        "t",
        "time",
        "momentum_error",
        "angular_momentum",
        "angular_momentum_error",
    ]);
    taken.extend(reserved_names());
    for (name, value) in written {
        constant_name(problems, name, &taken);
        match value {
            NumberOrExpression::Number(number) => {
                known.insert(name.clone(), *number);
            }
            NumberOrExpression::Expression(source) => pending.push((name, source)),
        }
    }
    // Each expression waits for its first unknown name, so that it is not compiled again without need.
    let mut waiting: BTreeMap<String, Vec<(&String, &String)>> = BTreeMap::new();
    let mut stuck = Vec::new();
    while let Some((name, source)) = pending.pop() {
        match compile_constant(source, &known) {
            Ok(number) => {
                known.insert(name.clone(), number);
                pending.extend(waiting.remove(name).unwrap_or_default());
            }
            Err(error) => match error.unknown_name {
                Some(missing) => waiting.entry(missing).or_default().push((name, source)),
                None => stuck.push((name, source)),
            },
        }
    }
    // Of constants that wait for others, the faults of the others are reported; without any, that they form a circle.
    let is_constant = |missing: &String| written.contains_key(missing);
    let of_others = waiting.iter().filter(|(missing, _)| !is_constant(missing));
    stuck.extend(of_others.flat_map(|(_, names)| names));
    stuck.sort();
    let waits = waiting.iter().flat_map(|(missing, names)| {
        let names = names.iter().map(|(name, _)| name.as_str());
        names.map(move |name| (name, missing.as_str()))
    });
    let waits: BTreeMap<&str, &str> = waits.collect();
    if let (true, Some(&first)) = (stuck.is_empty(), waits.keys().next()) {
        circle(problems, &waits, first);
    }
    for (name, source) in stuck {
        if problems.is_full() {
            break;
        }
        if let Err(error) = compile_constant(source, &known) {
            let others = written.keys().filter(|other| *other != name);
            let help = suggestion_for(&error, others.map(String::as_str));
            let path = format!("constants.{name}");
            problems.refuse_within(&path, &error.at, &error.message, Some(help));
        }
    }
    for (name, value) in known.iter().filter(|(_, value)| !value.is_finite()) {
        let path = format!("constants.{name}");
        let what = format!("a finite number, not {value}");
        problems.number(&path, *value, false, &what);
    }
    known
}

fn constant_name(problems: &mut Problems, name: &str, taken: &BTreeSet<&str>) {
    let path = format!("constants.{name}");
    problems.name(&path, name);
    if taken.contains(name) {
        let taken: Vec<&str> = taken.iter().copied().collect();
        problems.refuse_key(
            &path,
            format!("`{name}` already means something in expressions"),
            format!("use another name; these are taken: {}", taken.join(", ")),
        );
    }
}

/// A column is named in expressions of `tandem plot` and in tables of a study.
fn column_name(problems: &mut Problems, path: &str, name: &str) {
    let good = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '.';
    if !name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') || !name.chars().all(good) {
        let message =
            format!("`{path}` is \"{name}\", expected a letter, then letters, digits, `_` or `.`");
        problems.refuse(
            path,
            message,
            "`tandem plot` names the column in expressions",
        );
    } else if name == "time" {
        let message = format!("`{path}` is \"time\", which every history has as its first column");
        problems.refuse(path, message, "give it another name, or leave it out");
    } else if reserved_names().any(|taken| taken == name) {
        let message =
            format!("`{path}` is \"{name}\", which already means something in expressions");
        problems.refuse(path, message, "give it another name");
    }
}

/// Refuses the circle to which constants lead from `first` on, of which each waits for another.
fn circle(problems: &mut Problems, waits: &BTreeMap<&str, &str>, first: &str) {
    let (mut met, mut at) = (BTreeSet::new(), first);
    while met.insert(at) {
        at = waits[at];
    }
    let circle = std::iter::successors(Some(at), |name| Some(waits[name]));
    let circle: Vec<&str> = circle.take(CIRCLE_LIMIT).collect();
    let end = circle[1..].iter().position(|name| *name == at);
    let circle = end.map_or(&circle[..], |end| &circle[..end + 2]);
    problems.refuse(
        &format!("constants.{at}"),
        format!(
            "constants may not depend on each other in a circle: {}",
            circle.join(" needs ")
        ),
        "give one of them as a number",
    );
}

fn compile_constant(source: &str, known: &BTreeMap<String, f64>) -> Result<f64, ExpressionError> {
    let meaning = |name: &str| known.get(name).copied().map(Meaning::Number);
    let compiled = Expression::compile(source, &meaning)?;
    // Every name was a number, so the expression has no variables.
    Ok(compiled.evaluate(&[]))
}

pub(super) fn suggestion_for<'n>(
    error: &ExpressionError,
    names: impl Iterator<Item = &'n str> + Clone,
) -> String {
    match &error.unknown_name {
        Some(name) => suggestion(name, "known here", names),
        None => {
            "numbers, names, + - * / ^, parentheses and functions such as sqrt or max".to_owned()
        }
    }
}

/// The names with which columns and checks are compiled, and where their faults are reported.
pub(super) struct Context<'a, 'd> {
    pub problems: &'a mut Problems<'d>,
    pub constants: &'a BTreeMap<String, f64>,
    pub quantities: &'a Quantities,
    /// End of the run in s.
    pub end: f64,
    /// Directory of CSV files.
    pub directory: &'a Path,
}

/// The names on which an expression may depend.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Scope {
    /// Constants.
    Constants,
    /// Constants and initial quantities, which do not change within a run.
    Unchanging,
    /// All names.
    All,
}

impl Context<'_, '_> {
    fn meaning(&self, scope: Scope, name: &str) -> Option<Meaning> {
        if let Some(number) = self.constants.get(name) {
            return Some(Meaning::Number(*number));
        }
        let allowed = match scope {
            Scope::Constants => false,
            Scope::Unchanging => name.starts_with("initial."),
            Scope::All => true,
        };
        allowed.then(|| self.quantities.meaning(name)).flatten()
    }

    fn compile(&mut self, scope: Scope, path: &str, source: &str) -> Option<Expression> {
        match Expression::compile(source, &|name| self.meaning(scope, name)) {
            Ok(expression) => Some(expression),
            Err(error) => {
                let help = self.help(scope, &error);
                self.problems
                    .refuse_within(path, &error.at, &error.message, Some(help));
                None
            }
        }
    }

    fn help(&self, scope: Scope, error: &ExpressionError) -> String {
        let constants = self.constants.keys().map(String::as_str);
        match (scope, &error.unknown_name) {
            (Scope::All, Some(name)) => {
                let bare = name.strip_prefix("initial.").unwrap_or(name);
                let all = self.quantities.names().chain(["t"]).chain(constants);
                match crate::diagnostic::nearest(bare, all) {
                    Some(near) if bare.len() < name.len() => {
                        format!("did you mean `initial.{near}`?")
                    }
                    Some(near) => format!("did you mean `{near}`?"),
                    None => "quantities are listed in docs/quantities.csv, such as `t`, \
                             `energy.kinetic`, `body.NAME.vx`, `points.NAME.y`"
                        .to_owned(),
                }
            }
            (Scope::Unchanging, Some(name)) if self.quantities.index(name).is_some() => {
                format!("this must not change within the run: use constants or `initial.{name}`")
            }
            _ => suggestion_for(error, constants),
        }
    }

    fn number_or_expression(
        &mut self,
        scope: Scope,
        path: &str,
        written: &NumberOrExpression,
    ) -> Option<Expression> {
        let expression = match written {
            NumberOrExpression::Number(number) => Expression::constant(*number),
            NumberOrExpression::Expression(source) => self.compile(scope, path, source)?,
        };
        if let Some(number) = expression.as_number().filter(|number| !number.is_finite()) {
            let help =
                "give a finite number: with this one the check would pass or fail for any result";
            self.problems.refuse(path, format!("it is {number}"), help);
            return None;
        }
        Some(expression)
    }

    /// A number made of constants.
    fn number(&mut self, path: &str, written: &NumberOrExpression) -> Option<f64> {
        self.number_or_expression(Scope::Constants, path, written)?
            .as_number()
    }

    /// A time of the run.
    fn time(&mut self, path: &str, written: Option<&NumberOrExpression>, default: f64) -> f64 {
        let Some(time) = written.and_then(|w| self.number(path, w)) else {
            return default;
        };
        let expected = format!("a time between 0 and the end of the run ({} s)", self.end);
        let end = self.end * (1.0 + 1e-12);
        self.problems
            .number(path, time, (0.0..=end).contains(&time), &expected);
        time
    }

    /// A column of the history.
    pub fn column(&mut self, path: &str, written: &ColumnWritten) -> Option<Column> {
        column_name(self.problems, &format!("{path}.name"), &written.name);
        if written.unit.contains(['[', ']']) {
            let (path, unit) = (format!("{path}.unit"), &written.unit);
            let message = format!("`{path}` is \"{unit}\", expected a unit without brackets");
            self.problems.refuse(
                &path,
                message,
                "the header of the history has it in brackets",
            );
        }
        let value = self.compile(Scope::All, &format!("{path}.value"), &written.value)?;
        Some(Column {
            name: written.name.clone(),
            unit: written.unit.clone(),
            value,
        })
    }

    /// A check, with the numbers of its reference if that is a table.
    pub fn check(&mut self, path: &str, written: &CheckWritten) -> Option<Check> {
        if written.source.trim().is_empty() {
            self.problems.refuse(
                &format!("{path}.source"),
                "a check without a source",
                "say where the expected figure comes from: paper and section, or closed form",
            );
        }
        let end = self.end;
        let at = format!("{path}.when.at");
        let when = written.when.map(|time| self.time(&at, Some(time), end));
        let from = self.time(&format!("{path}.from"), written.from.as_ref(), 0.0);
        let to = self.time(&format!("{path}.to"), written.to.as_ref(), self.end);
        if to < from {
            self.problems.refuse(
                &format!("{path}.to"),
                format!("the window ends at {to} s, before it begins at {from} s"),
                "exchange `from` and `to`",
            );
        }
        let value = self.compile(Scope::All, &format!("{path}.value"), &written.value);
        let expected = self.expected(path, written, when);
        Some(Check {
            name: written.name.clone(),
            value: value?,
            when,
            window: [from, to],
            expected: expected?,
            source: written.source.clone(),
        })
    }

    fn expected(
        &mut self,
        path: &str,
        written: &CheckWritten,
        when: When,
    ) -> Option<Expected<Expression, Reference>> {
        let CheckWritten { name, expected, .. } = written;
        let forms = [
            expected.at_least.is_some(),
            expected.at_most.is_some(),
            expected.between.is_some(),
            expected.reference.is_some(),
        ];
        let count = forms.iter().filter(|present| **present).count();
        if count != 1 {
            self.problems.refuse_key(
                path,
                format!(
                    "check \"{name}\" has {count} of `at_least`, `at_most`, `between`, `reference`, \
                     expected exactly one"
                ),
                "say what the value must be, in one way",
            );
            return None;
        }
        let [tolerance, relative, scale] = self.distances(path, written, when);
        let reference = expected.reference.as_ref();
        let reference = reference.and_then(|written| self.reference(path, written, when));
        let mut number = |key: &str, scope: Scope, written: Option<&NumberOrExpression>| {
            let path = format!("{path}.{key}");
            let number = self.number_or_expression(scope, &path, written?)?;
            if scope == Scope::Constants {
                let tolerance = number.as_number()?;
                self.problems.not_negative(&path, tolerance, "a tolerance");
            }
            Some(number)
        };
        let between = expected.between.as_ref().and_then(|[lower, upper]| {
            let lower = number("between.0", Scope::Unchanging, Some(lower));
            let upper = number("between.1", Scope::Unchanging, Some(upper));
            Some([lower?, upper?])
        });
        let expected = Expected {
            at_least: number("at_least", Scope::Unchanging, expected.at_least.as_ref()),
            at_most: number("at_most", Scope::Unchanging, expected.at_most.as_ref()),
            between,
            reference,
            tolerance: number("tolerance", Scope::Constants, tolerance),
            relative_tolerance: number("relative_tolerance", Scope::Constants, relative),
            scale: number("scale", Scope::Unchanging, scale),
        };
        let divisors = match &expected.reference {
            Some(Reference::Expression(reference)) if relative.is_some() => [Some(reference), None],
            _ => [None, expected.scale.as_ref()],
        };
        let ends = expected.between.as_ref();
        if let Some([Some(lower), Some(upper)]) =
            ends.map(|ends| ends.each_ref().map(Expression::as_number))
            && lower > upper
        {
            self.problems.refuse(
                &format!("{path}.between"),
                format!("no number is between {lower} and {upper}: the check cannot pass"),
                "give the lower bound first",
            );
        }
        for (key, divisor) in ["reference", "scale"].into_iter().zip(divisors) {
            if divisor.is_some_and(|divisor| divisor.as_number() == Some(0.0)) {
                self.problems.refuse(
                    &format!("{path}.{key}"),
                    "distances are divided by it, and it is 0: the check cannot pass",
                    "give a `tolerance` in the value's unit, without a `scale`",
                );
            }
        }
        Some(expected)
    }

    /// The tolerance, the relative tolerance and the scale of a reference; refuses what has no effect, is missing or is there twice.
    fn distances<'w>(
        &mut self,
        path: &str,
        CheckWritten { name, expected, .. }: &'w CheckWritten,
        when: When,
    ) -> [Option<&'w NumberOrExpression>; 3] {
        let distances = [
            ("tolerance", &expected.tolerance),
            ("relative_tolerance", &expected.relative_tolerance),
            ("scale", &expected.scale),
        ];
        let near = expected.reference.is_some();
        for (key, _) in distances
            .iter()
            .filter(|(_, given)| given.is_some() && !near)
        {
            let path = format!("{path}.{key}");
            let message = format!("`{key}` has no effect on a bound");
            self.problems
                .refuse_key(&path, message, "it belongs to `reference`");
        }
        if !near && matches!(when, When::MaxError | When::RmsError) {
            self.problems.refuse(
                &format!("{path}.when"),
                "an error needs a reference to compare with",
                "give a `reference` and a tolerance, or use `max` or `rms`",
            );
        }
        let all = distances.map(|(_, given)| given.as_ref().filter(|_| near));
        let [tolerance, relative, scale] = all;
        if near && tolerance.is_some() == relative.is_some() {
            let has = if tolerance.is_some() {
                "both"
            } else {
                "neither"
            };
            let message = format!(
                "check \"{name}\" has {has} of `tolerance` and `relative_tolerance`, expected one"
            );
            let help = "`tolerance` is in the value's unit, `relative_tolerance` a fraction of \
                        the reference";
            self.problems.refuse_key(path, message, help);
        }
        if scale.is_some() && relative.is_some() {
            self.problems.refuse_key(
                &format!("{path}.scale"),
                "`scale` and `relative_tolerance` both divide the error",
                "use `scale` with `tolerance`",
            );
        }
        all
    }

    fn reference(
        &mut self,
        path: &str,
        written: &ReferenceWritten,
        when: When,
    ) -> Option<Reference> {
        let path = format!("{path}.reference");
        let scope = match when {
            When::Rise | When::TimeOfMax | When::Mean | When::Rms => Scope::Unchanging,
            _ => Scope::All,
        };
        match written {
            ReferenceWritten::Plain(plain) => self
                .number_or_expression(scope, &path, plain)
                .map(Reference::Expression),
            ReferenceWritten::Table(table) => {
                if scope == Scope::Unchanging {
                    self.problems.refuse(
                        &path,
                        "a mean, a rise or a time cannot be compared with a table over time",
                        "use `when = \"rms_error\"`, or a number",
                    );
                }
                self.table(&path, table).map(Reference::Table)
            }
        }
    }

    fn table(&mut self, path: &str, written: &TableWritten) -> Option<Vec<[f64; 2]>> {
        let rows = match (&written.csv, &written.points) {
            (Some(csv), None) => {
                let time = written.t.as_deref().unwrap_or("t");
                let value = written.value.as_deref().unwrap_or("value");
                match read_csv(&self.directory.join(csv), time, value) {
                    Ok(rows) => rows,
                    Err((message, help)) => {
                        self.problems.refuse(&format!("{path}.csv"), message, help);
                        return None;
                    }
                }
            }
            (None, Some(points)) => points.clone(),
            _ => {
                let help = "a file with `csv = \"file.csv\"`, or the numbers with `points`";
                self.problems
                    .refuse(path, "a table needs one of `csv` and `points`", help);
                return None;
            }
        };
        let ordered = rows.windows(2).all(|pair| pair[0][0] < pair[1][0]);
        let finite = rows.iter().flatten().all(|number| number.is_finite());
        if rows.is_empty() || !ordered || !finite {
            self.problems.refuse(
                path,
                "a table over time needs at least one row, finite numbers, and times that grow",
                "sort the rows by time and drop repeated times",
            );
            return None;
        }
        Some(rows)
    }
}

/// Two columns of a CSV file with a header.
fn read_csv(file: &Path, time: &str, value: &str) -> Result<Vec<[f64; 2]>, (String, String)> {
    let shown = file.display();
    let table = Table::read(file).map_err(|error| {
        let help = "CSV files are looked for beside the scene file; a header, then rows of as many numbers";
        (format!("cannot read {shown}: {error}"), help.to_owned())
    })?;
    let column = |name: &str| {
        table.column(name).ok_or_else(|| {
            let names = table.columns.iter().map(|column| column.name.as_str());
            let help = suggestion(name, "columns of the file", names);
            (format!("{shown} has no column `{name}`"), help)
        })
    };
    let columns = [column(time)?, column(value)?];
    for column in columns {
        if let Some(row) = column.values.iter().position(|number| number.is_nan()) {
            let (name, cell) = (&column.name, &column.cells[row]);
            let message = format!(
                "{shown}: \"{cell}\" in row {} of `{name}` is not a number",
                row + 1
            );
            return Err((message, "use a point for decimals".to_owned()));
        }
    }
    let [times, values] = columns.map(|column| &column.values);
    Ok(times.iter().zip(values).map(|(&t, &v)| [t, v]).collect())
}

/// Refuses plastic strain in frames if no material has it.
pub(super) fn plastic_strain<'a>(
    problems: &mut Problems,
    written: &OutputWritten,
    mut models: impl Iterator<Item = &'a MaterialModel>,
) {
    let mut asked = written.fields.iter().flatten();
    if asked.any(|&field| field == Field::PlasticStrain)
        && !models.any(MaterialModel::keeps_plastic_strain)
    {
        problems.refuse(
            "output.fields",
            "`output.fields` names `plastic_strain`, which no material of the scene keeps",
            "von_mises and mu_i keep it, drucker_prager and mohr_coulomb with `critical_state` or `separates`",
        );
    }
}
