//! A fault of a configuration. `MpmConfig::faults` and `DemConfig::faults` list them; the scene reader and the solvers
//! both call these, so that `tandem check` refuses what `tandem run` would refuse.

use std::fmt::{self, Display};

/// An impossible value of a configuration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ConfigFault {
    /// Dotted key, such as `dem.body.3.sphero_radius` or `mpm.points.0.spacing.per_cell`.
    pub key: String,
    /// The value as it is, with its unit.
    pub value: String,
    /// What it may be; ends the sentence "..., expected".
    pub expected: String,
    /// What to write instead, or why it cannot be; empty where `expected` says it all.
    pub help: String,
}

impl Display for ConfigFault {
    /// The fault without its key: "is -1 m, expected a length above 0; help".
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "is {}, expected {}", self.value, self.expected)?;
        if self.help.is_empty() {
            return Ok(());
        }
        write!(f, "; {}", self.help)
    }
}

/// The faults found so far.
#[derive(Default)]
pub(super) struct Faults(pub Vec<ConfigFault>);

impl Faults {
    pub fn add(
        &mut self,
        key: impl Into<String>,
        value: impl Into<String>,
        expected: impl Into<String>,
        help: impl Into<String>,
    ) {
        self.0.push(ConfigFault {
            key: key.into(),
            value: value.into(),
            expected: expected.into(),
            help: help.into(),
        });
    }

    /// Reports a number unless it is finite and `holds`; returns whether it is accepted.
    pub fn number(
        &mut self,
        key: impl Into<String>,
        value: f64,
        holds: bool,
        expected: &str,
    ) -> bool {
        self.number_in("", key, value, holds, expected)
    }

    /// The same for a number in `unit`, which the message contains.
    pub fn number_in(
        &mut self,
        unit: &str,
        key: impl Into<String>,
        value: f64,
        holds: bool,
        expected: &str,
    ) -> bool {
        let sound = value.is_finite() && holds;
        if !sound {
            let value = format!("{value} {unit}");
            self.add(key, value.trim_end(), expected, "");
        }
        sound
    }

    /// Reports numbers that are not all finite.
    pub fn finite(&mut self, key: impl Into<String>, values: &[f64]) {
        if !values.iter().all(|x| x.is_finite()) {
            self.add(key, format!("{values:?}"), "finite numbers", "");
        }
    }
}
