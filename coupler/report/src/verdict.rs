//! The checks of a run in words: what was expected is said as the scene says it.

use coupler::record::check::CheckResult;
use coupler::record::quantity::{slice_unit, unit_of};
use coupler::scene::Scene;
use toml::{Table, Value};

use crate::record::{Record, Verdict};
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
    let verdicts: Vec<Verdict> = checks.iter().map(Verdict::from).collect();
    judged(&written, &verdicts, "")
}

/// The checks that a scene asks for.
fn checks_of(scene: &Table) -> impl Iterator<Item = &Table> {
    let checks = scene.get("check").and_then(Value::as_array);
    checks.into_iter().flatten().filter_map(Value::as_table)
}

fn judged<'a>(
    scene: &Table,
    verdicts: impl IntoIterator<Item = &'a Verdict>,
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

fn row(verdict: &Verdict, check: Option<&Table>, scene: &Table, run: &str) -> Row {
    let none = Table::new();
    let check = check.unwrap_or(&none);
    let unit = verdict.unit.clone().unwrap_or_else(|| unit(check, scene));
    let meant = &verdict.expected;
    let relative = meant.relative_tolerance.is_some() || check.contains_key("relative_tolerance");
    let scaled = meant.scale.is_some() || check.contains_key("scale");
    let near = meant.reference.is_some() || check.contains_key("reference");
    let scale = meant.scale.map(|scale| quantity(scale, &unit));
    let scale = scale.unwrap_or_else(|| "scale".to_owned());
    // What distances are told in.
    let distance = |number: Option<f64>| match number {
        None => "none".to_owned(),
        Some(number) if relative => format!("{}\u{a0}%", self::number(100.0 * number)),
        Some(number) if scaled => format!("{}\u{a0}% of {scale}", self::number(100.0 * number)),
        Some(number) => quantity(number, &unit),
    };
    Row {
        run: run.to_owned(),
        result: if verdict.pass { "pass" } else { "fail" },
        name: verdict.name.clone(),
        when: when(check),
        value: told(verdict.value, &unit),
        expected: expected(verdict, check, &unit),
        error: match verdict.error {
            Some(0.0) if !near => "within".to_owned(),
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
fn told(number: Option<f64>, unit: &str) -> String {
    number.map_or_else(|| "none".to_owned(), |number| quantity(number, unit))
}

/// What a run had to show. The summary of an older build has one number, of which the scene says what it is.
fn expected(verdict: &Verdict, check: &Table, unit: &str) -> String {
    let meant = &verdict.expected;
    let bound = |key: &str, word: &str, number: Option<f64>| {
        let is_meant = number.is_some() || check.contains_key(key);
        is_meant.then(|| format!("{word} {}", told(number.or(verdict.reference), unit)))
    };
    let between = || match (meant.between, check.get("between")) {
        (Some(ends), _) => Some(ends.map(|end| told(end, unit)).join(" to ")),
        (None, Some(Value::Array(ends))) => {
            let ends: Vec<String> = ends.iter().map(|end| written(end, unit)).collect();
            Some(ends.join(" to "))
        }
        _ => None,
    };
    bound("at_least", "at least", meant.at_least)
        .or_else(|| bound("at_most", "at most", meant.at_most))
        .or_else(between)
        .unwrap_or_else(|| told(meant.reference.or(verdict.reference), unit))
}

/// A check that nobody has judged.
fn open(check: &Table, run: &str) -> Row {
    let unit = String::new();
    let forms = ["at_least", "at_most", "reference"];
    let words = ["at least ", "at most ", ""];
    let mut forms = forms.iter().zip(words);
    let expected =
        forms.find_map(|(key, word)| Some(format!("{word}{}", written(check.get(*key)?, &unit))));
    Row {
        run: run.to_owned(),
        result: "open",
        name: text(check, "name").to_owned(),
        when: when(check),
        value: String::new(),
        expected: expected.unwrap_or_default(),
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
    fn judged(check: &str, verdict: Verdict) -> Row {
        let check: Table = check.parse().unwrap();
        row(&verdict, Some(&check), &Table::new(), "x")
    }

    #[test]
    fn the_expected_value_is_written_as_in_the_scene() {
        let verdict = |reference: f64, error: f64, tolerance: f64| Verdict {
            value: Some(25.0),
            reference: Some(reference),
            error: Some(error),
            tolerance: Some(tolerance),
            pass: true,
            ..Verdict::default()
        };
        let between = judged(
            "between = [20, 27.5]\nunit = \"deg\"",
            verdict(23.75, 0.0, 0.0),
        );
        assert_eq!(between.value, "25\u{a0}deg");
        assert_eq!(between.expected, "20\u{a0}deg to 27.5\u{a0}deg");
        assert_eq!(
            (between.error.as_str(), between.allowed.as_str()),
            ("within", "")
        );
        let near = judged(
            "reference = 24.5\nrelative_tolerance = 0.03",
            verdict(24.5, 0.02, 0.03),
        );
        assert_eq!(
            (near.error.as_str(), near.allowed.as_str()),
            ("2\u{a0}%", "3\u{a0}%")
        );
        let scaled = Verdict {
            expected: Meant {
                reference: Some(24.5),
                tolerance: Some(0.03),
                scale: Some(50.0),
                ..Meant::default()
            },
            ..verdict(24.5, 0.01, 0.03)
        };
        let scaled = judged("reference = \"h\"\nscale = \"l\"\nunit = \"m\"", scaled);
        assert_eq!(
            (scaled.error.as_str(), scaled.allowed.as_str()),
            ("1\u{a0}% of 50\u{a0}m", "3\u{a0}% of 50\u{a0}m")
        );
        let most = judged("at_most = 26\nwhen = \"max\"", verdict(26.0, 0.0, 0.0));
        assert_eq!(
            (most.expected.as_str(), most.when),
            ("at most 26", "largest value")
        );
    }

    /// Ends that are expressions were written as such, in the page and in the line of a run.
    #[test]
    fn bounds_are_numbers_where_the_run_says_them() {
        let of = |expected: Meant, check: &str| {
            let verdict = Verdict {
                value: Some(25.0),
                reference: Some(23.75),
                error: Some(0.0),
                tolerance: Some(0.0),
                expected,
                ..Verdict::default()
            };
            judged(check, verdict)
        };
        let check = "between = [\"0.8*angle\", \"1.1*angle\"]\nunit = \"deg\"";
        let ends = Meant {
            between: Some([Some(20.0), Some(27.5)]),
            ..Meant::default()
        };
        let told = of(ends, check);
        assert_eq!(told.expected, "20\u{a0}deg to 27.5\u{a0}deg");
        assert_eq!((told.error.as_str(), told.allowed.as_str()), ("within", ""));
        let least = Meant {
            at_least: Some(24.0),
            ..Meant::default()
        };
        // What the summary says is enough, whatever has become of the scene.
        assert_eq!(of(least, "").expected, "at least 24");
        let older = of(Meant::default(), check);
        assert_eq!(older.expected, "0.8*angle to 1.1*angle");
    }
}
