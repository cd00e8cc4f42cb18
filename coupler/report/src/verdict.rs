//! The checks of a run in words: what was expected is written as in the scene.

use coupler::record::check::{Check, CheckResult, When};
use coupler::scene::Scene;

use crate::record::Record;
use crate::words::{DIGITS, in_digits, number, with_unit};

/// A check as a row of the page.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
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
    /// Why it fails, if the numbers do not show it; else empty.
    pub reason: String,
}

/// The checks of a run that has left a record: those that fail first, and last those that it has not come to.
pub fn rows(record: &Record, run: &str) -> Vec<Row> {
    let verdicts = || record.summary.iter().flat_map(|summary| &summary.checks);
    let mut rows = judged(record.scene.as_ref(), verdicts(), run);
    let checks = record.scene.iter().flat_map(|scene| &scene.checks);
    let left = checks.filter(|check| verdicts().all(|verdict| verdict.name != check.name));
    rows.extend(left.map(|check| open(check, run)));
    rows
}

/// How many of a run's checks pass, in words.
pub fn passing(record: &Record) -> String {
    let rows = rows(record, "");
    let of = |result: &str| rows.iter().filter(|row| row.result == result).count();
    match &record.summary {
        None => "–".to_owned(),
        Some(summary) if summary.checks.is_empty() => "none judged".to_owned(),
        Some(_) => format!("{} of {}", of("pass"), rows.len()),
    }
}

/// The checks of a run of `scene` that has just ended, those that fail first: nothing is read.
pub fn rows_of(scene: &Scene, checks: &[CheckResult]) -> Vec<Row> {
    judged(Some(scene), checks, "")
}

fn judged<'a>(
    scene: Option<&Scene>,
    verdicts: impl IntoIterator<Item = &'a CheckResult>,
    run: &str,
) -> Vec<Row> {
    let verdicts = verdicts.into_iter();
    let mut rows: Vec<Row> = verdicts.map(|verdict| row(verdict, scene, run)).collect();
    rows.sort_by_key(|row| row.result != "fail");
    rows
}

fn row(verdict: &CheckResult, scene: Option<&Scene>, run: &str) -> Row {
    let of_scene = scene.and_then(|scene| {
        let mut checks = scene.checks.iter();
        let check = checks.find(|check| check.name == verdict.name)?;
        Some((check, unit(check, scene)))
    });
    let (check, unit) = of_scene.unzip();
    let unit = unit.unwrap_or_default();
    let meant = &verdict.expected;
    let finite = |number: &Option<f64>| number.filter(|number| number.is_finite());
    let relative = meant.relative_tolerance.is_some();
    let scale = meant.scale.as_ref().and_then(finite);
    let near = meant.reference.as_ref().and_then(finite).is_some();
    let digits = digits(verdict);
    let quantity = |number: f64| with_unit(in_digits(number, digits), &unit);
    // The units of distances.
    let distance = |number: f64| match scale {
        _ if !number.is_finite() => "none".to_owned(),
        _ if relative => format!("{}\u{a0}%", in_digits(100.0 * number, digits)),
        Some(scale) => {
            let scale = quantity(scale);
            format!("{}\u{a0}% of {scale}", in_digits(100.0 * number, digits))
        }
        None => quantity(number),
    };
    let in_unit = |number: &Option<f64>| Some(quantity(finite(number)?));
    Row {
        run: run.to_owned(),
        result: if verdict.pass { "pass" } else { "fail" },
        name: verdict.name.clone(),
        when: check.map_or("", |check| when(check.when)),
        value: in_unit(&Some(verdict.value)).unwrap_or_else(|| "none".to_owned()),
        expected: meant
            .in_words(in_unit, in_unit)
            .or_else(|| Some(check?.expectation(quantity)))
            .unwrap_or_default(),
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
        reason: verdict.reason.clone().unwrap_or_default(),
    }
}

/// Digits with which the numbers of a check that fails do not read as if it held: `1 s` is not at most `0.99999 s`.
fn digits(verdict: &CheckResult) -> i32 {
    if verdict.pass || verdict.reason.is_some() {
        return DIGITS;
    }
    let read = |number: f64, digits: i32| {
        let text = in_digits(number, digits).replace('\u{202f}', "");
        text.parse().unwrap_or(f64::NAN)
    };
    let apart = |k: &i32| read(verdict.error, *k) > read(verdict.tolerance, *k);
    let least = (DIGITS..=17).find(apart).unwrap_or(DIGITS);
    // The distance of a mean over time is not that of the two numbers, which may not show it with any digits.
    let fails = |k: &i32| {
        let [value, reference] = [verdict.value, verdict.reference].map(|number| read(number, *k));
        let number = |number: &Option<f64>| number.map(|number| read(number, *k));
        let meant = verdict.expected.map(number, number);
        let judged = meant.judge(value, (value - reference).abs());
        // 1.01 - 1 is more than 0.01 by rounding.
        judged.error > judged.tolerance * (1.0 + 1e-9)
    };
    (least..=17).find(fails).unwrap_or(least)
}

