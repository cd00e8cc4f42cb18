//! The result for people: one row a clause, its evidence below it where it is broken.

use core::fmt::Write as _;

use console::Style;
use interface::message::control::Party;

use super::{count, scenes, shown};
use crate::clause::{not_checked, of};
use crate::profile::OWN;
use crate::verdict::Verdict;
use crate::{Examination, FEW, Judged};

/// The row of a clause, without a newline at its end; its evidence below it where it is broken.
pub fn row(judged: &Judged) -> String {
    let clause = judged.clause;
    let (word, detail) = shown(judged);
    let grey = Style::new().black().bright();
    let style = match word {
        "pass" => Style::new().green(),
        "FAIL" => Style::new().red(),
        "n/a" => grey.clone(),
        _ => Style::new().yellow(),
    };
    let word = style.apply_to(format!("{word:<7}"));
    let mut text = format!(
        "  {:<6} {:<6} {word} {}",
        clause.id, clause.level, clause.title
    );
    let mut lines = Vec::new();
    if !detail.is_empty() {
        lines.push(grey.apply_to(detail).to_string());
    }
    if let Verdict::Fail(evidence) = &judged.verdict {
        lines.extend(evidence.step.map(|n| format!("step      {n}")));
        lines.push(format!("expected  {}", evidence.expected));
        lines.push(format!("got       {}", evidence.got));
        lines.extend(evidence.story.iter().cloned());
    }
    for line in lines {
        let _ = write!(text, "\n{:24}{line}", "");
    }
    text
}

/// The last lines: how many of each, what it was judged as, and what was not judged.
pub fn summary(examination: &Examination) -> String {
    let count = |word| count(examination, word);
    let (passed, wall) = (count("pass"), examination.wall.as_secs_f64());
    let text = format!(
        "{} `{}`: {passed} pass, {} fail, {} not applicable, {} blocked, in {wall:.1} s",
        examination.party,
        examination.identity,
        count("FAIL"),
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
    let not_judged = match not_judged.len() {
        0 => "nothing".into(),
        _ => not_judged.join(", "),
    };
    let mut text =
        format!("{text}\n{passed} of {all}, profile {profile}; not judged: {not_judged}");
    let own = OWN.iter();
    for own in own.filter(|own| examination.capabilities.has(own.name)) {
        let _ = write!(text, "\nHas {}.", own.what);
    }
    if examination.is_hasty() {
        let cases = examination.cases;
        let _ = write!(
            text,
            "\nONLY {cases} RANDOM CASES, which may miss any mistake: run at least {FEW}, with a longer `--time`."
        );
        return text;
    }
    let (good, all) = (examination.scenes(), scenes(examination.party).count());
    let names = match good.len() {
        0 => String::new(),
        n if n == all => ": all".into(),
        _ => format!(": {}", good.join(", ")),
    };
    let _ = write!(
        text,
        "\nGood for {} of {all} shipped scenes{names}.",
        good.len()
    );
    text
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
