//! What the kit found, for people (`table`), programs (`json`) and build servers (`junit`).

mod junit;
mod table;

use serde_json::json;

use crate::verdict::Verdict;
use crate::{Examination, Judged};

pub use junit::junit;
pub use table::{Paint, listing, manual, row, summary};

/// The examination as JSON.
pub fn json(examination: &Examination) -> String {
    let entry = |judged: &Judged| {
        let mut entry = json!(judged.verdict);
        entry["id"] = judged.clause.id.into();
        entry["level"] = json!(judged.clause.level);
        entry["title"] = judged.clause.title.into();
        entry["wall_s"] = judged.wall.as_secs_f64().into();
        entry
    };
    let document = json!({
        "protocol": interface::message::control::PROTOCOL,
        "party": examination.party.name(),
        "solver": examination.identity,
        "profile": examination.profile().map(|profile| profile.name),
        "not_judged": examination.not_judged(),
        "clauses": examination.judged.iter().map(entry).collect::<Vec<_>>(),
    });
    serde_json::to_string_pretty(&document).expect("a document has string keys only")
}

/// How a clause has come out, in a word, and what is said beside that; the evidence of a broken one is told apart.
fn shown(judged: &Judged) -> (&'static str, String) {
    match &judged.verdict {
        Verdict::Pass { measured } => ("pass", measured.clone()),
        Verdict::Fail(_) => ("FAIL", String::new()),
        Verdict::NotApplicable { reason, .. } => ("n/a", reason.clone()),
        Verdict::Blocked { by } => ("blocked", format!("by {by}")),
    }
}

/// How many have come out so.
fn count(examination: &Examination, word: &str) -> usize {
    let judged = examination.judged.iter();
    judged.filter(|j| shown(j).0 == word).count()
}
