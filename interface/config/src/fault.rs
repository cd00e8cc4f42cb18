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

/// The faults found so far, and the path of what is looked at: keys are below it.
pub(super) struct Faults<'a> {
    found: &'a mut Vec<ConfigFault>,
    path: String,
}

impl Faults<'_> {
    /// All that `look` finds, from the keys at the top on.
    pub fn all(look: impl FnOnce(&mut Faults<'_>)) -> Vec<ConfigFault> {
        let mut found = Vec::new();
        look(&mut Faults {
            found: &mut found,
            path: String::new(),
        });
        found
    }

    /// The same list, for what is below `key`.
    pub fn at(&mut self, key: impl Display) -> Faults<'_> {
        let path = self.key(key);
        let found = &mut *self.found;
        Faults { found, path }
    }

    fn key(&self, key: impl Display) -> String {
        let key = key.to_string();
        match (self.path.is_empty(), key.is_empty()) {
            (true, _) => key,
            (_, true) => self.path.clone(),
            _ => format!("{}.{key}", self.path),
        }
    }

    /// Number of faults so far.
    pub fn count(&self) -> usize {
        self.found.len()
    }

    /// Adds a fault of `key`; "" is what is looked at itself.
    pub fn add(
        &mut self,
        key: impl Display,
        value: impl Display,
        expected: impl Display,
        help: impl Display,
    ) {
        let fault = ConfigFault {
            key: self.key(key),
            value: value.to_string(),
            expected: expected.to_string(),
            help: help.to_string(),
        };
        self.found.push(fault);
    }

    /// Reports a number unless it is finite and `holds`; returns whether it is accepted.
    pub fn number(&mut self, key: impl Display, value: f64, holds: bool, expected: &str) -> bool {
        self.number_in("", key, value, holds, expected)
    }

    /// The same for a number that has to be above 0.
    pub fn positive(&mut self, key: impl Display, value: f64, expected: &str) -> bool {
        self.number(key, value, value > 0.0, expected)
    }

    /// The same for a number that has to be 0 or more.
    pub fn not_negative(&mut self, key: impl Display, value: f64, expected: &str) -> bool {
        self.number(key, value, value >= 0.0, expected)
    }

    /// The same for a number in `unit`, which the message contains.
    pub fn number_in(
        &mut self,
        unit: &str,
        key: impl Display,
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
    pub fn finite(&mut self, key: impl Display, values: &[f64]) {
        if !values.iter().all(|x| x.is_finite()) {
            self.add(key, format!("{values:?}"), "finite numbers", "");
        }
    }
}
