//! What was said while a clause was judged, as lines of JSON: who to whom, header, every number, and the bytes.

use std::fmt::Write as _;
use std::time::Duration;

use interface::message::wire::StepHeader;
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
    #[serde(flatten)]
    header: StepHeader,
    /// The records or the control message, decoded.
    decoded: String,
    /// The bytes of a control message.
    #[serde(skip_serializing_if = "String::is_empty")]
    bytes: String,
}

impl Trace {
    /// Of no messages yet; it keeps those to come or not.
    pub fn new(kept: bool) -> Self {
        Self(kept.then(Vec::new))
    }

    /// Takes note of a message.
    pub fn note(&mut self, run: u32, time: Duration, direction: Direction, message: &Message) {
        let Some(lines) = &mut self.0 else {
            return;
        };
        let (decoded, bytes) = decoded(message);
        lines.push(Line {
            run,
            time: time.as_secs_f64(),
            way: direction,
            kind: message.kind(),
            header: message.header,
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
        Payload::Order(bytes) => (format!("{:?}", message.as_order()), hex(bytes)),
        Payload::Notice(bytes) => (format!("{:?}", message.as_notice()), hex(bytes)),
        Payload::Saved(bytes) | Payload::Restore(bytes) => {
            (format!("{} bytes", bytes.len()), hex(bytes))
        }
        records => (format!("{records:?}"), String::new()),
    }
}
