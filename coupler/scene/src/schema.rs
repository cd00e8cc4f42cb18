//! The JSON Schema of scene files, for editors: what the types say, in the form in which TOML can be written.

use interface::config::schema::describe_choices;
use schemars::schema_for;
use serde_json::Value;

use super::moduli;
use super::written::SceneWritten;

/// The JSON Schema of scene files.
pub fn schema() -> Value {
    let mut schema = schema_for!(SceneWritten).to_value();
    // A body has `density` or `mass` in place of its inertia.
    let of_bodies = "/$defs/BodyWritten/properties";
    for (place, key) in [(of_bodies, "inertia"), ("/$defs", "BodyInertia")] {
        let keys = schema.pointer_mut(place).and_then(Value::as_object_mut);
        keys.expect("bodies have keys").remove(key);
    }
    simplify(&mut schema);
    describe_choices(&mut schema);
    moduli::offer(&mut schema);
    schema
}

/// Removes `null`, which TOML cannot express, so that an editor reports a mistake and not an alternative.
fn simplify(schema: &mut Value) {
    without_null(schema);
    match schema {
        Value::Array(all) => all.iter_mut().for_each(simplify),
        Value::Object(fields) => fields.values_mut().for_each(simplify),
        _ => {}
    }
}

fn is_null(schema: &Value) -> bool {
    schema.get("type").is_some_and(|kind| kind == "null")
}

fn without_null(schema: &mut Value) {
    let Value::Object(fields) = schema else {
        return;
    };
    fields.retain(|key, value| !(key == "default" && value.is_null()));
    if let Some(Value::Array(kinds)) = fields.get_mut("type") {
        kinds.retain(|kind| kind != "null");
        if let [kind] = &kinds[..] {
            let kind = kind.clone();
            fields.insert("type".into(), kind);
        }
    }
    if let Some(Value::Array(choices)) = fields.get_mut("anyOf") {
        choices.retain(|choice| !is_null(choice));
        if let [Value::Object(only)] = &choices[..] {
            let only = only.clone();
            fields.remove("anyOf");
            // The description of the key has precedence over that of its type.
            for (key, value) in only {
                fields.entry(key).or_insert(value);
            }
        }
    }
}