/// A check that nobody has judged.
fn open(check: &Check, run: &str) -> Row {
    Row {
        run: run.to_owned(),
        result: "open",
        name: check.name.clone(),
        when: when(check.when),
        expected: check.expectation(self::number),
        source: check.source.clone(),
        ..Row::default()
    }
}

fn when(when: When) -> &'static str {
    match when {
        When::End => "at the end",
        When::At(_) => "at a moment",
        When::Max => "largest value",
        When::Min => "smallest value",
        When::Rise => "largest rise",
        When::TimeOfMax => "time of the largest value",
        When::Mean => "mean over time",
        When::Rms => "root mean square over time",
        When::MaxError => "where the distance is largest",
        When::RmsError => "root mean square distance",
    }
}

/// The unit of a check's value: that of a column that is the same, that of the quantity; else none.
fn unit(check: &Check, scene: &Scene) -> String {
    if check.when == When::TimeOfMax {
        return "s".to_owned();
    }
    let value = check.value.source();
    let mut columns = scene.output.columns.iter();
    if let Some(same) = columns.find(|column| column.value.source() == value) {
        return same.unit.clone();
    }
    // A pure number has none.
    let unit = scene.quantities.unit_of(value).filter(|unit| *unit != "1");
    unit.unwrap_or_default().to_owned()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use coupler::record::Summary;
    use coupler::record::check::Meant;
    use coupler::scene::SceneFile;

    use super::*;

    /// Two discs and a check of the first of them.
    fn scene(check: &str, more: &str) -> Scene {
        let text = format!(
            "version = 1\nname = \"x\"\ntime.end = 1.0\n{more}\n\
             output = {{ every = 0.1, column = [{{ name = \"a\", unit = \"mm\", value = \"1000*body.a.x\" }}] }}\n\
             [[dem.body]]\nname = \"a\"\nshape = \"disc\"\nsphero_radius = 0.1\ndensity = 1000.0\n\
             [[dem.body]]\nname = \"b\"\nshape = \"disc\"\nsphero_radius = 0.1\nmotion = \"fixed\"\n\
             [[check]]\nname = \"c\"\nsource = \"a paper\"\n{check}\n"
        );
        let file = SceneFile::of_text("x.toml", &text, Path::new(".")).unwrap();
        let scene = file.scene(None, &[]);
        scene.unwrap_or_else(|errors| panic!("{errors}"))
    }

    #[test]
    fn a_value_has_the_unit_of_its_quantity() {
        let of = |value: &str, more: &str| {
            let scene = scene(&format!("value = \"{value}\"\nat_least = 0.0"), more);
            unit(&scene.checks[0], &scene)
        };
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
            assert_eq!(of(value, ""), expected, "{value}");
        }
        for (value, expected) in [
            ("energy.kinetic", "J"),
            ("momentum.x", "N s"),
            ("contact.force.y", "N"),
            ("body.a.mass", "kg"),
            ("body.a.inertia", "kg m^2"),
            ("body.a.torque", "N m"),
            ("body.a.vx", "m/s"),
            ("body.a.spin", "rad/s"),
        ] {
            assert_eq!(of(value, "thickness = 0.01"), expected, "{value}");
        }
        let latest = scene(
            "value = \"body.a.x\"\nwhen = \"time_of_max\"\nat_least = 0.0",
            "",
        );
        assert_eq!(unit(&latest.checks[0], &latest), "s");
    }

    fn judged(check: &str, expected: Meant, error: f64, tolerance: f64) -> Row {
        let verdict = CheckResult {
            name: "c".into(),
            value: 25.0,
            expected,
            error,
            tolerance,
            pass: true,
            ..CheckResult::default()
        };
        let check = format!("value = \"1000*body.a.x\"\n{check}");
        let scene = scene(&check, "constants = { angle = 25.0 }");
        row(&verdict, Some(&scene), "x")
    }

    /// `FAIL 1 s, expected at most 1 s`.
    #[test]
    fn a_check_that_fails_does_not_read_as_if_it_held() {
        let none = Meant::default();
        let bound = |bound| Some(Some(bound));
        let near = Meant {
            reference: bound(1.0),
            tolerance: bound(0.01),
            ..none
        };
        let relative = Meant {
            tolerance: None,
            relative_tolerance: bound(0.01),
            ..near
        };
        let at_most = |most| Meant {
            at_most: bound(most),
            ..none
        };
        let rows = [
            (1.0, at_most(0.99999), ["1", "at most 0.99999", ""]),
            (2.0, at_most(0.99999), ["2", "at most 1", ""]),
            (1.010_001, near, ["1.010001", "1", "0.01"]),
            (1.010_001, relative, ["1.010001", "1", "1\u{a0}%"]),
            (1.02, near, ["1.02", "1", "0.01"]),
        ];
        for (value, expected, words) in rows {
            let row = row(&expected.judge(value, (value - 1.0).abs()), None, "x");
            assert_eq!([&row.value, &row.expected, &row.allowed], words);
        }
        // The root mean square of the distance says nothing of the two numbers beside it.
        let row = row(&near.judge(1.0, 0.010_001), None, "x");
        assert_eq!(
            [&row.value, &row.error, &row.allowed],
            ["1", "0.010001", "0.01"]
        );
    }

    /// Only those that were over were shown.
    #[test]
    fn a_check_that_a_run_has_not_come_to_is_shown_as_open() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("history.csv"), "time [s]\n0\n").unwrap();
        let mut record = Record::read(dir.path()).unwrap();
        let more =
            "[[check]]\nname = \"early\"\nvalue = \"t\"\nto = 0.0\nat_most = 1.0\nsource = \"s\"";
        record.scene = Some(scene(&format!("value = \"t\"\nat_most = 1.0\n{more}"), ""));
        let results = |record: &Record| -> Vec<(String, &str)> {
            let rows = rows(record, "").into_iter();
            rows.map(|row| (row.name, row.result)).collect()
        };
        let open = |name: &str| (name.to_owned(), "open");
        assert_eq!(results(&record), [open("c"), open("early")]);
        assert_eq!(passing(&record), "–");
        let verdict = CheckResult {
            name: "early".into(),
            pass: true,
            ..CheckResult::default()
        };
        record.summary = Some(Summary {
            checks: vec![verdict],
            ..Summary::default()
        });
        assert_eq!(results(&record), [("early".into(), "pass"), open("c")]);
        assert_eq!(passing(&record), "1 of 2");
    }

    /// Ends that are expressions were written as such, in the page and in the line of a run.
    #[test]
    fn the_expected_value_is_a_number_where_the_run_says_it() {
        let none = Meant::default();
        let check = "between = [\"0.8*angle\", \"initial.body.a.x\"]";
        let ends = Meant {
            between: Some([Some(20.0), Some(27.5)]),
            ..none
        };
        let between = judged(check, ends, 0.0, 0.0);
        assert_eq!(between.value, "25\u{a0}mm");
        assert_eq!(between.expected, "20\u{a0}mm to 27.5\u{a0}mm");
        assert_eq!(
            (between.error.as_str(), between.allowed.as_str()),
            ("within", "")
        );
        let near = Meant {
            reference: Some(Some(24.5)),
            relative_tolerance: Some(Some(0.03)),
            ..none
        };
        let near = judged(
            "reference = 24.5\nrelative_tolerance = 0.03",
            near,
            0.02,
            0.03,
        );
        assert_eq!(
            (near.error.as_str(), near.allowed.as_str()),
            ("2\u{a0}%", "3\u{a0}%")
        );
        let scaled = Meant {
            reference: Some(Some(24.5)),
            tolerance: Some(Some(0.03)),
            scale: Some(Some(50.0)),
            ..none
        };
        let check_of_scale = "reference = 24.5\ntolerance = 0.03\nscale = 50.0";
        let scaled = judged(check_of_scale, scaled, 0.01, 0.03);
        assert_eq!(
            (scaled.error.as_str(), scaled.allowed.as_str()),
            ("1\u{a0}% of 50\u{a0}mm", "3\u{a0}% of 50\u{a0}mm")
        );
        let most = Meant {
            at_most: Some(Some(26.0)),
            ..none
        };
        let most = judged("when = \"max\"\nat_most = 26.0", most, 0.0, 0.0);
        assert_eq!(
            (most.expected.as_str(), most.when),
            ("at most 26\u{a0}mm", "largest value")
        );
        // A run without a sample, and one whose scene has gone.
        let unseen = judged(check, none, f64::NAN, f64::NAN);
        assert_eq!(unseen.expected, "20\u{a0}mm to initial.body.a.x");
        assert_eq!(unseen.error, "none");
        let least = Meant {
            at_least: Some(Some(24.0)),
            ..none
        };
        let gone = CheckResult {
            expected: least,
            ..CheckResult::default()
        };
        assert_eq!(row(&gone, None, "x").expected, "at least 24");
    }
}
