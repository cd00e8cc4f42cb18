//! The result for people: one row a clause, its evidence below it where it is broken.

use core::fmt::Write as _;

use interface::control::Party;

use super::waiver;
use crate::clause::{NOT_CHECKED, of};
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

/// The row of a clause, without a newline at its end.
pub fn row(judged: &Judged, waivers: &Waivers, paint: Paint) -> String {
    let clause = judged.clause;
    let (word, colour, said) = match &judged.verdict {
        Verdict::Pass { measured } => ("pass", GREEN, measured.clone()),
        Verdict::Fail(_) if waiver(judged, waivers).is_some() => ("waived", YELLOW, String::new()),
        Verdict::Fail(_) => ("FAIL", RED, String::new()),
        Verdict::NotApplicable { reason } => ("n/a", GREY, reason.clone()),
        Verdict::Blocked { by } => ("blocked", YELLOW, format!("by {by}")),
    };
    let word = paint.word(&format!("{word:<7}"), colour);
    let mut text = format!(
        "  {:<6} {:<6} {word} {}",
        clause.id, clause.level, clause.title
    );
    if !said.is_empty() {
        let _ = write!(text, "\n{:24}{}", "", paint.word(&said, GREY));
    }
    if let Verdict::Fail(evidence) = &judged.verdict {
        if let Some(step) = evidence.step {
            let _ = write!(text, "\n{:24}step      {step}", "");
        }
        let _ = write!(text, "\n{:24}expected  {}", "", evidence.expected);
        let _ = write!(text, "\n{:24}got       {}", "", evidence.got);
        if let Some(reason) = waiver(judged, waivers) {
            let _ = write!(text, "\n{:24}waived    {reason}", "");
        }
    }
    text
}

/// The last line: how many of each.
pub fn summary(examination: &Examination, waivers: &Waivers) -> String {
    let count = |what: fn(&Verdict) -> bool| {
        let verdicts = examination.judged.iter().map(|judged| &judged.verdict);
        verdicts.filter(|verdict| what(verdict)).count()
    };
    let waived = examination
        .judged
        .iter()
        .filter(|judged| waiver(judged, waivers).is_some());
    let waived = waived.count();
    let wall: f64 = examination
        .judged
        .iter()
        .map(|j| j.wall.as_secs_f64())
        .sum();
    format!(
        "{} `{}`: {} pass, {} fail, {waived} waived, {} not applicable, {} blocked, in {wall:.1} s",
        examination.party,
        examination.identity,
        count(|v| matches!(v, Verdict::Pass { .. })),
        count(|v| matches!(v, Verdict::Fail(_))) - waived,
        count(|v| matches!(v, Verdict::NotApplicable { .. })),
        count(|v| matches!(v, Verdict::Blocked { .. })),
    )
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
