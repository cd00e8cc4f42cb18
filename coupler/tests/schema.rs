//! The JSON Schema of scene files.

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

#[test]
fn every_key_is_described() {
    let mut bare = Vec::new();
    each(&schema(), "", &mut |schema, path| {
        let properties = schema.get("properties").and_then(Value::as_object);
        for (key, property) in properties.into_iter().flatten() {
            if property.get("description").is_none() {
                bare.push(format!("{path}/{key}"));
            }
        }
    });
    assert!(bare.is_empty(), "{bare:#?}");
}
