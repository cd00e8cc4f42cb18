//! One clause: an id, a level, what it says, what it needs, and the function that judges it.

use core::fmt::{self, Display};

use interface::config::capability::Capabilities;
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
#[derive(Clone, Copy)]
pub struct Clause {
    /// A case of a clause of PROTOCOL.md: `F-7a`. The same id is the same statement on both sides.
    pub id: &'static str,
    /// How binding it is.
    pub level: Level,
    /// What it says, in a line.
    pub title: &'static str,
    /// Clauses without which this one cannot be judged.
    pub after: &'static [&'static str],
    /// Capabilities without which it cannot be judged (`shape:rectangle`).
    pub needs: &'static [&'static str],
    /// Whether it can be seen of a process only.
    pub of_processes: bool,
    /// Whether it is judged while no other clause is, because it measures time.
    pub alone: bool,
    /// Judges it, in sessions of its own; `None`: random cases do ([`crate::random`]), for all of these clauses at once.
    pub(crate) judge: Option<fn(&Bench) -> Judgement>,
    /// The usual mistakes that break it, in a few words each.
    pub often: &'static str,
}

/// Rows of clauses: level, id, what it says, and how it is judged: `by` a function, by a
/// thing that the kit says wrongly and that the solver `refuses` in a step or `rejects` before the first, or, without
/// either, by random cases.
macro_rules! clauses {
    ($($level:ident $id:literal $title:literal
        $($how:ident $judge:expr)? $(, $field:ident: $value:expr)*;)*) => {
        &[$($crate::clause::Clause {
            $(judge: Some($crate::clause::judged!($how $judge)),)?
            $($field: $value,)*
            ..$crate::clause::Clause::of($crate::clause::Level::$level, $id, $title)
        }),*]
    };
}
pub(crate) use clauses;

/// The function that judges a row.
macro_rules! judged {
    (by $judge:expr) => {
        $judge
    };
    (refuses $flaw:expr) => {
        |bench| $crate::clause::refuses(bench, $flaw)
    };
    (rejects $sent:expr) => {
        |bench| $crate::clause::rejects(bench, $sent)
    };
}
pub(crate) use judged;

impl Clause {
    /// A clause that random cases judge.
    pub const fn of(level: Level, id: &'static str, title: &'static str) -> Self {
        Self {
            id,
            level,
            title,
            after: &[],
            needs: &[],
            of_processes: false,
            alone: false,
            judge: None,
            often: "",
        }
    }

    /// Whether random cases judge it.
    pub fn is_random(&self) -> bool {
        self.judge.is_none()
    }

    /// The capabilities that it needs and `taken` has not.
    pub fn lacks(&self, taken: &Capabilities) -> Vec<String> {
        let lacking = self.needs.iter().filter(|name| !taken.meets(name));
        lacking.map(ToString::to_string).collect()
    }
}
