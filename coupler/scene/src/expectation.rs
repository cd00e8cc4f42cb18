//! How the run of a scene is known to end, beside how it has ended.

use schemars::JsonSchema;
use serde::Deserialize;

use record::summary::Status;

/// How the run of a scene is known to end: `passes`, `fails: WHY` or `stops: WHY`.
#[derive(Debug, Clone, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(try_from = "String")]
#[schemars(with = "String", extend("pattern" = "^(passes|(fails|stops): .+)$"))]
pub enum Expectation {
    /// It reaches its end, and every check holds.
    #[default]
    Passes,
    /// It reaches its end, and a check does not hold; the text says why.
    Fails(String),
    /// It is stopped before its end; the text says why.
    Stops(String),
}

impl TryFrom<String> for Expectation {
    type Error = &'static str;

    fn try_from(text: String) -> Result<Self, Self::Error> {
        match text.split_once(": ") {
            None if text == "passes" => Ok(Self::Passes),
            Some(("fails", why)) if !why.is_empty() => Ok(Self::Fails(why.to_owned())),
            Some(("stops", why)) if !why.is_empty() => Ok(Self::Stops(why.to_owned())),
            _ => Err("expected `passes`, `fails: WHY` or `stops: WHY`"),
        }
    }
}

impl Expectation {
    /// Whether a run that has ended so ended as its scene says. `None` of one that was cut short from outside.
    pub const fn is_met(&self, status: Status) -> Option<bool> {
        match status {
            Status::Done => Some(matches!(self, Self::Passes)),
            Status::CheckFailed => Some(matches!(self, Self::Fails(_))),
            Status::Failed | Status::Unstable => Some(matches!(self, Self::Stops(_))),
            Status::Interrupted | Status::Killed => None,
        }
    }

    /// What a reader of the result has to know of it: why it does not pass, or that it was expected not to pass as it
    /// has done. `None` where nothing but success was expected.
    pub fn remark(&self, status: Status) -> Option<String> {
        let (what, reason) = match self {
            Self::Passes => return None,
            Self::Fails(reason) => ("a check fails", reason),
            Self::Stops(reason) => ("the run is stopped", reason),
        };
        self.is_met(status).map(|met| {
            if met {
                format!("expected by the scene: {reason}")
            } else {
                format!("not as the scene expects, which is that {what}: {reason}")
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_expectation_that_is_not_success_has_a_reason() {
        let read = |text: &str| Expectation::try_from(text.to_owned()).ok();
        assert_eq!(read("passes"), Some(Expectation::Passes));
        assert_eq!(read("fails: a: b"), Some(Expectation::Fails("a: b".into())));
        assert_eq!(read("stops: c"), Some(Expectation::Stops("c".into())));
        for wrong in [
            "",
            "fails",
            "fails: ",
            "stops:now",
            "passes: yes",
            "will: not",
        ] {
            assert_eq!(read(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn only_the_expected_end_is_as_expected() {
        let fails = Expectation::Fails("too coarse".into());
        let stops = Expectation::Stops("a point leaves".into());
        let ends = [
            Status::Done,
            Status::CheckFailed,
            Status::Failed,
            Status::Unstable,
        ];
        for (expected, met) in [
            (&Expectation::Passes, [true, false, false, false]),
            (&fails, [false, true, false, false]),
            (&stops, [false, false, true, true]),
        ] {
            assert_eq!(ends.map(|end| expected.is_met(end)), met.map(Some));
            assert_eq!(expected.is_met(Status::Interrupted), None);
        }
        let remark = |status| fails.remark(status).unwrap();
        assert_eq!(
            remark(Status::CheckFailed),
            "expected by the scene: too coarse"
        );
        assert_eq!(
            remark(Status::Done),
            "not as the scene expects, which is that a check fails: too coarse"
        );
        assert_eq!(Expectation::Passes.remark(Status::CheckFailed), None);
    }
}
