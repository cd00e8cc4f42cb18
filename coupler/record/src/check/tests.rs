use super::*;
use mechanics::expression::Meaning;
use serde_json::json;

/// Slots: time, value, then both at `t_0`.
fn expression(source: &str) -> Expression {
    let meaning = |name: &str| match name {
        "t" => Some(Meaning::Slot(0)),
        "v" => Some(Meaning::Slot(1)),
        "initial.v" => Some(Meaning::Slot(3)),
        _ => None,
    };
    Expression::compile(source, &meaning).unwrap()
}

type Compiled = Expected<Expression, Reference>;

fn nothing() -> Compiled {
    let nothing = Meant::default();
    nothing.map(|_| expression("0"), |_| Reference::Table(Vec::new()))
}

fn near(reference: &str, tolerance: &str) -> Compiled {
    Compiled {
        reference: Some(Reference::Expression(expression(reference))),
        tolerance: Some(expression(tolerance)),
        ..nothing()
    }
}

fn relative(reference: &str, tolerance: &str) -> Compiled {
    Compiled {
        relative_tolerance: Some(expression(tolerance)),
        tolerance: None,
        ..near(reference, tolerance)
    }
}

fn scaled(reference: &str, tolerance: &str, scale: &str) -> Compiled {
    Compiled {
        scale: Some(expression(scale)),
        ..near(reference, tolerance)
    }
}

fn at_least(bound: &str) -> Compiled {
    Compiled {
        at_least: Some(expression(bound)),
        ..nothing()
    }
}

fn at_most(bound: &str) -> Compiled {
    Compiled {
        at_most: Some(expression(bound)),
        ..nothing()
    }
}

fn between(lower: &str, upper: &str) -> Compiled {
    Compiled {
        between: Some([lower, upper].map(expression)),
        ..nothing()
    }
}

fn run(when: When, window: [f64; 2], expected: Compiled, rows: &[[f64; 2]]) -> CheckResult {
    let check = Check {
        name: "c".into(),
        value: expression("v"),
        when,
        window,
        expected,
        source: "s".into(),
    };
    let twice = Column {
        name: "twice".into(),
        unit: "m".into(),
        value: expression("2*v - initial.v"),
    };
    let mut recorder = Recorder::new(&[twice], &[check], 1.0);
    for row in rows {
        let of_history = recorder.record(row);
        let expected = 2.0 * row[1] - rows[0][1];
        assert_eq!(of_history[0], row[0]);
        assert!(of_history[1] == expected || expected.is_nan());
    }
    assert_eq!(recorder.header(), ["time [s]", "twice [m]"]);
    recorder.finish().remove(0)
}

const ALL: [f64; 2] = [0.0, 10.0];
const RAMP: [[f64; 2]; 4] = [[0.0, 1.0], [1.0, 3.0], [2.0, 2.0], [4.0, 0.0]];

fn number(when: When, window: [f64; 2]) -> f64 {
    run(when, window, near("0", "1e9"), &RAMP).value
}

#[test]
fn a_history_becomes_one_number() {
    assert_eq!(number(When::End, ALL), 0.0);
    assert_eq!(number(When::End, [0.0, 2.0]), 2.0);
    assert_eq!(number(When::At(1.5), ALL), 2.5);
    assert_eq!(number(When::At(2.0), ALL), 2.0);
    assert_eq!(number(When::Max, ALL), 3.0);
    assert_eq!(number(When::Max, [1.5, 4.0]), 2.0);
    assert_eq!(number(When::Min, [0.0, 2.0]), 1.0);
    assert_eq!(number(When::Rise, ALL), 2.0);
    assert_eq!(number(When::Rise, [1.5, 4.0]), 0.0);
    assert_eq!(number(When::TimeOfMax, ALL), 1.0);
    assert_eq!(number(When::TimeOfMax, [1.5, 4.0]), 2.0);
    assert_eq!(number(When::Mean, ALL), (2.0 + 2.5 + 2.0) / 4.0);
    assert_eq!(number(When::Mean, [2.0, 2.0]), 2.0);
    // It was that from 1 to 2.
    assert_eq!(number(When::Mean, [0.5, 3.0]), (1.25 + 2.5 + 1.5) / 2.5);
    assert_eq!(number(When::Rms, [2.0, 4.0]), 2f64.sqrt());
}

