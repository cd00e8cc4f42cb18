//! Makes a case that fails smaller, whichever side it is of, and shows it: a case is data, of which parts are left out.

use serde_json::{Value, json};

use super::judge::show;
use super::plan;
use super::run::Case;

/// What is simple, by the key that has it.
fn plain() -> Vec<(&'static str, Value)> {
    let none = json!([0.0, 0.0]);
    let walls = json!({"left": "open", "right": "open", "bottom": "open", "top": "open"});
    vec![
        ("noise", none.clone()),
        ("gravity", none.clone()),
        ("body_contact", Value::Null),
        ("contact_pair", json!([])),
        ("group_pair", json!([])),
        ("pushes", json!([])),
        ("walls", walls),
        ("layers", json!(false)),
        ("transfer", json!("flip")),
        ("shape", json!("linear")),
        ("shape", json!("disc")),
        ("stress_update", json!("usf")),
        ("travel", json!([])),
        ("friction", json!(0.0)),
        ("damping_ratio", json!(0.0)),
        ("restitution", json!(1.0)),
        ("adhesion", json!(0.0)),
        ("damped_mass", json!(0.0)),
        ("spin", json!(0.0)),
        ("velocity", none.clone()),
        ("fields", json!({"velocity": null, "stress": null})),
        ("motion", json!("fixed")),
        ("motion", json!("free")),
        ("angle", json!(0.0)),
        ("position", none),
        ("present", json!([[0, u32::MAX]])),
        ("steps", json!([0, u32::MAX])),
        ("group", json!(0)),
        ("material", json!(0)),
        ("way", json!([[0, 0.0]])),
        ("shift", json!([0.0, 0.0])),
        ("turn", json!(0.0)),
        ("mirrored", json!(false)),
        ("reversed", json!(false)),
        ("window", json!(1)),
    ]
}

/// Makes a smaller case, or finds that it is none.
pub type Change<'a, C> = Box<dyn Fn() -> Option<C> + 'a>;

/// The smaller cases to try for a case, and `whole` of it as a value, that fails in a step: the boldest first. Each is made when
/// it is asked for, since those of many points are many.
pub fn smaller<'a, C: Case>(case: &'a C, whole: &'a Value, step: u32) -> Vec<Change<'a, C>> {
    let epochs = case.clone().epochs().clone();
    let of_steps = plan::simpler(&epochs, step).into_iter();
    let mut of_steps =
        of_steps.map(|epochs| -> Change<C> { Box::new(move || Some(case.with(epochs.clone()))) });
    let mut smaller: Vec<Change<C>> = of_steps.next().into_iter().collect();
    for first in [step, step / 2, 1] {
        smaller.push(Box::new(move || case.later(first)));
    }
    let plain = plain();
    let mut places = vec![Vec::new(); plain.len()];
    let [mut halves, mut entries, mut bold, mut timid] = [const { Vec::new() }; 4];
    walk(whole, &mut |at, key, value| {
        for ((named, simple), places) in plain.iter().zip(&mut places) {
            if *named == key && value != simple {
                places.push(at.to_owned());
            }
        }
        let Value::Array(list) = value else { return };
        if ["epochs", "windows"].contains(&key) {
            return;
        }
        let (count, half) = (list.len(), list.len() / 2);
        let list_at = (at.to_owned(), key.to_owned());
        let without = |from, to| {
            let (at, key) = list_at.clone();
            changed(whole, move |whole| without(whole, (&at, &key), from, to))
        };
        if half > 1 {
            halves.extend([without(0, half), without(half, count)]);
        }
        let records = list.iter().any(Value::is_object);
        let ones = if records { &mut entries } else { &mut timid };
        ones.extend((0..count).map(|k| without(k, k + 1)));
    });
    for ((_, simple), places) in plain.into_iter().zip(places) {
        let set = |places: Vec<String>| {
            let simple = simple.clone();
            changed(whole, move |whole| {
                let mut other = whole.clone();
                for at in &places {
                    *other.pointer_mut(at)? = simple.clone();
                }
                Some(other)
            })
        };
        timid.extend(places.iter().map(|at| set(vec![at.clone()])));
        bold.push(set(places));
    }
    smaller.extend(halves.into_iter().chain(entries).chain(bold));
    smaller.extend(of_steps);
    smaller.extend([1, 2, 3].map(|digits| {
        changed(whole, move |whole| {
            let mut other = whole.clone();
            shorten(&mut other, digits);
            Some(other)
        })
    }));
    smaller.extend(timid);
    smaller
}

/// The case of a value that has been changed.
fn changed<'a, C: Case>(
    whole: &'a Value,
    change: impl Fn(&Value) -> Option<Value> + 'a,
) -> Change<'a, C> {
    Box::new(move || serde_json::from_value(change(whole)?).ok())
}

/// The case without what its other side pushes.
pub fn unpushed<C: Case>(case: &C) -> C {
    let mut other = serde_json::to_value(case).expect("a case has string keys only");
    if let Some(pushes) = other.get_mut("pushes") {
        *pushes = json!([]);
    }
    serde_json::from_value(other).unwrap_or_else(|_| case.clone())
}

