//! The result for people: one row a clause, its evidence below it where it is broken.

use core::fmt::Write as _;
use std::collections::BTreeMap;

use interface::message::control::Party;

use super::{count, shown, waiver};
use crate::clause::{Clause, common, not_checked, of, own};
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
            "pass" => GREEN,
            "FAIL" => RED,
            "n/a" => GREY,
            _ => YELLOW,
        };
        let word = self.paint.word(&format!("{word:<7}"), colour);
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
        let mut lines: Vec<String> = evidence
            .step
            .map(|n| format!("step      {n}"))
            .into_iter()
            .collect();
        lines.push(format!("expected  {}", evidence.expected));
        lines.push(format!("got       {}", evidence.got));
        lines.extend(evidence.story.iter().cloned());
        lines.extend(waived.map(|reason| format!("waived    {reason}")));
        for line in lines {
            let _ = write!(text, "\n{:24}{line}", "");
        }
        text
    }

    /// Which failures have one cause, a line each.
    pub fn common_causes(&self) -> String {
        let mut several: Vec<_> = self
            .causes
            .iter()
            .filter(|(_, (_, more))| *more > 0)
            .collect();
        several.sort_by_key(|(_, (_, more))| core::cmp::Reverse(*more));
        let line = |(got, (first, more)): (&String, &(&str, usize))| {
            format!("{first} fails, and {more} more of the same cause: {got}\n")
        };
        several.into_iter().map(line).collect()
    }
}

/// The last lines: how many of each, what it was judged as, and what was not judged.
pub fn summary(examination: &Examination, waivers: &Waivers) -> String {
    let count = |word| count(examination, waivers, word);
    let (passed, wall) = (count("pass"), examination.wall.as_secs_f64());
    let text = format!(
        "{} `{}`: {passed} pass, {} fail, {} waived, {} not applicable, {} blocked, in {wall:.1} s",
        examination.party,
        examination.identity,
        count("FAIL"),
        count("waived"),
        count("n/a"),
        count("blocked"),
    );
    if !examination.whole {
        return text;
    }
    let left_out = examination.judged.iter().filter(|judged| judged.left_out());
    let all = examination.judged.len() - left_out.count();
    let profile = examination.profile().map_or("none", |profile| profile.name);
    let not_judged: Vec<String> = examination.not_judged().into_iter().collect();
    let none = not_judged.is_empty();
    let not_judged = if none {
        "nothing".into()
    } else {
        not_judged.join(", ")
    };
    format!("{text}\n{passed} of {all}, profile {profile}; not judged: {not_judged}")
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
    for (clause, reason) in not_checked() {
        let _ = writeln!(text, "  {clause:<10} {reason}");
    }
    text
}
