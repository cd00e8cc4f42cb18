//! The checks of a run in words: what was expected is said as the scene says it.

use coupler::record::check::{CheckResult, Meant};
use coupler::record::quantity::{slice_unit, unit_of};
use coupler::scene::Scene;
use toml::{Table, Value};

use crate::record::Record;
use crate::words::{number, quantity};

/// A check as a row of the page.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Row {
    /// Which run.
    pub run: String,
    /// `pass`, `fail`, or `open` of a run that has not come to its end.
    pub result: &'static str,
    /// What is checked.
    pub name: String,
    /// Of what moment or window.
    pub when: &'static str,
    /// What the run shows.
    pub value: String,
    /// What was expected.
    pub expected: String,
    /// How far it is off.
    pub error: String,
    /// How far it may be off.
    pub allowed: String,
    /// Where the expected figure comes from.
    pub source: String,
}

/// The checks of a run that has left a record, those that fail first.
pub fn rows(record: &Record, run: &str) -> Vec<Row> {
    let verdicts = record.summary.iter().flat_map(|summary| &summary.checks);
    let mut rows = judged(&record.written, verdicts, run);
    if rows.is_empty() {
        rows.extend(checks_of(&record.written).map(|check| open(check, run)));
    }
    rows
}

/// The checks of a run of `scene` that has just ended, those that fail first: nothing is read.
pub fn rows_of(scene: &Scene, checks: &[CheckResult]) -> Vec<Row> {
    let written = scene.resolved_toml.parse().unwrap_or_default();
    judged(&written, checks, "")
}

/// The checks that a scene asks for.
fn checks_of(scene: &Table) -> impl Iterator<Item = &Table> {
    let checks = scene.get("check").and_then(Value::as_array);
    checks.into_iter().flatten().filter_map(Value::as_table)
}

fn judged<'a>(
    scene: &Table,
    verdicts: impl IntoIterator<Item = &'a CheckResult>,
    run: &str,
) -> Vec<Row> {
    let verdicts = verdicts.into_iter().map(|verdict| {
        let check = checks_of(scene).find(|check| text(check, "name") == verdict.name);
        row(verdict, check, scene, run)
    });
    let mut rows: Vec<Row> = verdicts.collect();
    rows.sort_by_key(|row| row.result != "fail");
    rows
}

fn row(verdict: &CheckResult, check: Option<&Table>, scene: &Table, run: &str) -> Row {
    let none = Table::new();
    let check = check.unwrap_or(&none);
    let unit = unit(check, scene);
    let meant = verdict.expected.finite();
    let relative = meant.relative_tolerance.is_some();
    let scaled = meant.scale.is_some();
    let near = meant.reference.is_some();
    let scale = meant.scale.map(|scale| quantity(scale, &unit));
    let scale = scale.unwrap_or_else(|| "scale".to_owned());
    // What distances are told in.
    let distance = |number: f64| match number {
        number if !number.is_finite() => "none".to_owned(),
        number if relative => format!("{}\u{a0}%", self::number(100.0 * number)),
        number if scaled => format!("{}\u{a0}% of {scale}", self::number(100.0 * number)),
        number => quantity(number, &unit),
    };
    Row {
        run: run.to_owned(),
        result: if verdict.pass { "pass" } else { "fail" },
        name: verdict.name.clone(),
        when: when(check),
        value: with_unit(Some(verdict.value), &unit),
        expected: expected(&meant, check, &unit),
        error: match verdict.error {
            0.0 if !near => "within".to_owned(),
            error => distance(error),
        },
        allowed: if near {
            distance(verdict.tolerance)
        } else {
            String::new()
        },
        source: verdict.source.clone(),
    }
}

/// A number with its unit, if it could be had.
fn with_unit(number: Option<f64>, unit: &str) -> String {
    let number = number.filter(|number| number.is_finite());
    number.map_or_else(|| "none".to_owned(), |number| quantity(number, unit))
}

