//! Clauses that somebody has agreed to see broken for a while: each with a reason, and a day on which that ends.

use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use interface::files::{self, SMALL};
use serde::Deserialize;
use thiserror::Error;

/// A waiver file:
///
/// ```toml
/// [[waiver]]
/// clause = "T-6b"
/// reason = "sums depend on threads; being rewritten"
/// expires = 2027-01-31
/// ```
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Waivers {
    #[serde(default)]
    waiver: Vec<Waiver>,
}

/// Leave to break one clause.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Waiver {
    /// Id of the clause.
    pub clause: String,
    /// Why.
    pub reason: String,
    /// Last day on which it holds (UTC).
    pub expires: toml::value::Date,
}

/// A waiver file that cannot be used.
#[derive(Debug, Error)]
pub enum WaiverError {
    /// It cannot be read.
    #[error("cannot read {path}: {source}")]
    Read {
        /// Where.
        path: String,
        /// Why.
        source: std::io::Error,
    },
    /// It is not a waiver file.
    #[error("{0}")]
    Parse(#[from] toml::de::Error),
    /// A waiver without a reason.
    #[error("waiver of `{0}`: it needs a reason")]
    NoReason(String),
}

impl Waivers {
    /// Reads a file.
    ///
    /// # Errors
    /// [`WaiverError`].
    pub fn read(path: &Path) -> Result<Self, WaiverError> {
        let text = files::read_named_text(path, SMALL).map_err(|source| WaiverError::Read {
            path: path.display().to_string(),
            source,
        })?;
        Self::parse(&text)
    }

    /// Parses the text of a file.
    ///
    /// # Errors
    /// [`WaiverError`].
    pub fn parse(text: &str) -> Result<Self, WaiverError> {
        let waivers: Self = toml::from_str(text)?;
        let mut all = waivers.waiver.iter();
        if let Some(bare) = all.find(|waiver| waiver.reason.trim().is_empty()) {
            return Err(WaiverError::NoReason(bare.clause.clone()));
        }
        Ok(waivers)
    }

    /// The waiver of a clause that holds `today`, in days since 1970-01-01.
    pub fn of(&self, clause: &str, today: i64) -> Option<&Waiver> {
        let holds = |w: &&Waiver| w.clause == clause && day(w.expires) >= today;
        self.waiver.iter().find(holds)
    }

    /// Waived clauses, for a check that there are such.
    pub fn clauses(&self) -> impl Iterator<Item = &str> {
        self.waiver.iter().map(|waiver| waiver.clause.as_str())
    }
}

/// Days from 1970-01-01 to a date: years begin on 1 March, so that the leap day is the last of its year.
fn day(date: toml::value::Date) -> i64 {
    let [year, month, day] = [date.year.into(), date.month.into(), date.day.into()];
    let (year, month): (i64, i64) = if month > 2 {
        (year, month - 3)
    } else {
        (year - 1, month + 9)
    };
    let leap_days = year / 4 - year / 100 + year / 400;
    365 * year + leap_days + (153 * month + 2) / 5 + day - 719_469
}

/// Today (UTC), in days since 1970-01-01.
pub fn today() -> i64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.map_or(0, |t| (t.as_secs() / 86_400).cast_signed())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_become_days() {
        for (days, text) in [
            (0, "1970-01-01"),
            (59, "1970-03-01"),
            (11_016, "2000-02-29"),
            (11_017, "2000-03-01"),
            (20_818, "2026-12-31"),
            (20_819, "2027-01-01"),
        ] {
            let date: toml::value::Datetime = text.parse().unwrap();
            assert_eq!(day(date.date.unwrap()), days);
        }
    }

    #[test]
    fn a_waiver_holds_until_its_day_is_over() {
        let text = "[[waiver]]\nclause = \"F-7a\"\nreason = \"r\"\nexpires = 2026-12-31\n";
        let waivers = Waivers::parse(text).unwrap();
        assert!(waivers.of("F-7a", 20_818).is_some());
        assert!(waivers.of("F-7a", 20_819).is_none());
        assert!(waivers.of("F-8a", 20_818).is_none());
    }

    #[test]
    fn a_waiver_needs_reason_and_day() {
        let bare = "[[waiver]]\nclause = \"F-7a\"\nreason = \" \"\nexpires = 2026-12-31\n";
        let parsed = Waivers::parse(bare);
        assert!(matches!(parsed, Err(WaiverError::NoReason(_))));
        let endless = "[[waiver]]\nclause = \"F-7a\"\nreason = \"r\"\n";
        let parsed = Waivers::parse(endless);
        assert!(matches!(parsed, Err(WaiverError::Parse(_))));
    }
}
