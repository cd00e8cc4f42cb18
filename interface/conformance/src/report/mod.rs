//! What the kit found, for people (`table`, `page`), programs (`json`) and build servers (`junit`).

mod junit;
mod page;
mod table;

use std::collections::BTreeSet;

use serde::Serialize;

use crate::clause::not_checked;
use crate::verdict::Verdict;
use crate::waiver::Waivers;
use crate::{Examination, Judged};

pub use junit::junit;
pub use page::{badge, html};
pub use table::{Paint, Rows, listing, manual, summary};

/// An examination as JSON.
#[derive(Debug, Serialize)]
struct Document<'a> {
    /// Of the protocol, major and minor.
    protocol: (u32, u32),
    party: &'static str,
    solver: &'a str,
    profile: Option<&'static str>,
    not_judged: BTreeSet<String>,
    clauses: Vec<Entry<'a>>,
    not_checked: Vec<Unchecked>,
}

#[derive(Debug, Serialize)]
struct Entry<'a> {
    id: &'static str,
    level: crate::clause::Level,
    title: &'static str,
    #[serde(flatten)]
    verdict: &'a Verdict,
    #[serde(skip_serializing_if = "Option::is_none")]
    waived: Option<&'a str>,
    wall_s: f64,
}

#[derive(Debug, Serialize)]
struct Unchecked {
    clause: &'static str,
    reason: &'static str,
}

/// The examination as JSON.
pub fn json(examination: &Examination, waivers: &Waivers) -> String {
    let clauses = examination.judged.iter().map(|judged| Entry {
        id: judged.clause.id,
        level: judged.clause.level,
        title: judged.clause.title,
        verdict: &judged.verdict,
        waived: waiver(judged, waivers),
        wall_s: judged.wall.as_secs_f64(),
    });
    let document = Document {
        protocol: interface::message::control::PROTOCOL,
        party: examination.party.name(),
        solver: &examination.identity,
        profile: examination.profile().map(|profile| profile.name),
        not_judged: examination.not_judged(),
        clauses: clauses.collect(),
        not_checked: not_checked()
            .map(|(clause, reason)| Unchecked { clause, reason })
            .collect(),
    };
    serde_json::to_string_pretty(&document).expect("a document has string keys only")
}

/// The reason for which a broken clause is waived today.
pub fn waiver<'a>(judged: &Judged, waivers: &'a Waivers) -> Option<&'a str> {
    let waiver = waivers.of(judged.clause.id, crate::waiver::today());
    waiver
        .filter(|_| judged.failed())
        .map(|w| w.reason.as_str())
}

/// How a clause has come out, in a word, and what is said beside that; the evidence of a broken one is told apart.
fn shown(judged: &Judged, waivers: &Waivers) -> (&'static str, String) {
    match &judged.verdict {
        Verdict::Pass { measured } => ("pass", measured.clone()),
        Verdict::Fail(_) if waiver(judged, waivers).is_some() => ("waived", String::new()),
        Verdict::Fail(_) => ("FAIL", String::new()),
        Verdict::NotApplicable { reason, .. } => ("n/a", reason.clone()),
        Verdict::Blocked { by } => ("blocked", format!("by {by}")),
    }
}

/// How many have come out so.
fn count(examination: &Examination, waivers: &Waivers, word: &str) -> usize {
    let judged = examination.judged.iter();
    judged.filter(|j| shown(j, waivers).0 == word).count()
}