/// What a run had to show. If it has no sample, as the scene says it.
fn expected(meant: &Meant, check: &Table, unit: &str) -> String {
    match *meant {
        Meant {
            at_least: Some(least),
            ..
        } => format!("at least {}", quantity(least, unit)),
        Meant {
            at_most: Some(most),
            ..
        } => format!("at most {}", quantity(most, unit)),
        Meant {
            between: Some(ends),
            ..
        } => ends.map(|end| with_unit(end, unit)).join(" to "),
        Meant {
            reference: Some(reference),
            ..
        } => quantity(reference, unit),
        _ => asked(check, unit),
    }
}

/// What a check asks for, as the scene says it.
fn asked(check: &Table, unit: &str) -> String {
    if let Some(Value::Array(ends)) = check.get("between") {
        let ends: Vec<String> = ends.iter().map(|end| written(end, unit)).collect();
        return ends.join(" to ");
    }
    let forms = [
        ("at_least", "at least "),
        ("at_most", "at most "),
        ("reference", ""),
    ];
    let mut forms = forms.into_iter();
    let asked =
        forms.find_map(|(key, word)| Some(format!("{word}{}", written(check.get(key)?, unit))));
    asked.unwrap_or_default()
}

/// A check that nobody has judged.
fn open(check: &Table, run: &str) -> Row {
    Row {
        run: run.to_owned(),
        result: "open",
        name: text(check, "name").to_owned(),
        when: when(check),
        value: String::new(),
        expected: asked(check, ""),
        error: String::new(),
        allowed: String::new(),
        source: text(check, "source").to_owned(),
    }
}

fn text<'a>(table: &'a Table, key: &str) -> &'a str {
    table.get(key).and_then(Value::as_str).unwrap_or_default()
}

/// A number or an expression as the scene has it.
fn written(value: &Value, unit: &str) -> String {
    match value {
        Value::Float(x) => quantity(*x, unit),
        Value::Integer(n) => quantity(*n as f64, unit),
        Value::String(text) => text.clone(),
        _ => "a table over time".to_owned(),
    }
}

fn when(check: &Table) -> &'static str {
    match check.get("when") {
        None => "at the end",
        Some(Value::String(when)) => match when.as_str() {
            "end" => "at the end",
            "max" => "largest value",
            "min" => "smallest value",
            "rise" => "largest rise",
            "time_of_max" => "time of the largest value",
            "mean" => "mean over time",
            "rms" => "root mean square over time",
            "max_error" => "where the distance is largest",
            "rms_error" => "root mean square distance",
            _ => "",
        },
        Some(_) => "at a moment",
    }
}

/// The unit of a check's value: its own, that of a column that is the same, that of the quantity; else none.
fn unit(check: &Table, scene: &Table) -> String {
    if text(check, "when") == "time_of_max" {
        return "s".to_owned();
    }
    if let Some(Value::String(unit)) = check.get("unit") {
        return unit.clone();
    }
    let value = text(check, "value");
    let columns = scene.get("output").and_then(|output| output.get("column"));
    let columns = columns.and_then(Value::as_array).into_iter().flatten();
    let same = columns
        .filter_map(Value::as_table)
        .find(|column| text(column, "value") == value);
    if let Some(column) = same {
        return text(column, "unit").to_owned();
    }
    // A pure number is told without one.
    let unit = unit_of(value).filter(|unit| *unit != "1");
    let of_slice = scene.contains_key("thickness");
    let unit = unit.map(|unit| slice_unit(unit).filter(|_| of_slice).unwrap_or(unit));
    unit.unwrap_or_default().to_owned()
}

#[cfg(test)]
mod tests {
    use coupler::record::check::Meant;

    use super::*;

