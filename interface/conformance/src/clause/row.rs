//! One clause: an id, a level, what it says, what it needs, the function that judges it, and the mutants that break it.

use core::fmt::{self, Display};

use interface::config::capability::Capabilities;
use serde::Serialize;

use crate::bench::Bench;
use crate::mutant::flaw::{Flaw, Mutant};
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

/// Most mutants of a clause.
const MUTANTS: usize = 20;

/// One thing that a solver must or should do, how to see whether it does, and solvers that do not.
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
    pub judge: Option<fn(&Bench) -> Judgement>,
    /// Solvers that break it and no other clause.
    mutants: [Option<Mutant>; MUTANTS],
}

impl Clause {
    /// A clause that is *shall*, and that nobody judges yet.
    const fn of(id: &'static str, title: &'static str) -> Self {
        Self {
            id,
            level: Level::Must,
            title,
            after: &[],
            needs: &[],
            of_processes: false,
            alone: false,
            judge: None,
            mutants: [None; MUTANTS],
        }
    }

    /// A clause that is *shall*.
    pub const fn must(
        id: &'static str,
        title: &'static str,
        judge: fn(&Bench) -> Judgement,
    ) -> Self {
        Self {
            judge: Some(judge),
            ..Self::of(id, title)
        }
    }

    /// A clause that is *shall* and is judged by random cases.
    pub const fn random(id: &'static str, title: &'static str) -> Self {
        Self::of(id, title)
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

    /// It can be judged only of a solver that takes these.
    #[must_use]
    pub const fn needs(self, needs: &'static [&'static str]) -> Self {
        Self { needs, ..self }
    }

    /// It can be seen of a process only.
    #[must_use]
    pub const fn of_processes(self) -> Self {
        Self {
            of_processes: true,
            ..self
        }
    }

    /// It is judged while no other clause is, because it measures time.
    #[must_use]
    pub const fn alone(self) -> Self {
        Self {
            alone: true,
            ..self
        }
    }

    /// A solver that is right but for this.
    #[must_use]
    pub const fn mutant(mut self, what: &'static str, flaw: fn() -> Flaw) -> Self {
        let mut k = 0;
        while self.mutants[k].is_some() {
            k += 1;
        }
        self.mutants[k] = Some(Mutant { what, flaw });
        self
    }

    /// Its mutants.
    pub fn mutants(&self) -> impl Iterator<Item = Mutant> {
        self.mutants.iter().flatten().copied()
    }

    /// The capabilities that it needs and `taken` has not.
    pub fn lacks(&self, taken: &Capabilities) -> Vec<String> {
        let lacking = self.needs.iter().filter(|name| !taken.meets(name));
        lacking.map(ToString::to_string).collect()
    }
}
