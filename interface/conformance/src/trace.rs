//! What was said while a clause was judged, as lines of JSON: who to whom, header, every number, and the bytes.

use std::fmt::Write as _;
use std::time::Duration;

use interface::transport::raw::{Kind, Message, Payload};
use serde::Serialize;

/// Direction of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Direction {
    /// From the kit.
    ToSolver,
    /// To the kit.
    FromSolver,
}

/// The messages of one clause, if they are wanted.
#[derive(Debug, Clone, Default)]
pub struct Trace(Option<Vec<Line>>);

#[derive(Debug, Clone, Serialize)]
struct Line {
    /// Which of the clause's runs, from 1.
    run: u32,
    /// Time since the clause began in s.
    time: f64,
    way: Direction,
    kind: Kind,
    epoch: u64,
    step: u64,
    count: u64,
    flags: u64,
    travel: f64,
    set: u64,
    /// The records or the control message, decoded.
    decoded: String,
    /// The bytes of a control message.
    #[serde(skip_serializing_if = "String::is_empty")]
    bytes: String,
}

impl Trace {
    /// A recorder that keeps all entries.
    pub fn kept() -> Self {
        Self(Some(Vec::new()))
    }

    /// Takes note of a message.
    pub fn note(&mut self, run: u32, time: Duration, direction: Direction, message: &Message) {
        let Some(lines) = &mut self.0 else {
            return;
        };
        let header = &message.header;
        let (decoded, bytes) = decoded(message);
        lines.push(Line {
            run,
            time: time.as_secs_f64(),
            way: direction,
            kind: message.kind(),
            epoch: header.epoch,
            step: header.step,
            count: header.count,
            flags: header.flags,
            travel: header.travel,
            set: header.set,
            decoded,
            bytes,
        });
    }

    /// One JSON object a line; nothing if nothing was kept.
    pub fn lines(&self) -> String {
        let mut text = String::new();
        for line in self.0.iter().flatten() {
            let line = serde_json::to_string(line).expect("a line has string keys only");
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
        Payload::Order(bytes) => (either(message.as_order()), hex(bytes)),
        Payload::Notice(bytes) => (either(message.as_notice()), hex(bytes)),
        Payload::Saved(bytes) | Payload::Restore(bytes) => {
            (format!("{} bytes", bytes.len()), hex(bytes))
        }
        Payload::Contacts(records) => (format!("{records:?}"), String::new()),
        Payload::Grant(records) => (format!("{records:?}"), String::new()),
        Payload::Report(records) => (format!("{records:?}"), String::new()),
        Payload::Groups(records) => (format!("{records:?}"), String::new()),
        Payload::Points(records) => (format!("{records:?}"), String::new()),
        Payload::Bodies(records) => (format!("{records:?}"), String::new()),
        Payload::Set(records) => (format!("{records:?}"), String::new()),
        Payload::States(records) => (format!("{records:?}"), String::new()),
        Payload::Forces(records) => (format!("{records:?}"), String::new()),
        Payload::Envelopes(records) => (format!("{records:?}"), String::new()),
    }
}

fn either<T: core::fmt::Debug>(message: Result<T, String>) -> String {
    message.map_or_else(|e| e, |message| format!("{message:?}"))
}
