//! The result for people: one row a clause, its evidence below it where it is broken.

use core::fmt::Write as _;
use std::collections::BTreeMap;

use interface::message::control::Party;

use super::{Word, shown, waiver};
use crate::clause::{Clause, NOT_CHECKED, common, of, own};
use crate::verdict::Verdict;
use crate::waiver::Waivers;
use crate::{Examination, Judged};

/// Whether words are coloured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Paint(pub bool);

const GREEN: u8 = 32;
const RED: u8 = 31;
const YELLOW: u8 = 33;
const GREY: u8 = 90;

impl Paint {
    fn word(self, word: &str, colour: u8) -> String {
        if self.0 {
            format!("\x1b[{colour}m{word}\x1b[0m")
        } else {
            word.to_string()
        }
    }
}

/// Shows one row for each clause. A clause that fails because another one failed is listed once.
pub struct Rows<'a> {
    waivers: &'a Waivers,
    paint: Paint,
    /// What has failed, by what was got, with how often more.
    causes: BTreeMap<String, (&'static str, usize)>,
}

/// What was got, without its numbers: two failures with the same are taken for one cause.
fn cause(got: &str) -> String {
    got.chars().filter(|c| !c.is_ascii_digit()).collect()
}

impl<'a> Rows<'a> {
    /// None yet.
    pub fn new(waivers: &'a Waivers, paint: Paint) -> Self {
        Self {
            waivers,
            paint,
            causes: BTreeMap::new(),
        }
    }

    /// The row of a clause, without a newline at its end; its evidence below it where it is broken.
    pub fn row(&mut self, judged: &Judged) -> String {
        let clause = judged.clause;
        let waived = waiver(judged, self.waivers);
        let (word, said) = shown(judged, self.waivers);
        let colour = match word {
            Word::Pass => GREEN,
            Word::Fail => RED,
            Word::Waived | Word::Blocked => YELLOW,
            Word::NotApplicable => GREY,
        };
        let word = self.paint.word(word.text(), colour);
        let mut text = format!(
            "  {:<6} {:<6} {word} {}",
            clause.id, clause.level, clause.title
        );
        if !said.is_empty() {
            let _ = write!(text, "\n{:24}{}", "", self.paint.word(&said, GREY));
        }
        let Verdict::Fail(evidence) = &judged.verdict else {
            return text;
        };
        if let Some((first, more)) = self.causes.get_mut(&cause(&evidence.got)) {
            *more += 1;
            let _ = write!(text, "\n{:24}as {first}", "");
            return text;
        }
        self.causes.insert(cause(&evidence.got), (clause.id, 0));
        if let Some(step) = evidence.step {
            let _ = write!(text, "\n{:24}step      {step}", "");
        }
        let _ = write!(text, "\n{:24}expected  {}", "", evidence.expected);
        let _ = write!(text, "\n{:24}got       {}", "", evidence.got);
        for line in &evidence.story {
            let _ = write!(text, "\n{:24}{line}", "");
        }
        if let Some(reason) = waived {
            let _ = write!(text, "\n{:24}waived    {reason}", "");
        }
        text
    }

    /// Which failures have one cause, a line each.
    pub fn common_causes(&self) -> String {
        let mut text = String::new();
        let mut several: Vec<_> = self
            .causes
            .iter()
            .filter(|(_, (_, more))| *more > 0)
            .collect();
        several.sort_by_key(|(_, (_, more))| core::cmp::Reverse(*more));
        for (got, (first, more)) in several {
            let _ = writeln!(
                text,
                "{first} fails, and {more} more of the same cause: {got}"
            );
        }
        text
    }
}

/// The last lines: how many of each, what it was judged as, and what was not judged.
pub fn summary(examination: &Examination, waivers: &Waivers) -> String {
    let judged = &examination.judged;
    let count =
        |what: fn(&Verdict) -> bool| judged.iter().filter(|judged| what(&judged.verdict)).count();
    let waived = judged
        .iter()
        .filter(|judged| waiver(judged, waivers).is_some())
        .count();
    let wall = examination.wall.as_secs_f64();
    let passed = count(|v| matches!(v, Verdict::Pass { .. }));
    let left_out = judged.iter().filter(|judged| judged.left_out()).count();
    let mut text = format!(
        "{} `{}`: {passed} pass, {} fail, {waived} waived, {} not applicable, {} blocked, in {wall:.1} s",
        examination.party,
        examination.identity,
        count(|v| matches!(v, Verdict::Fail(_))) - waived,
        count(|v| matches!(v, Verdict::NotApplicable { .. })),
        count(|v| matches!(v, Verdict::Blocked { .. })),
    );
    if !examination.whole {
        return text;
    }
    let profile = examination.profile().map_or("none", |profile| profile.name);
    let not_judged = examination.not_judged();
    let not_judged: Vec<&str> = not_judged.iter().map(String::as_str).collect();
    let _ = write!(
        text,
        "\n{passed} of {}, profile {profile}; not judged: {}",
        judged.len() - left_out,
        if not_judged.is_empty() {
            "nothing".into()
        } else {
            not_judged.join(", ")
        },
    );
    text
}

/// The clauses as the CSV file docs/conformance.csv: those of both sides, then of each.
pub fn manual() -> String {
    let parts: [(&str, Vec<&Clause>); 3] = [
        ("both", common().collect()),
        ("bodies", own(Party::Dem).collect()),
        ("continuum", own(Party::Mpm).collect()),
    ];
    let mut text = String::from("side,clause,level,what,needs,mutants\n");
    for (side, clauses) in parts {
        for clause in clauses {
            let mutants: Vec<&str> = clause.mutants.iter().map(|mutant| mutant.what).collect();
            let (id, level) = (clause.id, clause.level);
            let words = [clause.title, &clause.needs.join("; "), &mutants.join("; ")];
            let [what, needs, mutants] = words.map(quoted);
            let _ = writeln!(text, "{side},{id},{level},{what},{needs},{mutants}");
        }
    }
    text
}

/// A field of a CSV file.
fn quoted(words: &str) -> String {
    if words.contains([',', '"']) {
        format!("\"{}\"", words.replace('"', "\"\""))
    } else {
        words.to_owned()
    }
}

/// All clauses of a side, and what is not checked.
pub fn listing(party: Party) -> String {
    let mut text = format!("clauses of a {party} (interface/PROTOCOL.md):\n");
    for clause in of(party) {
        let _ = writeln!(
            text,
            "  {:<6} {:<6} {}",
            clause.id, clause.level, clause.title
        );
    }
    let _ = writeln!(text, "not checked:");
    for (clause, reason) in NOT_CHECKED {
        let _ = writeln!(text, "  {clause:<10} {reason}");
    }
    text
}
