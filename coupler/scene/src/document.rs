//! A TOML document that stores the position of every value, also of values from variants and `--set`.

use std::collections::BTreeMap;
use std::io;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use interface::files::{self, SMALL};
use serde::Deserialize;
use toml::de::{DeTable, DeValue};
use toml::{Spanned, Table, Value};

use crate::diagnostic::{Diagnostic, FAULTS_LIMIT, Place, SceneErrors, shorten, suggestion};

/// Sections that contain one law each. An override that writes another law replaces the whole section.
const ONE_LAW: [&str; 2] = ["contact", "body_contact"];

/// A scene file with its overrides applied.
#[derive(Debug, Default, Clone)]
pub(super) struct Document {
    file: String,
    text: Arc<str>,
    /// The tree, without the table of variants.
    pub root: Table,
    /// Names of the variants of the file.
    pub variants: Arc<[String]>,
    /// Where overrides have set values, by dotted path. What the file has below such a path is no more.
    origins: BTreeMap<String, Origin>,
    /// Shared by all scenes of the file: there may be thousands of variants.
    written: Arc<Written>,
}

/// What is in a file.
#[derive(Debug, Default)]
struct Written {
    places: Places,
    variants: BTreeMap<String, Table>,
    /// Faults of the table of variants itself.
    faults: Vec<Diagnostic>,
}

/// Where a key or an element and its value stand in a file, and what is in the value. Paths in full would take memory
/// like the square of the text.
#[derive(Debug, Default)]
struct Places {
    key: Range<usize>,
    value: Range<usize>,
    below: Below,
}

#[derive(Debug, Default)]
enum Below {
    #[default]
    Nothing,
    Keys(BTreeMap<String, Places>),
    Elements(Vec<Places>),
}

impl Places {
    fn of(key: Range<usize>, value: &Spanned<DeValue>) -> Self {
        let below = match value.get_ref() {
            DeValue::Table(table) => Below::Keys(Self::keys(table)),
            DeValue::Array(array) => {
                let each = array
                    .iter()
                    .map(|element| Self::of(element.span(), element));
                Below::Elements(each.collect())
            }
            _ => Below::Nothing,
        };
        Self {
            key,
            value: value.span(),
            below,
        }
    }

    fn keys(table: &DeTable) -> BTreeMap<String, Self> {
        let each = table.iter();
        each.map(|(key, value)| (key.get_ref().to_string(), Self::of(key.span(), value)))
            .collect()
    }

    /// The places at a dotted path. A key in quotes may have dots itself.
    fn at(&self, path: &str) -> Option<&Self> {
        let mut ends = path.match_indices('.').map(|(end, _)| end);
        match &self.below {
            Below::Nothing => None,
            Below::Elements(each) => {
                let end = ends.next();
                let element = each.get(path[..end.unwrap_or(path.len())].parse::<usize>().ok()?)?;
                end.map_or(Some(element), |end| element.at(&path[end + 1..]))
            }
            Below::Keys(keys) => keys
                .get(path)
                .or_else(|| ends.find_map(|end| keys.get(&path[..end])?.at(&path[end + 1..]))),
        }
    }
}

#[derive(Debug, Clone)]
enum Origin {
    File {
        key: Range<usize>,
        value: Range<usize>,
        variant: Option<String>,
    },
    Set {
        argument: String,
        value: String,
    },
}

/// The part of a key to which a message refers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    /// The key itself: it is not allowed, or something is missing in its table.
    Key,
    /// Its value.
    Value,
}

/// Longest text of a scene in bytes. The longest of the tree has 240 kB; of this one, whatever is in it, `check` answers within
/// 2 s what is wrong (`coupler/tests/long_scenes.rs`). Tables and points are read from files, sets of bodies are one key.
const TEXT_MAX: usize = 2 << 20;

impl Document {
    /// Reads a scene file.
    ///
    /// # Errors
    /// The file cannot be read or is not TOML.
    pub fn read(path: &Path) -> Result<Self, SceneErrors> {
        Self::of_bytes(path, files::read_named(path, SMALL))
    }

