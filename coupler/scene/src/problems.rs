//! The faults and warnings found so far, and the tests of single numbers that most faults come from.

use std::collections::BTreeMap;
use std::ops::Range;

use interface::config::ConfigFault;

use crate::diagnostic::{Diagnostic, FAULTS_LIMIT, SceneErrors, suggestion};

use super::document::{Document, Part};
use super::needs::body_or_set;

/// The faults and warnings found so far in a document.
pub(super) struct Problems<'a> {
    pub document: &'a Document,
    errors: Vec<Diagnostic>,
    /// Number of faults, including those that are not reported.
    found: usize,
    pub warnings: Vec<String>,
}

impl<'a> Problems<'a> {
    pub fn new(document: &'a Document) -> Self {
        Self {
            document,
            errors: Vec::new(),
            found: 0,
            warnings: Vec::new(),
        }
    }

    /// The warnings, if there was no fault.
    ///
    /// # Errors
    /// All faults, in the order of the file.
    pub fn finish(mut self) -> Result<Vec<String>, SceneErrors> {
        if self.errors.is_empty() {
            return Ok(self.warnings);
        }
        self.errors.sort_by_key(|error| error.place.line());
        Err(SceneErrors(self.errors))
    }

    pub fn any(&self) -> bool {
        !self.errors.is_empty()
    }

    /// How many faults there are.
    pub fn count(&self) -> usize {
        self.found
    }

    /// Adds a fault, unless there are too many to report; `fault` is called only if it is added.
    fn push(&mut self, fault: impl FnOnce(&Document) -> Diagnostic) {
        self.found += 1;
        if self.errors.len() < FAULTS_LIMIT {
            self.errors.push(fault(self.document));
        }
    }

    /// Whether further faults would not be reported.
    pub fn is_full(&self) -> bool {
        self.errors.len() >= FAULTS_LIMIT
    }

    pub fn warn(&mut self, warning: impl Into<String>) {
        self.warnings.push(warning.into());
    }

    /// Refuses a value.
    pub fn refuse(&mut self, path: &str, message: impl AsRef<str>, help: impl Into<String>) {
        let help = Some(help.into());
        self.push(|document| document.diagnostic(path, Part::Value, message.as_ref(), help));
    }

    /// Refuses a value with a name that is none of `names`, which are `what`. Nearest names take long to find, and only those
    /// of faults that are reported are looked for.
    pub fn refuse_unknown<'b>(
        &mut self,
        path: &str,
        message: &str,
        [name, what]: [&str; 2],
        names: impl Iterator<Item = &'b str>,
    ) {
        self.push(|document| {
            let help = Some(suggestion(name, what, names));
            document.diagnostic(path, Part::Value, message, help)
        });
    }

    /// Refuses a key that is missing or not allowed.
    pub fn refuse_key(&mut self, path: &str, message: impl AsRef<str>, help: impl Into<String>) {
        let help = Some(help.into());
        self.push(|document| document.diagnostic(path, Part::Key, message.as_ref(), help));
    }

    /// Refuses a part of a text.
    pub fn refuse_within(
        &mut self,
        path: &str,
        at: &Range<usize>,
        message: &str,
        help: Option<String>,
    ) {
        self.push(|document| document.diagnostic_within(path, at, message, help));
    }

    /// Refuses `value` unless `holds`; `expected` ends the sentence "..., expected".
    pub fn number(&mut self, path: &str, value: f64, holds: bool, expected: &str) {
        if !holds {
            self.config_faults(vec![ConfigFault {
                key: path.to_owned(),
                value: value.to_string(),
                expected: expected.to_owned(),
                help: String::new(),
            }]);
        }
    }

    /// Reports the faults that the rules of the configuration find, with the values of the scene, unless their keys were
    /// refused before.
    pub fn config_faults(&mut self, faults: Vec<ConfigFault>) {
        for fault in faults {
            if self.is_full() {
                self.found += 1;
                continue;
            }
            let key = body_or_set(&fault.key, self.document);
            if self.errors.iter().any(|known| known.key == key) {
                continue;
            }
            let written = self.document.as_written(&key);
            // A number is shown as written in the scene, such as 1e-3.
            let is_number = fault.value.parse::<f64>().is_ok() && !written.is_empty();
            let value = if is_number { &written } else { &fault.value };
            let message = format!("`{key}` is {value}, expected {}", fault.expected);
            let help = Some(fault.help).filter(|help| !help.is_empty());
            self.push(|document| document.diagnostic(&key, Part::Value, &message, help));
        }
    }

    pub fn above_zero(&mut self, path: &str, value: f64, what: &str) {
        self.number(path, value, value > 0.0, &format!("{what} above 0"));
    }

    pub fn not_negative(&mut self, path: &str, value: f64, what: &str) {
        self.number(path, value, value >= 0.0, &format!("{what} of 0 or more"));
    }

    /// Refuses names of the elements of the list `key` that cannot be part of an expression, or that occur twice; `what` are
    /// the elements.
    pub fn names<'b>(
        &mut self,
        key: &str,
        what: &str,
        names: impl Iterator<Item = &'b str> + Clone,
    ) {
        for (i, name) in names.clone().enumerate() {
            self.name(&format!("{key}.{i}.name"), name);
        }
        self.distinct(key, what, names);
    }

    /// Refuses a name that cannot be part of an expression.
    pub fn name(&mut self, path: &str, name: &str) {
        let mut letters = name.chars();
        let good = letters.next().is_some_and(|c| c.is_ascii_alphabetic())
            && letters.all(|c| c.is_ascii_alphanumeric() || c == '_');
        if !good {
            let message =
                format!("`{path}` is \"{name}\", expected a letter, then letters, digits or `_`");
            let help = "quantities are named after it, as in `body.NAME.vx`";
            self.refuse(path, message, help);
        }
    }

    /// Refuses names of the elements of the list `key` that occur twice.
    pub fn distinct<'b>(&mut self, key: &str, what: &str, names: impl Iterator<Item = &'b str>) {
        let mut seen: BTreeMap<&str, usize> = BTreeMap::new();
        for (i, name) in names.enumerate() {
            if let Some(first) = seen.get(name) {
                let first = format!("{key}.{first}.name");
                let help = format!("`{first}` has it already; give each of {what} its own name");
                let message = format!("two of {what} are named \"{name}\"");
                self.refuse(&format!("{key}.{i}.name"), message, help);
            } else {
                seen.insert(name, i);
            }
        }
    }
}
