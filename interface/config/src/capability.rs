//! The capabilities that a solver lists in Hello (PROTOCOL.md section 12).
//!
//! A capability is a short name. Those for optional parts of the session are single words: [`SAVE`], [`SEGMENTS`],
//! [`PAIRS`], [`LAYERS`], [`CONTACTS`], [`STRESS_WORK`], [`PLASTIC_STRAIN`]. Those for what a solver takes
//! of a configuration have the form `family:member`, such as `shape:disc` or `law:linear`. If a solver names members of
//! a family, it takes those and no others. About a family that it does not name it makes no statement, and refuses in
//! answer to Configure what it does not take.

use schemars::{JsonSchema, schema_for};
use serde::{Deserialize, Serialize};

/// The solver saves its state and restores it (section 12, K-3).
pub const SAVE: &str = "save";
/// Contact of bodies with the segments between successive IMPs of a chain.
pub const SEGMENTS: &str = "segments";
/// Contact between the points of two groups.
pub const PAIRS: &str = "pairs";
/// Each group of points has its own grid layer.
pub const LAYERS: &str = "layers";
/// Frames contain the contacts: who touch, where, with which force.
pub const CONTACTS: &str = "contacts";
/// The ledger's `elastic` is a function of the points' state, and `stress_work` is reported separately.
pub const STRESS_WORK: &str = "stress_work";
/// Points are sent with the plastic strain that their material keeps (clause R-5).
pub const PLASTIC_STRAIN: &str = "plastic_strain";

/// Friction of points on bodies follows a law of the solver's own within Coulomb's bound (clause F-7).
pub const OWN_FRICTION: &str = "feature:own_friction";

/// All capabilities that are single words.
pub const VERBS: [&str; 7] = [
    SAVE,
    SEGMENTS,
    PAIRS,
    LAYERS,
    CONTACTS,
    STRESS_WORK,
    PLASTIC_STRAIN,
];
/// All families (clause K-1), of either side.
pub const FAMILIES: [&str; 14] = [
    "shape",
    "law",
    "motion",
    "overlap",
    "inertia",
    "feature",
    "transfer",
    "stress_update",
    "plane",
    "wall",
    "material",
    "contact_force",
    "fill",
    "lattice",
];

/// The capabilities of one solver.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Capabilities(pub Vec<String>);

impl Capabilities {
    /// The given capabilities.
    pub fn of(names: &[&str]) -> Self {
        Self(names.iter().map(ToString::to_string).collect())
    }

    /// Whether the solver has the capability `name`, a single word.
    pub fn has(&self, name: &str) -> bool {
        self.0.iter().any(|known| known == name)
    }

    /// Whether the solver takes `member` of `family`: it names it, or names no member of that family.
    pub fn takes(&self, family: &str, member: &str) -> bool {
        let mut named = self.members(family).peekable();
        named.peek().is_none() || named.any(|known| known == member)
    }

    /// Whether the solver has the capability `name`, a single word or `family:member`.
    pub fn meets(&self, name: &str) -> bool {
        match name.split_once(':') {
            Some((family, member)) => self.takes(family, member),
            None => self.has(name),
        }
    }

    /// The members of `family` that the solver names.
    pub fn members(&self, family: &str) -> impl Iterator<Item = &str> {
        let named = self.0.iter().filter_map(|name| name.split_once(':'));
        named.filter_map(move |(own, member)| (own == family).then_some(member))
    }
}

/// The name of a choice in the configuration, without its values (clause J-1: `"flip"`, `{"blend": {...}}`).
pub fn word(choice: &impl Serialize) -> String {
    match serde_json::to_value(choice) {
        Ok(serde_json::Value::String(word)) => word,
        Ok(serde_json::Value::Object(tagged)) => tagged.keys().next().cloned().unwrap_or_default(),
        other => unreachable!("a choice is a word or has a tag, not {other:?}"),
    }
}

/// `family:member` for each variant of a choice, by its [`word`].
pub fn members_of<T: JsonSchema>(family: &str) -> Vec<String> {
    let schema = schema_for!(T).to_value();
    let variants = schema["oneOf"].as_array().into_iter().flatten();
    let words = variants.flat_map(|variant| {
        let lists = [&variant["enum"], &variant["required"]];
        let lists = lists.into_iter().filter_map(|list| list.as_array());
        lists.flatten().chain(variant.get("const"))
    });
    let member = |word: &serde_json::Value| Some(format!("{family}:{}", word.as_str()?));
    words.filter_map(member).collect()
}