    /// Reads the scene file `name` of a run directory.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn of_run(dir: &Path, name: &str) -> Result<Self, SceneErrors> {
        Self::of_bytes(&dir.join(name), files::read(dir, name, SMALL))
    }

    fn of_bytes(path: &Path, bytes: io::Result<Vec<u8>>) -> Result<Self, SceneErrors> {
        let file = path.display().to_string();
        let text = text(bytes, &file)?;
        Self::parse(file, &text.into())
    }

    /// The document with a variant and then the `--set` arguments, in their order.
    ///
    /// # Errors
    /// The variant does not exist, or an override has a path that cannot exist.
    pub fn with(&self, variant: Option<&str>, set: &[String]) -> Result<Self, SceneErrors> {
        let mut document = self.clone();
        let mut errors = self.written.faults.clone();
        if let Some(name) = variant {
            match self.written.variants.get(name) {
                Some(overrides) => document.apply_variant(name, overrides, &mut errors),
                None => errors.push(document.no_such_variant(name)),
            }
        }
        for argument in set {
            document.apply_argument(argument, &mut errors);
        }
        if errors.is_empty() {
            Ok(document)
        } else {
            Err(SceneErrors(errors))
        }
    }

    /// The document of a text; `file` stands for its file in messages.
    ///
    /// # Errors
    /// It is not TOML.
    pub fn parse(file: String, text: &Arc<str>) -> Result<Self, SceneErrors> {
        if text.len() > TEXT_MAX {
            let help = "values of a series are read from a file: `reference = { csv = ... }`; a `[[dem.fill]]` makes many bodies";
            let length = text.len();
            let message = format!("the scene has {length} bytes, expected at most {TEXT_MAX}");
            return Err(of_file(&file, message, help));
        }
        let (spanned, mut faults) = DeTable::parse_recoverable(text);
        let places = Places {
            below: Below::Keys(Places::keys(spanned.get_ref())),
            ..Places::default()
        };
        let root = if faults.is_empty() {
            Table::deserialize(toml::de::Deserializer::from(spanned))
        } else {
            Ok(Table::new())
        };
        let root = root.unwrap_or_else(|fault| {
            faults.push(fault);
            Table::new()
        });
        let mut document = Self {
            root,
            variants: Arc::default(),
            origins: BTreeMap::new(),
            file,
            text: text.clone(),
            written: Arc::new(Written {
                places,
                ..Written::default()
            }),
        };
        if faults.is_empty() {
            let (variants, faults) = document.take_variants();
            document.variants = variants.keys().cloned().collect();
            let written = Arc::get_mut(&mut document.written).expect("nobody else has it yet");
            (written.variants, written.faults) = (variants, faults);
            return Ok(document);
        }
        let begin = |fault: &toml::de::Error| fault.span().map(|span| span.start);
        let first = faults.iter().min_by_key(|fault| begin(fault));
        let diagnostic = first.map(|fault| document.not_toml(fault));
        Err(SceneErrors(diagnostic.into_iter().collect()))
    }

    /// The message for an error of syntax; errors that follow from it are not reported.
    fn not_toml(&self, fault: &toml::de::Error) -> Diagnostic {
        let span = fault.span();
        let help = "a scene is TOML: `key = value` lines under `[section]` headers".to_owned();
        Diagnostic {
            message: format!("not TOML: {}", fault.message().trim_end()),
            key: String::new(),
            place: match span {
                Some(span) => Place::in_text(&self.file, &self.text, &span),
                None => self.whole_file(),
            },
            help: Some(help),
        }
    }

    /// Takes the table of variants out of the tree; also its faults.
    fn take_variants(&mut self) -> (BTreeMap<String, Table>, Vec<Diagnostic>) {
        let mut variants = BTreeMap::new();
        let mut errors = Vec::new();
        let Some(table) = self.root.remove("variant") else {
            return (variants, errors);
        };
        let help =
            || Some("write `[variant.NAME]`, then `\"dotted.key\" = value` lines".to_owned());
        let Value::Table(table) = table else {
            let message = "`variant` is not a table of variants";
            errors.push(self.diagnostic("variant", Part::Value, message, help()));
            return (variants, errors);
        };
        for (name, overrides) in table {
            if let Value::Table(overrides) = overrides {
                variants.insert(name, overrides);
            } else if errors.len() < FAULTS_LIMIT {
                let path = format!("variant.{name}");
                let message = format!("`{path}` is not a table of overrides");
                errors.push(self.diagnostic(&path, Part::Value, &message, help()));
            }
        }
        (variants, errors)
    }

    /// Where exactly this path was set; `None` if only something above it was.
    fn exact(&self, path: &str) -> Option<Origin> {
        if let Some(origin) = self.origins.get(path) {
            return Some(origin.clone());
        }
        let mut above = path.match_indices('.').map(|(end, _)| &path[..end]);
        if above.any(|above| self.origins.contains_key(above)) {
            return None;
        }
        let Places { key, value, .. } = self.written.places.at(path)?;
        Some(Origin::File {
            key: key.clone(),
            value: value.clone(),
            variant: None,
        })
    }

    fn no_such_variant(&self, name: &str) -> Diagnostic {
        let help = if self.variants.is_empty() {
            "this scene has no variants".to_owned()
        } else {
            let names = self.variants.iter().map(String::as_str);
            suggestion(name, "variants of this scene", names)
        };
        Diagnostic {
            message: format!("no variant `{name}`"),
            key: format!("variant.{name}"),
            place: self.whole_file(),
            help: Some(help),
        }
    }

    fn apply_variant(&mut self, name: &str, overrides: &Table, errors: &mut Vec<Diagnostic>) {
        for (path, value) in overrides {
            if errors.len() >= FAULTS_LIMIT {
                return;
            }
            let full = format!("variant.{name}.{path}");
            let Some(Origin::File { key, value: at, .. }) = self.exact(&full) else {
                unreachable!("every key of the file was recorded");
            };
            let origin = Origin::File {
                key,
                value: at,
                variant: Some(name.to_owned()),
            };
            if let Err((message, help)) = self.put(path, value.clone(), origin) {
                errors.push(self.diagnostic(&full, Part::Key, &message, Some(help)));
            }
        }
    }

    fn apply_argument(&mut self, argument: &str, errors: &mut Vec<Diagnostic>) {
        let fault = |message: String, help: String, key: &str| Diagnostic {
            message,
            key: key.to_owned(),
            place: Place::Set {
                argument: argument.to_owned(),
            },
            help: Some(help),
        };
        let Some((path, written)) = argument.split_once('=') else {
            let message = format!("`{argument}` sets nothing");
            errors.push(fault(message, "write `--set mpm.cell=0.002`".into(), ""));
            return;
        };
        let (path, written) = (path.trim(), written.trim());
        let origin = Origin::Set {
            argument: argument.to_owned(),
            value: written.to_owned(),
        };
        if let Err((message, help)) = self.put(path, argument_value(written), origin) {
            errors.push(fault(message, help, path));
        }
    }

    /// Sets the value at a dotted path, replacing what was there. Missing tables on the path are made. An array element
    /// must exist or be the next one.
    fn put(&mut self, path: &str, value: Value, origin: Origin) -> Result<(), (String, String)> {
        let segments: Vec<&str> = path.split('.').collect();
        if segments.iter().any(|s| s.is_empty()) || segments[0] == "variant" {
            let help = "a key is dotted, such as `mpm.cell` or `mpm.points.0.velocity`";
            return Err((format!("`{path}` is not a key of a scene"), help.to_owned()));
        }
        if let Value::Table(keys) = &value
            && self.root.get(path).is_some_and(Value::is_table)
            && !ONE_LAW.contains(&path)
        {
            let key = join(path, keys.keys().next().map_or("KEY", String::as_str));
            let help = format!("write the whole key, in quotes in a variant: `\"{key}\" = ...`");
            return Err((format!("`{path}` would replace a whole section"), help));
        }
        let mut tree = Value::Table(std::mem::take(&mut self.root));
        let put = put(&mut tree, &segments, value);
        if let Value::Table(root) = tree {
            self.root = root;
        }
        put?;
        let below = format!("{path}.");
        let after = self.origins.range(below.clone()..);
        let there: Vec<String> = after
            .map(|(known, _)| known)
            .take_while(|known| known.starts_with(&below))
            .cloned()
            .collect();
        for known in there {
            self.origins.remove(&known);
        }
        self.origins.insert(path.to_owned(), origin);
        Ok(())
    }

    /// Replaces the value at a path by one that the program has computed (a CSV file by its numbers). Messages still
    /// refer to what was written.
    pub fn replace(&mut self, path: &str, value: Value) {
        if let Some(origin) = self.origin(path) {
            // The path was just read from this tree, so setting it cannot fail.
            let _ = self.put(path, value, origin);
        }
    }

    fn whole_file(&self) -> Place {
        Place::File {
            file: self.file.clone(),
        }
    }

    /// Where a path was set: its own origin, or that of the nearest part of the path above it.
    fn origin(&self, path: &str) -> Option<Origin> {
        let mut path = path;
        loop {
            if let Some(origin) = self.exact(path) {
                return Some(origin);
            }
            path = path.rsplit_once('.')?.0;
        }
    }

    fn place(&self, path: &str, part: Part) -> Place {
        let exact = self.exact(path).is_some();
        match self.origin(path) {
            None => self.whole_file(),
            Some(Origin::Set { argument, .. }) => Place::Set { argument },
            Some(Origin::File {
                key,
                value,
                variant,
            }) => {
                let span = if part == Part::Key || !exact {
                    key
                } else {
                    value
                };
                self.in_file(&span, variant.as_ref())
            }
        }
    }

    fn in_file(&self, span: &Range<usize>, of_variant: Option<&String>) -> Place {
        let mut place = Place::in_text(&self.file, &self.text, span);
        if let Place::Line { variant, .. } = &mut place {
            *variant = of_variant.cloned();
        }
        place
    }

    /// Whether the value at a path comes from the file and not from the command line.
    pub fn is_of_file(&self, path: &str) -> bool {
        matches!(self.origin(path), Some(Origin::File { .. }))
    }

    /// Whether a path was written.
    pub fn has(&self, path: &str) -> bool {
        self.exact(path).is_some()
    }

    /// The elements of the list at a path; empty if there is no list.
    pub fn list(&self, path: &[&str]) -> &[Value] {
        let mut keys = path.iter();
        let first = keys.next().and_then(|key| self.root.get(*key));
        let found = keys.fold(first, |at, key| at?.get(*key));
        found.and_then(Value::as_array).map_or(&[], Vec::as_slice)
    }

    /// The value at a path as it was written, shortened; empty if it was not written.
    pub fn as_written(&self, path: &str) -> String {
        match self.exact(path) {
            Some(Origin::File { value, .. }) => shorten(self.text.get(value).unwrap_or_default()),
            Some(Origin::Set { value, .. }) => shorten(&value),
            None => String::new(),
        }
    }

    /// Where a value was written, for a message of one line: "line 12, mpm.cell".
    pub fn whereabouts(&self, path: &str) -> String {
        match self.place(path, Part::Value) {
            Place::Line { line, .. } => format!("line {line}, {path}"),
            Place::File { .. } | Place::Set { .. } => path.to_owned(),
        }
    }

    /// A message about a path.
    pub fn diagnostic(
        &self,
        path: &str,
        part: Part,
        message: &str,
        help: Option<String>,
    ) -> Diagnostic {
        Diagnostic {
            message: message.to_owned(),
            key: path.to_owned(),
            place: self.place(path, part),
            help,
        }
    }

    /// A message about the bytes `at` of the string at a path.
    pub fn diagnostic_within(
        &self,
        path: &str,
        at: &Range<usize>,
        message: &str,
        help: Option<String>,
    ) -> Diagnostic {
        let mut diagnostic = self.diagnostic(path, Part::Value, message, help);
        if let Some(Origin::File { value, variant, .. }) = self.exact(path) {
            let written = self.text.get(value.clone()).unwrap_or_default();
            // Escapes and multi-line strings change the positions of bytes. Then the caret marks the whole string.
            let plain = written.starts_with(['"', '\''])
                && !written.starts_with("\"\"\"")
                && !written.starts_with("'''")
                && !written.contains('\\');
            if plain {
                let start = value.start + 1;
                let span = start + at.start..start + at.end;
                diagnostic.place = self.in_file(&span, variant.as_ref());
            }
        }
        diagnostic
    }
}