#[test]
fn distances_from_a_moving_reference() {
    let result = run(When::MaxError, ALL, scaled("t", "0.5", "8"), &RAMP);
    assert_eq!(
        (result.value, result.reference, result.error),
        (0.0, 4.0, 0.5)
    );
    assert!(result.pass);
    let result = run(When::RmsError, [1.0, 2.0], near("t", "1.0"), &RAMP);
    assert_eq!(result.error, 2f64.sqrt());
    assert!(!result.pass);
    let table = Compiled {
        reference: Some(Reference::Table(vec![[1.0, 3.0], [3.0, 1.0]])),
        ..near("0", "0")
    };
    let result = run(When::MaxError, [1.0, 2.0], table, &RAMP);
    assert!(result.pass, "{result:?}");
}

/// Between two samples the value is linear, and the reference is that of the time.
#[test]
fn a_reference_is_that_of_its_time() {
    let table = Compiled {
        reference: Some(Reference::Table(vec![[1.0, 0.0], [1.5, 9.0], [2.0, 0.0]])),
        ..near("0", "1")
    };
    for (expected, reference) in [(near("t*t + v", "1"), 2.25 + 2.5), (table, 9.0)] {
        let result = run(When::At(1.5), ALL, expected, &RAMP);
        assert_eq!((result.value, result.reference), (2.5, reference));
    }
}

/// Of a relative error the largest share counts, not the share of the largest distance.
#[test]
fn a_relative_error_is_the_largest_at_any_sample() {
    let rows = [[0.0, 101.0], [1.0, 2.0]];
    let result = run(When::MaxError, ALL, relative("100 - 99*t", "0.1"), &rows);
    assert_eq!((result.error, result.pass), (1.0, false));
}

/// A check is judged when its window is recorded.
#[test]
fn a_run_that_is_cut_short_judges_what_it_has_recorded() {
    let check = |to: f64| Check {
        name: "c".into(),
        value: expression("v"),
        when: When::End,
        window: [0.0, to],
        expected: at_least("0"),
        source: "s".into(),
    };
    let mut recorder = Recorder::new(&[], &[check(1.0), check(1.5)], 2.0);
    assert!(recorder.so_far().is_empty());
    recorder.record(&[0.0, 1.0]);
    recorder.record(&[1.0, 1.0]);
    assert_eq!(recorder.so_far().len(), 1);
}

/// D5: these passed for any run.
#[test]
fn infinite_bounds_tolerances_and_scales_fail() {
    let infinite = "initial.v / 0";
    let rows = [[0.0, 1.0], [1.0, 5.0]];
    for expected in [
        at_most(infinite),
        at_least("-initial.v / 0"),
        between("0", infinite),
        scaled("0", "0.1", infinite),
        near("0", infinite),
        relative("1", infinite),
    ] {
        let result = run(When::End, [0.0, 1.0], expected, &rows);
        assert!(!result.pass, "{result:?}");
        assert!(
            result
                .reason
                .is_some_and(|reason| reason.contains("the expected value is not"))
        );
    }
}

/// They failed with 0/0 and nothing said why.
#[test]
fn what_divides_by_0_fails_with_a_reason() {
    for (expected, divisor) in [
        (relative("0*t", "0.1"), "the reference"),
        (scaled("1", "0.1", "0*initial.v"), "the scale"),
    ] {
        let result = run(When::End, ALL, expected, &RAMP);
        let reason = result.reason.unwrap();
        assert!(!result.pass && reason.starts_with(divisor), "{reason}");
    }
}