/// Shows every value with its place and the last key in it.
fn walk(whole: &Value, see: &mut dyn FnMut(&str, &str, &Value)) {
    fn within(at: &str, key: &str, value: &Value, see: &mut dyn FnMut(&str, &str, &Value)) {
        see(at, key, value);
        match value {
            Value::Object(fields) => {
                for (key, value) in fields {
                    within(&format!("{at}/{key}"), key, value, see);
                }
            }
            Value::Array(entries) => {
                for (k, value) in entries.iter().enumerate() {
                    within(&format!("{at}/{k}"), "", value, see);
                }
            }
            _ => {}
        }
    }
    within("", "", whole, see);
}

/// Without some entries of a list; those behind them get other numbers, by which others call them: a body or a point.
/// `None` where one that is left out is called.
fn without(whole: &Value, (at, list): (&str, &str), from: usize, to: usize) -> Option<Value> {
    let mut other = whole.clone();
    let entries = other.pointer_mut(at)?.as_array_mut()?;
    entries.drain(from..to);
    let caller = match list {
        "body" | "bodies" => "body",
        "points" => "point",
        "material" => "material",
        _ => return Some(other),
    };
    let mut called = Vec::new();
    walk(&other, &mut |at, key, value| {
        let number = value.as_u64().filter(|_| key == caller);
        called.extend(number.map(|number| (at.to_owned(), number as usize)));
    });
    for (at, number) in called.into_iter().filter(|(_, number)| *number >= from) {
        let left = number.checked_sub(to - from).filter(|_| number >= to)?;
        *other.pointer_mut(&at)? = left.into();
    }
    Some(other)
}

/// Every number with few digits; whole numbers are counts and stay.
fn shorten(value: &mut Value, digits: i32) {
    match value {
        Value::Number(number) if number.is_f64() => {
            let x = number.as_f64().unwrap_or_default();
            if x != 0.0 {
                let unit = 10f64.powi(x.abs().log10().floor() as i32 + 1 - digits);
                *value = Value::from((x / unit).round() * unit);
            }
        }
        Value::Array(values) => values.iter_mut().for_each(|value| shorten(value, digits)),
        Value::Object(fields) => fields.values_mut().for_each(|value| shorten(value, digits)),
        _ => {}
    }
}

/// Longest list that is shown whole.
const LISTED: usize = 12;

/// Keys that are not shown: steps, and what is the same in every case.
const LEFT_OUT: [&str; 5] = ["config", "epochs", "interface", "overlap", "threads"];

/// A case for people, line by line: what is not 0 of it.
pub fn story<C: Case>(case: &C) -> Vec<String> {
    let mut story = Vec::new();
    let mut rest = Vec::new();
    let whole = serde_json::to_value(case).expect("a case has string keys only");
    for part in [&whole["config"], &whole] {
        let fields = part.as_object().into_iter().flatten();
        for (key, value) in fields.filter(|(key, _)| !LEFT_OUT.contains(&key.as_str())) {
            match value {
                Value::Array(entries) if entries.iter().any(Value::is_object) => {
                    let each = entries.iter().enumerate().take(LISTED);
                    story.extend(each.map(|(k, entry)| format!("{key} {k}: {}", words(entry))));
                    if entries.len() > LISTED {
                        story.push(format!("{key}: {} more", entries.len() - LISTED));
                    }
                }
                _ if !words(value).is_empty() => {
                    rest.push(format!("{key}: {}", words(value)));
                }
                _ => {}
            }
        }
    }
    story.extend(rest);
    story
}

/// A value in words; nothing of what is 0, false or empty.
fn words(value: &Value) -> String {
    match value {
        Value::Null | Value::Bool(false) => String::new(),
        Value::Bool(true) => "yes".to_owned(),
        Value::Number(number) => match number.as_f64() {
            _ if number.is_u64() => number.to_string(),
            Some(0.0) => String::new(),
            x => show(&[x.unwrap_or_default()]),
        },
        Value::String(text) => text.clone(),
        Value::Array(entries) => {
            let parts: Vec<String> = entries.iter().map(words).collect();
            let or_0 = parts
                .iter()
                .map(|word| if word.is_empty() { "0" } else { word });
            let or_0: Vec<&str> = or_0.collect();
            if parts.iter().all(String::is_empty) {
                String::new()
            } else {
                format!("({})", or_0.join(", "))
            }
        }
        Value::Object(fields) if fields.len() == 1 && fields.values().all(Value::is_number) => {
            let (key, value) = fields.iter().next().expect("one field");
            let word = words(value);
            format!("{key} {}", if word.is_empty() { "0" } else { &word })
        }
        Value::Object(fields) => {
            let parts = fields.iter().map(|(key, value)| (key, words(value)));
            let parts = parts.filter(|(_, words)| !words.is_empty());
            let parts: Vec<String> = parts.map(|(key, words)| format!("{key} {words}")).collect();
            parts.join(", ")
        }
    }
}
