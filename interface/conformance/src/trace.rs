//! The messages while a clause was judged, as lines of JSON: sender, receiver, header, every number, and the bytes.

use std::fmt::Write as _;
use std::time::Duration;

use interface::message::control::Party;
use interface::message::{Channel, Message, Payload};
use serde_json::{Value, json};

/// The messages of one clause, if they are wanted: each the header with its kind and way, which of the clause's runs it is
/// of, from 1, the time since the clause began in s, the records or the control message decoded, and the latter's bytes.
#[derive(Debug, Clone, Default)]
pub struct Trace(Option<Vec<Value>>);

impl Trace {
    /// Of no messages yet; it keeps those to come or not.
    pub fn new(kept: bool) -> Self {
        Self(kept.then(Vec::new))
    }

    /// Takes note of a message.
    pub fn note(&mut self, run: u32, time: Duration, solver: Party, message: &Message) {
        let Some(lines) = &mut self.0 else {
            return;
        };
        let mut line = json!(message.header);
        line["run"] = run.into();
        line["time"] = time.as_secs_f64().into();
        let from_solver = Channel::of(solver, message.kind()).from() == solver;
        line["way"] = if from_solver {
            "from_solver"
        } else {
            "to_solver"
        }
        .into();
        line["kind"] = json!(message.kind());
        let (decoded, bytes) = decoded(message);
        line["decoded"] = decoded.into();
        if !bytes.is_empty() {
            line["bytes"] = bytes.into();
        }
        lines.push(line);
    }

    /// One JSON object a line; nothing if nothing was kept.
    pub fn lines(&self) -> String {
        let mut text = String::new();
        for line in self.0.iter().flatten() {
            let _ = writeln!(text, "{line}");
        }
        text
    }
}

fn decoded(message: &Message) -> (String, String) {
    let hex = |bytes: &[u8]| {
        bytes.iter().fold(String::new(), |mut text, byte| {
            let _ = write!(text, "{byte:02x}");
            text
        })
    };
    match &message.payload {
        Payload::Order(bytes) => (format!("{:?}", message.as_order()), hex(bytes)),
        Payload::Notice(bytes) => (format!("{:?}", message.as_notice()), hex(bytes)),
        Payload::Saved(bytes) | Payload::Restore(bytes) => {
            (format!("{} bytes", bytes.len()), hex(bytes))
        }
        records => (format!("{records:?}"), String::new()),
    }
}