#[test]
fn bounds_pass_on_their_own_value() {
    let bound = |expected| run(When::Max, ALL, expected, &RAMP);
    assert!(bound(at_least("3*initial.v")).pass);
    assert!(bound(at_most("3")).pass);
    let result = bound(at_least("3.5"));
    assert_eq!(
        (result.pass, result.error, result.reference),
        (false, 0.5, 3.5)
    );
    assert!(bound(between("2", "3")).pass);
    let result = bound(between("1", "2"));
    assert_eq!(
        (result.pass, result.error, result.reference),
        (false, 1.0, 1.5)
    );
}

#[test]
fn relative_tolerance_is_a_fraction_of_the_reference() {
    let result = run(When::Max, ALL, relative("-2.5", "2.2"), &RAMP);
    assert_eq!((result.error, result.pass), (2.2, true));
}

#[test]
fn a_nan_anywhere_in_the_window_fails() {
    let rows = [[0.0, 1.0], [1.0, f64::NAN], [2.0, 1.0], [3.0, 2.0]];
    for when in [
        When::Max,
        When::Min,
        When::Rise,
        When::TimeOfMax,
        When::Mean,
        When::Rms,
        When::MaxError,
        When::RmsError,
    ] {
        let result = run(when, ALL, near("1", "1e9"), &rows[..]);
        assert!(
            !result.pass && result.reason.is_some(),
            "{when:?} {result:?}"
        );
    }
    let result = run(When::Max, ALL, at_most("1e9"), &rows);
    assert!(!result.pass);
    assert!(
        serde_json::to_string(&result)
            .unwrap()
            .contains("\"value\":null")
    );
}

#[test]
fn a_window_without_samples_fails_with_a_reason() {
    let result = run(When::Mean, [8.0, 9.0], near("1", "1.0"), &RAMP);
    assert!(!result.pass);
    assert!(
        result
            .reason
            .unwrap()
            .contains("no sample between 8 s and 9 s")
    );
    let result = run(When::At(7.0), ALL, near("1", "1.0"), &RAMP);
    assert!(result.reason.unwrap().contains("around 7 s"));
}

/// The summary gave a bound as `reference` with the tolerance 0, without saying that it was a bound.
#[test]
fn the_summary_says_what_is_expected_under_the_keys_of_the_scene() {
    for (expected, written) in [
        (at_least("3*initial.v"), json!({"at_least": 3.0})),
        (at_most("5"), json!({"at_most": 5.0})),
        (between("initial.v", "9"), json!({"between": [1.0, 9.0]})),
        (
            near("2 + t", "0.5"),
            json!({"reference": 3.0, "tolerance": 0.5}),
        ),
        (
            relative("2 + t", "0.5"),
            json!({"reference": 3.0, "relative_tolerance": 0.5}),
        ),
        (
            scaled("2 + t", "0.5", "4*initial.v"),
            json!({"reference": 3.0, "tolerance": 0.5, "scale": 4.0}),
        ),
        (at_most("1/0"), json!({"at_most": null})),
    ] {
        let result = run(When::Max, ALL, expected, &RAMP);
        let json = serde_json::to_value(&result).unwrap();
        assert_eq!(json["expected"], written);
        let read: Meant = serde_json::from_value(written).unwrap();
        let finite = |bound: Option<Option<f64>>| bound.filter(|x| x.is_some_and(f64::is_finite));
        let at_most = finite(result.expected.at_most);
        assert_eq!(
            read,
            Meant {
                at_most,
                ..result.expected
            }
        );
    }
}

/// A bound is known even if no value is compared with it.
#[test]
fn what_is_expected_is_said_of_a_window_that_was_not_reached() {
    let result = run(When::Max, [8.0, 9.0], at_most("5"), &RAMP);
    assert_eq!(
        (result.pass, result.expected.at_most),
        (false, Some(Some(5.0)))
    );
    let check = Check {
        name: "c".into(),
        value: expression("v"),
        when: When::End,
        window: ALL,
        expected: at_most("5*initial.v"),
        source: "s".into(),
    };
    let result = Recorder::new(&[], &[check], 1.0).finish().remove(0);
    assert_eq!((result.pass, result.expected), (false, Meant::default()));
}
