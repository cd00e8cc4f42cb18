//! Elastic constants of materials as papers give them: Young's modulus and Poisson's ratio in place of both moduli.
//!
//! They are replaced by the moduli as soon as the structure of a document is known, so nothing else knows of them.

use serde_json::{Value as Schema, json};
use toml::{Table, Value};

use super::diagnostic::Diagnostic;
use super::document::{Document, Part};

const YOUNG: &str = "young_modulus";
const POISSON: &str = "poisson_ratio";
const BULK: &str = "bulk_modulus";
const SHEAR: &str = "shear_modulus";
/// The model without a shear modulus.
const FLUID: &str = "fluid";

/// Replaces `young_modulus` and `poisson_ratio` of every material by `bulk_modulus` and `shear_modulus`; what is wrong
/// with them.
pub(super) fn replace(document: &mut Document) -> Vec<Diagnostic> {
    let mut faults = Vec::new();
    for (path, mut table) in models(document) {
        match moduli(&path, &table) {
            Ok(None) => {}
            Ok(Some([bulk, shear])) => {
                table.retain(|key, _| key != YOUNG && key != POISSON);
                table.insert(BULK.into(), Value::Float(bulk));
                table.insert(SHEAR.into(), Value::Float(shear));
                document.replace(&path, Value::Table(table));
            }
            Err((key, message, help)) => {
                let help = Some(help.to_owned());
                faults.push(document.diagnostic(&key, Part::Value, &message, help));
            }
        }
    }
    faults
}

/// The models with elastic constants, with their paths.
fn models(document: &Document) -> Vec<(String, Table)> {
    let of = |(index, material): (usize, &Value)| {
        let models = material.get("model")?.as_table()?;
        let (name, model) = models.iter().find(|(name, _)| *name != FLUID)?;
        let path = format!("mpm.material.{index}.model.{name}");
        Some((path, model.as_table()?.clone()))
    };
    let materials = document.list(&["mpm", "material"]).iter().enumerate();
    materials.filter_map(of).collect()
}

/// `K = E / (3 (1 - 2 nu))` and `G = E / (2 (1 + nu))`, where the model has E and nu; or the key at fault, a message, and
/// what to do.
fn moduli(path: &str, model: &Table) -> Result<Option<[f64; 2]>, (String, String, &'static str)> {
    const PAIR: &str = "write `young_modulus` in Pa and `poisson_ratio`, or `bulk_modulus` and `shear_modulus` in Pa";
    let all = [BULK, SHEAR, YOUNG, POISSON];
    match all.map(|key| model.contains_key(key)) {
        [true, true, false, false] => return Ok(None),
        [false, false, true, true] => {}
        there => {
            let written = all.iter().zip(there).filter(|(_, there)| *there);
            let written: Vec<String> = written.map(|(key, _)| format!("`{key}`")).collect();
            let written = match &written[..] {
                [] => "none".to_owned(),
                all => all.join(", "),
            };
            let message = format!("`{path}` has {written}, expected one pair of elastic constants");
            return Err((path.to_owned(), message, PAIR));
        }
    }
    let refuse = |key: &str, expected: &str, help| {
        let message = format!("`{path}.{key}` is {}, expected {expected}", model[key]);
        Err((format!("{path}.{key}"), message, help))
    };
    let number = |key: &str| {
        let value = &model[key];
        let whole = || value.as_integer().map(|n| n as f64);
        value.as_float().or_else(whole).unwrap_or(f64::NAN)
    };
    let (young, poisson) = (number(YOUNG), number(POISSON));
    if !(young > 0.0 && young.is_finite()) {
        return refuse(YOUNG, "a modulus above 0", PAIR);
    }
    if !(poisson > -1.0 && poisson < 0.5) {
        let help = "at 0.5 the bulk modulus is infinite: use 0.49";
        return refuse(POISSON, "above -1 and below 0.5", help);
    }
    let moduli = [young / (3.0 - 6.0 * poisson), young / (2.0 + 2.0 * poisson)];
    Ok(Some(moduli))
}

/// Adds both keys to every model of a schema that has both moduli.
pub(super) fn offer(schema: &mut Schema) {
    match schema {
        Schema::Array(all) => all.iter_mut().for_each(offer),
        Schema::Object(fields) => {
            fields.values_mut().for_each(offer);
            let properties = fields.get_mut("properties").and_then(Schema::as_object_mut);
            let Some(properties) =
                properties.filter(|p| p.contains_key(BULK) && p.contains_key(SHEAR))
            else {
                return;
            };
            let number =
                |what: &str| json!({ "description": what, "type": "number", "format": "double" });
            let young = "Young's modulus in Pa; with `poisson_ratio` in place of both moduli.";
            let poisson = "Poisson's ratio, above -1 and below 0.5.";
            properties.insert(YOUNG.into(), number(young));
            properties.insert(POISSON.into(), number(poisson));
            if let Some(required) = fields.get_mut("required").and_then(Schema::as_array_mut) {
                required.retain(|key| key != BULK && key != SHEAR);
            }
            let pair = |[a, b]: [&str; 2]| json!({ "required": [a, b] });
            fields.insert(
                "anyOf".into(),
                json!([pair([BULK, SHEAR]), pair([YOUNG, POISSON])]),
            );
        }
        _ => {}
    }
}