    #[test]
    fn a_value_has_the_unit_of_its_quantity() {
        let scene: Table =
            "[[output.column]]\nname = \"a\"\nunit = \"mm\"\nvalue = \"1000*body.a.x\"\n"
                .parse()
                .unwrap();
        for (value, expected) in [
            ("body.a.x", "m"),
            ("initial.body.a.vx", "m/s"),
            ("energy.kinetic", "J/m"),
            ("energy.residual_relative", ""),
            ("momentum_error", ""),
            ("body.a.contacts", ""),
            ("1000*body.a.x", "mm"),
            ("body.a.x / body.b.x", ""),
        ] {
            let check = Table::from_iter([("value".to_owned(), Value::from(value))]);
            assert_eq!(unit(&check, &scene), expected, "{value}");
        }
        let slice: Table = "thickness = 0.01".parse().unwrap();
        for (value, expected) in [
            ("energy.kinetic", "J"),
            ("momentum.x", "N s"),
            ("contact.force.y", "N"),
            ("body.a.mass", "kg"),
            ("body.a.inertia", "kg m^2"),
            ("body.a.torque", "N m"),
            ("body.a.vx", "m/s"),
            ("probe.middle.uy", "m"),
            ("body.a.spin", "rad/s"),
        ] {
            let check = Table::from_iter([("value".to_owned(), Value::from(value))]);
            assert_eq!(unit(&check, &slice), expected, "{value}");
            let check: Table = format!("value = \"{value}\"\nwhen = \"time_of_max\"")
                .parse()
                .unwrap();
            assert_eq!(unit(&check, &slice), "s", "{value}");
        }
    }

    #[expect(clippy::needless_pass_by_value, reason = "a row of a table of cases")]
    fn judged(check: &str, verdict: CheckResult) -> Row {
        let check: Table = check.parse().unwrap();
        row(&verdict, Some(&check), &Table::new(), "x")
    }

    fn verdict(expected: Meant, error: f64, tolerance: f64) -> CheckResult {
        CheckResult {
            value: 25.0,
            expected,
            error,
            tolerance,
            pass: true,
            ..CheckResult::default()
        }
    }

    /// Ends that are expressions were written as such, in the page and in the line of a run.
    #[test]
    fn the_expected_value_is_a_number_where_the_run_says_it() {
        let none = Meant::default();
        let check = "between = [\"0.8*angle\", \"1.1*angle\"]\nunit = \"deg\"";
        let ends = Meant {
            between: Some([Some(20.0), Some(27.5)]),
            ..none
        };
        let between = judged(check, verdict(ends, 0.0, 0.0));
        assert_eq!(between.value, "25\u{a0}deg");
        assert_eq!(between.expected, "20\u{a0}deg to 27.5\u{a0}deg");
        assert_eq!(
            (between.error.as_str(), between.allowed.as_str()),
            ("within", "")
        );
        let near = Meant {
            reference: Some(24.5),
            relative_tolerance: Some(0.03),
            ..none
        };
        let near = judged("reference = 24.5", verdict(near, 0.02, 0.03));
        assert_eq!(
            (near.error.as_str(), near.allowed.as_str()),
            ("2\u{a0}%", "3\u{a0}%")
        );
        let scaled = Meant {
            reference: Some(24.5),
            tolerance: Some(0.03),
            scale: Some(50.0),
            ..none
        };
        let scaled = judged("unit = \"m\"", verdict(scaled, 0.01, 0.03));
        assert_eq!(
            (scaled.error.as_str(), scaled.allowed.as_str()),
            ("1\u{a0}% of 50\u{a0}m", "3\u{a0}% of 50\u{a0}m")
        );
        let most = Meant {
            at_most: Some(26.0),
            ..none
        };
        let most = judged("when = \"max\"", verdict(most, 0.0, 0.0));
        assert_eq!(
            (most.expected.as_str(), most.when),
            ("at most 26", "largest value")
        );
        // A run without a sample, and one whose scene has gone.
        let unseen = judged(check, verdict(none, f64::NAN, f64::NAN));
        assert_eq!(unseen.expected, "0.8*angle to 1.1*angle");
        assert_eq!(unseen.error, "none");
        let least = Meant {
            at_least: Some(24.0),
            ..none
        };
        assert_eq!(judged("", verdict(least, 0.0, 0.0)).expected, "at least 24");
    }
}