/// Sets the value at a path of a tree; if it cannot be, what is wrong and what to do.
fn put(tree: &mut Value, path: &[&str], value: Value) -> Result<(), (String, String)> {
    let mut at = tree;
    for (depth, segment) in path.iter().enumerate() {
        let here = path[..depth].join(".");
        // An enumeration written as a word, such as `transfer = "flip"`, may become a table.
        if at.is_str() {
            *at = Value::Table(Table::new());
        }
        at = match at {
            Value::Table(table) => table.entry(*segment).or_insert_with(|| {
                // The first element of a list that the file does not have.
                match path.get(depth + 1) {
                    Some(&"0") => Value::Array(Vec::new()),
                    _ => Value::Table(Table::new()),
                }
            }),
            Value::Array(array) => {
                let length = array.len();
                let help = || format!("elements count from 0; `{here}` has {length}");
                let index: usize = segment.parse().map_err(|_| {
                    let what = "is not a number of an element";
                    (format!("`{here}` is a list and `{segment}` {what}"), help())
                })?;
                if index == length && depth + 1 == path.len() {
                    array.push(Value::Boolean(false));
                }
                let none = || (format!("`{here}` has no element {segment}"), help());
                array.get_mut(index).ok_or_else(none)?
            }
            _ => {
                let help = "give the key of the value itself".to_owned();
                return Err((format!("`{here}` is a plain value and holds no keys"), help));
            }
        };
    }
    *at = value;
    Ok(())
}

