//! What the kit found, for people (`table`), programs (`json`) and build servers (`junit`).

mod junit;
mod table;

use interface::message::control::Party;
use serde_json::json;

use crate::profile::{EVERY, OWN};
use crate::verdict::Verdict;
use crate::{Examination, Judged};

pub use junit::junit;
pub use table::{listing, row, summary};

/// The shipped scenes without variants, a line each: its name, a side, and what it needs of that side's solver.
const SCENES: &str = include_str!("scenes.csv");

/// Names and needs of the shipped scenes that have this side.
fn scenes(party: Party) -> impl Iterator<Item = (&'static str, Vec<&'static str>)> {
    SCENES.lines().skip(1).filter_map(move |line| {
        let [name, side, needs] = line.splitn(3, ',').collect::<Vec<_>>().try_into().ok()?;
        (side == party.name()).then(|| (name, needs.split_whitespace().collect()))
    })
}

impl Examination {
    /// The shipped scenes that the solver is good for: it says that it takes what they need, all of that has been judged, and
    /// no clause is broken that it must keep.
    pub fn scenes(&self) -> Vec<&'static str> {
        let is_good = self.whole && self.broken(false).next().is_none();
        let is_good = is_good && !self.is_hasty() && self.missing(None).is_empty();
        let own = OWN.iter().filter(|own| self.capabilities.has(own.name));
        let unjudged: Vec<&str> = own.filter_map(|own| own.unjudged).collect();
        let taken = |need: &&str| self.capabilities.meets(need) && !unjudged.contains(need);
        let judged = |needs: &[&str]| !unjudged.contains(&EVERY) && needs.iter().all(taken);
        let good = scenes(self.party).filter(|(_, needs)| is_good && judged(needs));
        good.map(|(name, _)| name).collect()
    }
}

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
        "random_cases": examination.cases,
        "too_few_cases": examination.is_hasty(),
        "scenes": examination.scenes(),
        "clauses": examination.judged.iter().map(entry).collect::<Vec<_>>(),
    });
    serde_json::to_string_pretty(&document).expect("a document has string keys only")
}

/// The verdict on a clause in a word, and what is shown beside it; the evidence of a broken one is shown apart.
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
