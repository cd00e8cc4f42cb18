//! What all rounds come to.

use std::fmt::{self, Display};

use crate::kind::Kind;
use crate::round::{Round, Verdict, Wrong};

/// What the rounds of one kind come to.
#[derive(Debug, Clone, Copy, Default)]
struct Row {
    rounds: u64,
    skipped: u64,
    went_through: u64,
    resumed: u64,
    anew: u64,
    /// In the order of [`WRONG`].
    wrong: [u64; WRONG.len()],
}

/// What can be wrong, and the head of its column.
const WRONG: [(Wrong, &str); 5] = [
    (Wrong::Leftover, "leftovers"),
    (Wrong::Hang, "hangs"),
    (Wrong::Culprit, "wrong culprit"),
    (Wrong::Bits, "different bits"),
    (Wrong::End, "wrong end"),
];

/// A round that failed.
#[derive(Debug, Clone)]
pub struct Failed {
    /// Its number.
    pub number: u64,
    /// What happened.
    pub kind: Kind,
    /// What is wrong, in words.
    pub words: Vec<String>,
}

/// What all rounds come to.
#[derive(Debug, Clone)]
pub struct Table {
    rows: Vec<(Kind, Row)>,
    /// Rounds that failed.
    pub failed: Vec<Failed>,
    /// What is there of any run after a last sweep.
    pub left: Vec<String>,
}

impl Table {
    /// No round yet.
    pub fn new(kinds: &[Kind]) -> Self {
        let mut kinds = kinds.to_vec();
        kinds.sort();
        kinds.dedup();
        Self {
            rows: kinds
                .into_iter()
                .map(|kind| (kind, Row::default()))
                .collect(),
            failed: Vec::new(),
            left: Vec::new(),
        }
    }

    /// Takes what a round has come to.
    pub fn take(&mut self, round: &Round, verdict: &Verdict) {
        let found = self.rows.iter_mut().find(|(kind, _)| *kind == round.kind);
        let (_, row) = found.expect("rounds are of these kinds");
        row.rounds += 1;
        row.skipped += u64::from(verdict.skipped);
        row.went_through += u64::from(verdict.went_through);
        row.resumed += u64::from(verdict.resumed);
        row.anew += u64::from(verdict.anew);
        for ((wrong, _), count) in WRONG.iter().zip(&mut row.wrong) {
            *count += u64::from(verdict.failures.iter().any(|f| f.wrong == *wrong));
        }
        if !verdict.failures.is_empty() {
            self.failed.push(Failed {
                number: round.number,
                kind: round.kind,
                words: verdict.failures.iter().map(ToString::to_string).collect(),
            });
        }
    }

    /// Whether something is wrong.
    pub fn has_failed(&self) -> bool {
        !self.failed.is_empty() || !self.left.is_empty()
    }

    /// Rounds that this machine cannot run.
    pub fn skipped(&self) -> u64 {
        self.rows.iter().map(|(_, row)| row.skipped).sum()
    }
}

impl Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "| what happens | rounds | went through | resumed | from the start |"
        )?;
        for (_, head) in WRONG {
            write!(f, " {head} |")?;
        }
        writeln!(f)?;
        writeln!(f, "|{}", " --- |".repeat(5 + WRONG.len()))?;
        let mut all = Row::default();
        for (kind, row) in &self.rows {
            line(f, kind.name(), row)?;
            all.rounds += row.rounds;
            all.went_through += row.went_through;
            all.resumed += row.resumed;
            all.anew += row.anew;
            for (sum, count) in all.wrong.iter_mut().zip(row.wrong) {
                *sum += count;
            }
        }
        line(f, "all", &all)
    }
}

fn line(f: &mut fmt::Formatter<'_>, name: &str, row: &Row) -> fmt::Result {
    let Row {
        rounds,
        went_through,
        resumed,
        anew,
        wrong,
        ..
    } = row;
    write!(
        f,
        "| {name} | {rounds} | {went_through} | {resumed} | {anew} |"
    )?;
    for count in wrong {
        write!(f, " {count} |")?;
    }
    writeln!(f)
}
