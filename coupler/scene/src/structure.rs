//! Compares the structure of a scene with its JSON Schema. Finds every key that is unknown, missing or
//! mistyped, and every number that is not finite, not only the first.
//!
//! The schema is made from the types that parse the scene ([`super::written`]), so the two cannot disagree; serde alone
//! would stop at the first fault.

use std::collections::BTreeSet;

use interface::text::{is_plain, line};
use serde_json::Value as Schema;
use toml::{Table, Value};

use super::document::{Document, Part, join};
use crate::diagnostic::{Diagnostic, FAULTS_LIMIT, nearest, suggestion};

/// All structural faults of a document.
pub(super) fn faults(document: &Document, schema: &Schema) -> Vec<Diagnostic> {
    let mut walk = Walk {
        document,
        definitions: &schema["$defs"],
        faults: Vec::new(),
    };
    walk.table(schema, &document.root, "");
    walk.faults
}

struct Walk<'a> {
    document: &'a Document,
    definitions: &'a Schema,
    faults: Vec<Diagnostic>,
}

impl<'a> Walk<'a> {
    fn fault(&mut self, path: &str, part: Part, message: &str, help: Option<String>) {
        if self.faults.len() >= FAULTS_LIMIT {
            return;
        }
        let fault = self.document.diagnostic(path, part, message, help);
        self.faults.push(fault);
    }

