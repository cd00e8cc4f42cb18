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
    /// A waiver without a reason, or of no clause there is.
    #[error("waiver of `{clause}`: {message}")]
    Waiver {
        /// Its clause.
        clause: String,
        /// What is wrong.
        message: &'static str,
    },
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
        for waiver in &waivers.waiver {
            if waiver.reason.trim().is_empty() {
                return Err(WaiverError::Waiver {
                    clause: waiver.clause.clone(),
                    message: "it needs a reason",
                });
            }
        }
        Ok(waivers)
    }

    /// The waiver of a clause that holds on `today`.
    pub fn of(&self, clause: &str, today: toml::value::Date) -> Option<&Waiver> {
        let holds = |w: &&Waiver| w.clause == clause && day(w.expires) >= day(today);
        self.waiver.iter().find(holds)
    }

    /// Waived clauses, for a check that there are such.
    pub fn clauses(&self) -> impl Iterator<Item = &str> {
        self.waiver.iter().map(|waiver| waiver.clause.as_str())
    }
}

fn day(date: toml::value::Date) -> (u16, u8, u8) {
    (date.year, date.month, date.day)
}

/// Today (UTC).
pub fn today() -> toml::value::Date {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    date(since.map_or(0, |t| t.as_secs() / 86_400))
}

/// The date that many days after 1970-01-01: years from 1 March, so that the leap day is the last of its year, in eras
/// of 400 years of 146097 days.
fn date(days: u64) -> toml::value::Date {
    let days = days + 719_468; // since 1 March of the year 0
    let (era, day) = (days / 146_097, days % 146_097);
    let year = (day - day / 1_460 + day / 36_524 - day / 146_096) / 365;
    let day = day - (365 * year + year / 4 - year / 100);
    let month = (5 * day + 2) / 153; // from March
    let day_of_month = day - (153 * month + 2) / 5 + 1;
    let (year, month) = (
        era * 400 + year,
        if month < 10 { month + 3 } else { month - 9 },
    );
    toml::value::Date {
        year: (year + u64::from(month <= 2)) as u16,
        month: month as u8,
        day: day_of_month as u8,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_become_dates() {
        for (days, text) in [
            (0, "1970-01-01"),
            (59, "1970-03-01"),
            (11_016, "2000-02-29"),
            (11_017, "2000-03-01"),
            (20_818, "2026-12-31"),
            (20_819, "2027-01-01"),
        ] {
            assert_eq!(date(days).to_string(), text);
        }
    }

    #[test]
    fn a_waiver_holds_until_its_day_is_over() {
        let text = "[[waiver]]\nclause = \"F-7a\"\nreason = \"r\"\nexpires = 2026-12-31\n";
        let waivers = Waivers::parse(text).unwrap();
        assert!(waivers.of("F-7a", date(20_818)).is_some());
        assert!(waivers.of("F-7a", date(20_819)).is_none());
        assert!(waivers.of("F-8a", date(20_818)).is_none());
    }

    #[test]
    fn a_waiver_needs_reason_and_day() {
        let bare = "[[waiver]]\nclause = \"F-7a\"\nreason = \" \"\nexpires = 2026-12-31\n";
        assert!(matches!(
            Waivers::parse(bare),
            Err(WaiverError::Waiver { .. })
        ));
        let endless = "[[waiver]]\nclause = \"F-7a\"\nreason = \"r\"\n";
        assert!(matches!(
            Waivers::parse(endless),
            Err(WaiverError::Parse(_))
        ));
    }
}
