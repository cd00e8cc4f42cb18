//! Clauses as data: an id, a level, and a function that judges.

pub mod dem;
mod machine;
pub mod mpm;
mod session;

use core::fmt::{self, Display};

use interface::control::Party;
use serde::Serialize;

use crate::bench::Bench;
use crate::verdict::Judgement;

/// How binding a clause is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "UPPERCASE")]
pub enum Level {
    /// *Shall* in PROTOCOL.md.
    Must,
    /// *Should*, or a bound of our own on what PROTOCOL.md leaves open.
    Should,
}

impl Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Must => "MUST",
            Self::Should => "SHOULD",
        })
    }
}

/// One thing that a solver must or should do, and how to see whether it does.
pub struct Clause {
    /// The clause of PROTOCOL.md, with a letter if it is judged in several ways: `F-7a`.
    pub id: &'static str,
    /// How binding it is.
    pub level: Level,
    /// What it says, in a line.
    pub title: &'static str,
    /// Clauses without which this one cannot be judged.
    pub after: &'static [&'static str],
    /// Numbers of the starting list that it covers (docs/conformance.md).
    pub list: &'static [&'static str],
    /// Whether it can be seen of a process only.
    pub of_processes: bool,
    /// Judges it.
    pub judge: fn(&Bench) -> Judgement,
}

impl Clause {
    /// A clause that is *shall*.
    pub const fn must(
        id: &'static str,
        title: &'static str,
        judge: fn(&Bench) -> Judgement,
    ) -> Self {
        Self {
            id,
            level: Level::Must,
            title,
            after: &[],
            list: &[],
            of_processes: false,
            judge,
        }
    }

    /// A clause that is *should*.
    pub const fn should(
        id: &'static str,
        title: &'static str,
        judge: fn(&Bench) -> Judgement,
    ) -> Self {
        Self {
            level: Level::Should,
            ..Self::must(id, title, judge)
        }
    }

    /// It can be judged only where these are kept.
    #[must_use]
    pub const fn after(self, after: &'static [&'static str]) -> Self {
        Self { after, ..self }
    }

    /// It covers these of the starting list.
    #[must_use]
    pub const fn covers(self, list: &'static [&'static str]) -> Self {
        Self { list, ..self }
    }

    /// It can be seen of a process only.
    #[must_use]
    pub const fn of_processes(self) -> Self {
        Self {
            of_processes: true,
            ..self
        }
    }
}

/// The clauses by which the solver of one side is judged, in order; what a clause is `after` comes before it.
pub fn of(party: Party) -> Vec<&'static Clause> {
    match party {
        Party::Dem => dem::clauses().collect(),
        Party::Mpm => mpm::clauses().collect(),
        Party::Coupler => Vec::new(),
    }
}

/// What nobody can see from outside, or what this kit does not look at, with the reason.
pub const NOT_CHECKED: &[(&str, &str)] = &[
    (
        "C-5",
        "whether a solver copies before it checks: only a sender that writes to a segment in use would tell",
    ),
    (
        "C-7",
        "that a sender gives up on a full channel after 10 s: too long for a kit",
    ),
    (
        "S-11",
        "the waits of 30 s and 120 s: too long for a kit; those that come from `Configure.deadline` are judged",
    ),
    (
        "S-8",
        "that a solver has done nothing that outlasts it before Ready: nobody sees all that it may have done",
    ),
    ("G-4 to G-8", "rules of the coupler; the kit keeps them"),
    (
        "J-1",
        "every value of every field; the fields that forces and motion show are judged",
    ),
    (
        "V-4",
        "the version of the transport: another one cannot join",
    ),
    ("X-4", "the exit status of `tandem run`"),
];
