//! The JSON Schema of scene files.

use std::collections::BTreeSet;
use std::path::Path;

use coupler::scene::schema;
use serde_json::Value;

/// Calls `look` with every schema in `schema` and where it is.
fn each(schema: &Value, path: &str, look: &mut impl FnMut(&Value, &str)) {
    look(schema, path);
    match schema {
        Value::Array(all) => {
            for (k, one) in all.iter().enumerate() {
                each(one, &format!("{path}/{k}"), look);
            }
        }
        Value::Object(fields) => {
            for (key, one) in fields {
                each(one, &format!("{path}/{key}"), look);
            }
        }
        _ => {}
    }
}

#[test]
fn nothing_in_it_is_null() {
    each(&schema(), "", &mut |schema, path| {
        assert!(!schema.is_null() && schema != "null", "{path}");
    });
}

/// In it and in the manual.
#[test]
fn every_key_is_described() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/scene-format.md");
    let page = std::fs::read_to_string(page).expect("docs/scene-format.md");
    let words: BTreeSet<&str> = page
        .split(|c: char| !c.is_ascii_alphanumeric() && c != '_')
        .collect();
    let (mut bare, mut keys) = (Vec::new(), BTreeSet::new());
    each(&schema(), "", &mut |schema, path| {
        let properties = schema.get("properties").and_then(Value::as_object);
        for (key, property) in properties.into_iter().flatten() {
            if property.get("description").is_none() || !words.contains(key.as_str()) {
                bare.push(format!("{path}/{key}"));
            }
            keys.insert(key.clone());
        }
    });
    assert!(
        bare.is_empty(),
        "not described, or not in docs/scene-format.md: {bare:#?}"
    );
    assert!(keys.len() > 80, "{}", keys.len());
}
