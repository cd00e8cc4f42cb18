//! What becomes of a clause: a verdict with the numbers that show it.

use core::fmt::{self, Display};

use interface::solver::Refusal;
use interface::transport::TransportError;
use serde::Serialize;

/// How a clause was judged.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(tag = "verdict", rename_all = "snake_case")]
pub enum Verdict {
    /// It is kept.
    Pass {
        /// What was measured.
        measured: String,
    },
    /// It is broken.
    Fail(Evidence),
    /// It does not apply to this solver, or cannot be seen here.
    NotApplicable {
        /// The refused key with the solver's message, what it does not take, or why it cannot be seen.
        reason: String,
        /// Whether the solver has got out of it: by a refusal, or because it does not take it.
        #[serde(skip)]
        left_out: bool,
    },
    /// It cannot be judged, because another clause is broken.
    Blocked {
        /// The other clause.
        by: &'static str,
    },
}

/// The numbers that show how a clause is broken.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Evidence {
    /// Step in which it was seen, if it was in one.
    pub step: Option<u64>,
    /// What the clause asks for.
    pub expected: String,
    /// What the solver did.
    pub got: String,
    /// The smallest random case that shows it, line by line.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub story: Vec<String>,
}

impl Display for Evidence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(step) = self.step {
            write!(f, "step {step}: ")?;
        }
        write!(f, "expected {}, got {}", self.expected, self.got)
    }
}

/// What a clause's function returns: what was measured, or why the clause is not met.
pub type Judgement = Result<String, Unmet>;

/// Why a clause is not met.
#[derive(Debug, Clone, PartialEq)]
pub enum Unmet {
    /// It is broken.
    Broken(Evidence),
    /// The solver refused a configuration that it may refuse (S-8).
    Declined(Refusal),
    /// It is about what the solver says that it does not take.
    Lacking(Vec<String>),
    /// It cannot be seen in this way of running.
    OutOfSight,
}

impl Unmet {
    /// The same, seen in `step`.
    #[must_use]
    pub fn at(mut self, step: u64) -> Self {
        if let Self::Broken(evidence) = &mut self {
            evidence.step.get_or_insert(step);
        }
        self
    }
}

impl Display for Unmet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Broken(evidence) => evidence.fmt(f),
            Self::Declined(refusal) => write!(f, "refuses {refusal}"),
            Self::Lacking(names) => write!(f, "does not take {}", names.join(", ")),
            Self::OutOfSight => f.write_str("it can be seen of a process only"),
        }
    }
}

impl From<TransportError> for Unmet {
    fn from(error: TransportError) -> Self {
        broken("a solver that takes its messages", error)
    }
}

impl From<Unmet> for Verdict {
    fn from(unmet: Unmet) -> Self {
        if let Unmet::Broken(evidence) = unmet {
            return Self::Fail(evidence);
        }
        Self::NotApplicable {
            reason: unmet.to_string(),
            left_out: !matches!(unmet, Unmet::OutOfSight),
        }
    }
}

/// The clause is broken.
pub fn broken(expected: impl Display, got: impl Display) -> Unmet {
    Unmet::Broken(Evidence {
        step: None,
        expected: expected.to_string(),
        got: got.to_string(),
        story: Vec::new(),
    })
}

/// The clause is broken unless `kept`.
///
/// # Errors
/// [`Unmet::Broken`].
pub fn require(kept: bool, expected: impl Display, got: impl Display) -> Result<(), Unmet> {
    if kept {
        Ok(())
    } else {
        Err(broken(expected, got))
    }
}

/// The clause is broken unless `got` is `expected` but for `tolerance`, both in the unit of `what`. A NaN is not.
///
/// # Errors
/// [`Unmet::Broken`].
pub fn near(what: &str, got: f64, expected: f64, tolerance: f64) -> Result<(), Unmet> {
    require(
        (got - expected).abs() <= tolerance,
        format_args!("{what} {expected:.17e} within {tolerance:.1e}"),
        format_args!("{got:.17e}, off by {:.3e}", got - expected),
    )
}