/// The value of a `--set` argument: TOML if it is valid, else the text itself, because shells remove quotes.
fn argument_value(written: &str) -> Value {
    toml::from_str::<Table>(&format!("value = {written}"))
        .ok()
        .filter(|table| table.len() == 1)
        .and_then(|mut table| table.remove("value"))
        .unwrap_or_else(|| Value::String(written.to_owned()))
}

/// What is wrong with a file as a whole.
fn of_file(file: &str, message: String, help: &str) -> SceneErrors {
    SceneErrors(vec![Diagnostic {
        message,
        key: String::new(),
        place: Place::File {
            file: file.to_owned(),
        },
        help: Some(help.to_owned()),
    }])
}

/// The text of a scene file, from its bytes.
fn text(bytes: io::Result<Vec<u8>>, file: &str) -> Result<String, SceneErrors> {
    let fault = |message: String, help| of_file(file, message, help);
    let bytes = bytes.map_err(|error| {
        let help = match error.kind() {
            io::ErrorKind::NotFound => {
                "check the path; scenes that come with Tandem are under scenes/"
            }
            io::ErrorKind::InvalidInput => "name one .toml file",
            _ => "the file must be readable by you",
        };
        fault(format!("cannot read the scene file: {error}"), help)
    })?;
    let text = String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        fault(
            format!("the scene file is not text: byte {at} is not UTF-8"),
            "save it as UTF-8",
        )
    })?;
    if text.trim().is_empty() {
        return Err(fault(
            "the scene file is empty".to_owned(),
            "a scene begins with `version = 1`; see docs/scene-format.md",
        ));
    }
    Ok(text)
}

/// `prefix.key`, or `key` at the root.
pub(super) fn join(prefix: &str, key: &str) -> String {
    if prefix.is_empty() {
        key.to_owned()
    } else {
        format!("{prefix}.{key}")
    }
}