    /// Follows `$ref`.
    fn resolve(&self, schema: &'a Schema) -> &'a Schema {
        let mut schema = schema;
        while let Some(reference) = schema["$ref"].as_str() {
            schema = &self.definitions[reference.trim_start_matches("#/$defs/")];
        }
        schema
    }

    /// The alternatives of a schema as a flat list, with all references followed; the schema itself if it has none.
    fn alternatives(&self, schema: &'a Schema) -> Vec<&'a Schema> {
        let schema = self.resolve(schema);
        let options = schema["oneOf"].as_array().or(schema["anyOf"].as_array());
        // Beside properties it says which of these go together.
        match options.filter(|_| !schema["properties"].is_object()) {
            Some(options) => options
                .iter()
                .flat_map(|option| self.alternatives(option))
                .collect(),
            None => vec![schema],
        }
    }

    /// Refuses what a terminal or a table would take for something else than text: control characters, and in names and
    /// units also line breaks.
    fn text(&mut self, text: &str, part: Part, path: &str) {
        let key = path.rsplit('.').next().unwrap_or_default();
        let one_line = part == Part::Key || matches!(key, "name" | "unit");
        let kept: &[char] = if one_line { &[] } else { &['\n', '\r', '\t'] };
        let refused = text.chars().find(|&c| !is_plain(c) && !kept.contains(&c));
        if let Some(c) = refused {
            let what = if part == Part::Key {
                "the key"
            } else {
                "the text"
            };
            let (c, path) = (c.escape_unicode(), line(path));
            let message = format!("{what} of `{path}` has the control character {c}");
            self.fault(&path, part, &message, Some("leave it out".to_owned()));
        }
    }

    fn value(&mut self, schema: &'a Schema, value: &Value, path: &str) {
        if self.faults.len() >= FAULTS_LIMIT {
            return;
        }
        if let Value::String(text) = value {
            self.text(text, Part::Value, path);
        }
        let alternatives = self.alternatives(schema);
        let words: BTreeSet<&str> = alternatives.iter().flat_map(|a| words(a)).collect();
        let tagged: Vec<&str> = alternatives.iter().filter_map(|a| tag(a)).collect();
        match value {
            Value::String(word)
                if !words.is_empty() || !tagged.is_empty() && !free_text(&alternatives) =>
            {
                if !words.contains(word.as_str()) {
                    self.unknown_word(word, &words, &tagged, path);
                }
            }
            Value::Table(table) if !tagged.is_empty() && tagged.len() + words.len() > 1 => {
                self.tagged(&alternatives, &tagged, table, path);
            }
            _ => match alternatives.iter().find(|a| accepts(a, value)) {
                Some(chosen) => self.inside(chosen, value, path),
                None => self.wrong_type(schema, path),
            },
        }
    }

    fn inside(&mut self, schema: &'a Schema, value: &Value, path: &str) {
        match value {
            Value::Table(table) => self.table(schema, table, path),
            Value::Array(array) => self.array(schema, array, path),
            Value::Float(number) if !number.is_finite() => {
                let message = format!("`{path}` is {number}, expected a finite number");
                self.fault(path, Part::Value, &message, None);
            }
            Value::Integer(number) => {
                let minimum = schema["minimum"].as_f64().unwrap_or(f64::NEG_INFINITY);
                let maximum =
                    schema["maximum"]
                        .as_f64()
                        .unwrap_or(if schema["format"] == "uint32" {
                            f64::from(u32::MAX)
                        } else {
                            f64::INFINITY
                        });
                if (*number as f64) < minimum || (*number as f64) > maximum {
                    let message = format!("`{path}` is {number}, expected {minimum} to {maximum}");
                    self.fault(path, Part::Value, &message, None);
                }
            }
            _ => {}
        }
    }

    fn table(&mut self, schema: &'a Schema, table: &Table, path: &str) {
        let properties = schema["properties"].as_object();
        let known = || properties.into_iter().flatten().map(|(k, _)| k.as_str());
        // If an unknown key is probably a typing error of a required one, that one is not reported as missing too.
        let mut meant = Vec::new();
        for (key, value) in table {
            if self.faults.len() >= FAULTS_LIMIT {
                return;
            }
            let below = join(path, key);
            self.text(key, Part::Key, &below);
            if let Some(property) = properties.and_then(|p| p.get(key)) {
                self.value(property, value, &below);
            } else if schema["additionalProperties"].is_object() {
                self.value(&schema["additionalProperties"], value, &below);
            } else {
                let help = suggestion(key, "valid keys here", known());
                let message = format!("unknown key `{key}`");
                self.fault(&below, Part::Key, &message, Some(help));
                meant.extend(nearest(key, known()));
            }
        }
        for key in schema["required"].as_array().into_iter().flatten() {
            let key = key.as_str().unwrap_or_default();
            if !table.contains_key(key) && !meant.contains(&key) {
                let below = join(path, key);
                let what =
                    properties.map_or("", |p| p[key]["description"].as_str().unwrap_or_default());
                let help = (!what.is_empty()).then(|| format!("`{key}`: {what}"));
                self.fault(&below, Part::Key, &format!("missing key `{key}`"), help);
            }
        }
    }

    fn array(&mut self, schema: &'a Schema, array: &[Value], path: &str) {
        let minimum = schema["minItems"].as_u64().unwrap_or(0);
        let maximum = schema["maxItems"].as_u64().unwrap_or(u64::MAX);
        let length = array.len() as u64;
        if length < minimum || length > maximum {
            let message = format!(
                "`{path}` has {length} elements, expected {}",
                self.describe(schema)
            );
            self.fault(path, Part::Value, &message, None);
            return;
        }
        for (i, element) in array.iter().enumerate() {
            self.value(&schema["items"], element, &format!("{path}.{i}"));
        }
    }

    /// Checks a table that chooses a variant of an enumeration by its single key.
    fn tagged(&mut self, alternatives: &[&'a Schema], tags: &[&str], table: &Table, path: &str) {
        let plain = alternatives.iter().flat_map(|a| words(a));
        let mut keys = table.iter();
        let (Some((key, value)), None) = (keys.next(), keys.next()) else {
            let written: Vec<&str> = table.keys().map(String::as_str).collect();
            let message = format!("`{path}` needs exactly one key, has {}", written.len());
            let help = format!("keep one of: {}", tags.join(", "));
            self.fault(path, Part::Key, &message, Some(help));
            return;
        };
        let below = join(path, key);
        if let Some(chosen) = alternatives.iter().find(|a| tag(a) == Some(key)) {
            self.value(&chosen["properties"][key], value, &below);
        } else if plain.clone().any(|word| word == key) {
            let help = format!("write `{path} = \"{key}\"`");
            let message = format!("`{key}` takes no values");
            self.fault(&below, Part::Key, &message, Some(help));
        } else {
            let help = suggestion(key, "valid here", tags.iter().copied().chain(plain));
            let message = format!("unknown key `{key}`");
            self.fault(&below, Part::Key, &message, Some(help));
        }
    }

    fn unknown_word(&mut self, word: &str, words: &BTreeSet<&str>, tagged: &[&str], path: &str) {
        if tagged.contains(&word) {
            let help = format!("write `{path}.{word} = ...` with its values");
            let message = format!("`{word}` needs values");
            self.fault(path, Part::Value, &message, Some(help));
            return;
        }
        let all = words.iter().copied().chain(tagged.iter().copied());
        let help = suggestion(word, "valid values", all);
        let message = format!("`{path}` is \"{word}\", which is not known");
        self.fault(path, Part::Value, &message, Some(help));
    }

    fn wrong_type(&mut self, schema: &'a Schema, path: &str) {
        let expected = self.describe(schema);
        let mut written = self.document.as_written(path);
        if written.is_empty() {
            "a table".clone_into(&mut written); // Only what is in it has been written.
        }
        let message = format!("`{path}` is {written}, expected {expected}");
        self.fault(path, Part::Value, &message, None);
    }

    /// What a schema expects, in words.
    fn describe(&self, schema: &'a Schema) -> String {
        let alternatives = self.alternatives(schema);
        let [schema] = alternatives[..] else {
            let each: Vec<String> = alternatives.iter().map(|a| self.describe(a)).collect();
            return each.join(" or ");
        };
        if let Some(tag) = tag(schema) {
            return format!("a table with `{tag}`");
        }
        let words = words(schema);
        if !words.is_empty() {
            return format!("\"{}\"", words.join("\" or \""));
        }
        match schema["type"].as_str() {
            Some("number") => "a number".to_owned(),
            Some("integer") => "a whole number".to_owned(),
            Some("string") => "a text".to_owned(),
            Some("boolean") => "true or false".to_owned(),
            Some("array") => match schema["minItems"].as_u64() {
                Some(n) if schema["maxItems"].as_u64() == Some(n) => {
                    format!("a list of {n}, each {}", self.describe(&schema["items"]))
                }
                _ => format!("a list, each {}", self.describe(&schema["items"])),
            },
            _ => "a table".to_owned(),
        }
    }
}

/// The words that an enumeration without values allows.
fn words(schema: &Schema) -> Vec<&str> {
    match (&schema["const"], &schema["enum"]) {
        (Schema::String(word), _) => vec![word],
        (_, Schema::Array(words)) => words.iter().filter_map(Schema::as_str).collect(),
        _ => Vec::new(),
    }
}

/// The key of a variant with values: an object of exactly one key, which is required.
fn tag(schema: &Schema) -> Option<&str> {
    let properties = schema["properties"].as_object()?;
    let required = schema["required"].as_array()?;
    match (properties.len(), required.as_slice()) {
        (1, [Schema::String(tag)]) => Some(tag),
        _ => None,
    }
}

/// Whether any text is allowed.
fn free_text(alternatives: &[&Schema]) -> bool {
    alternatives
        .iter()
        .any(|a| a["type"] == "string" && words(a).is_empty())
}

fn accepts(schema: &Schema, value: &Value) -> bool {
    // A value that belongs to another key, such as one that a study gives to a key, may be of any type.
    if schema == &Schema::Bool(true) {
        return true;
    }
    let kind = schema["type"].as_str();
    match value {
        Value::Integer(_) => matches!(kind, Some("integer" | "number")),
        Value::Float(_) => kind == Some("number"),
        Value::String(_) => kind == Some("string"),
        Value::Boolean(_) => kind == Some("boolean"),
        Value::Array(_) => kind == Some("array"),
        Value::Table(_) => kind == Some("object"),
        Value::Datetime(_) => false,
    }
}
