//! `log.jsonl`: what happened, one JSON object a line.

use serde::Deserialize;
use serde_json::{Map, Value};

/// A line of the log.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(default)]
pub struct Line {
    /// When, as the log has it.
    pub timestamp: String,
    /// `ERROR`, `WARN`, `INFO` or `DEBUG`.
    pub level: String,
    /// An entry: `message`, and values by name.
    pub fields: Map<String, Value>,
}

impl Line {
    /// The message.
    pub fn message(&self) -> &str {
        let message = self.fields.get("message");
        message.and_then(Value::as_str).unwrap_or_default()
    }

    /// Whether something is wrong.
    pub fn is_loud(&self) -> bool {
        self.level == "ERROR" || self.level == "WARN"
    }

    /// The value of this name as text.
    pub fn value(&self, name: &str) -> Option<String> {
        self.fields.get(name).map(|value| match value {
            Value::String(text) => text.clone(),
            other => other.to_string(),
        })
    }

    /// The message and all values, as one line of text.
    pub fn text(&self) -> String {
        let names = self.fields.keys().filter(|name| *name != "message");
        let values = names.filter_map(|name| Some(format!("{name} {}", self.value(name)?)));
        let message = Some(self.message().to_owned()).filter(|m| !m.is_empty());
        let all: Vec<String> = message.into_iter().chain(values).collect();
        all.join(" · ")
    }

    /// The time of day, without the fractions of a second that nobody reads.
    pub fn clock(&self) -> &str {
        let time = self.timestamp.split_once('T').map_or("", |(_, time)| time);
        time.get(..8).unwrap_or(time)
    }
}

/// The lines of a log, and how many of them cannot be read.
pub fn parse(text: &str) -> (Vec<Line>, usize) {
    let lines = text.lines().filter(|line| !line.trim().is_empty());
    let read: Vec<Option<Line>> = lines.map(|line| serde_json::from_str(line).ok()).collect();
    let unread = read.iter().filter(|line| line.is_none()).count();
    (read.into_iter().flatten().collect(), unread)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_one_line_of_text() {
        let text = r#"{"timestamp":"2026-11-22T05:42:36.123Z","level":"INFO","fields":{"message":"ready","party":"mpm","items":12},"target":"coupler"}
{"timestamp":"2026"#;
        let (lines, unread) = parse(text);
        assert_eq!((lines.len(), unread), (1, 1));
        assert_eq!(lines[0].text(), "ready · items 12 · party mpm");
        assert_eq!(lines[0].clock(), "05:42:36");
    }
}
