//! The JSON Schemas of the configurations, from the types that solvers read. They stand in `interface/schema` for authors of
//! solvers in other languages.

use schemars::generate::SchemaSettings;
use serde_json::Value;

/// The JSON Schema of a configuration, as the coupler writes it.
pub fn of<T: schemars::JsonSchema>() -> Value {
    let settings = SchemaSettings::draft2020_12().for_serialize();
    let mut schema = settings
        .into_generator()
        .into_root_schema_for::<T>()
        .to_value();
    describe_choices(&mut schema);
    schema
}

/// Gives the single key of a choice such as `{"properties": {"disc": ...}}`, at any depth, the description of the choice.
pub fn describe_choices(schema: &mut Value) {
    let description = schema.get("description").cloned();
    if let (Some(description), Some(Value::Object(properties))) =
        (description, schema.get_mut("properties"))
        && properties.len() == 1
    {
        for property in properties.values_mut().filter_map(Value::as_object_mut) {
            property.entry("description").or_insert(description.clone());
        }
    }
    match schema {
        Value::Array(all) => all.iter_mut().for_each(describe_choices),
        Value::Object(fields) => fields.values_mut().for_each(describe_choices),
        _ => {}
    }
}
