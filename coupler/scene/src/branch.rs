//! The allowed differences between a scene and the run whose state it begins with.
//!
//! A saved state consists of positions, velocities, stresses and histories of contacts. The meaning of these numbers is
//! not part of it, so there the scene must be the same. Loads and laws may differ.

use serde::Serialize;
use serde_json::Value;
use toml::Table;

use interface::config::{BodyConfig, DemConfig, MpmConfig};

use super::Scene;
use super::document::Part;
use super::needs::body_or_set;
use super::problems::Problems;
use crate::diagnostic::{SceneErrors, shorten};

/// Keys of the configurations that may differ in a branch. `*` stands for one part of a key, `**` for any number.
const MAY_CHANGE: &[&str] = &[
    "mpm.gravity.**",
    "mpm.walls.**",
    "mpm.material.*.model.*.*.**",
    "mpm.contact_force",
    "mpm.forcing.body_force.**",
    "mpm.forcing.stage.**",
    "mpm.forcing.traction.*.force.*",
    "mpm.probe.**",
    "mpm.constants.**",
    "mpm.leaving",
    "mpm.grid_contact.friction",
    "dem.gravity.**",
    "dem.contact.**",
    "dem.body_contact.*.**",
    "dem.contact_pair.**",
    "dem.group_pair.*.law.**",
    "dem.point_surfaces.**",
    "dem.contact_resolution",
    "dem.body.*.motion.**",
    "dem.body.*.surface",
];

/// Parts of a configuration that are sections of the scene.
const OUTSIDE: [&str; 6] = [
    "gravity",
    "constants",
    "contact",
    "body_contact",
    "contact_pair",
    "group_pair",
];

/// Keys of initial positions and velocities, which have no effect in a branch.
const OF_THE_START: &[&str] = &[
    "mpm.points.*.velocity.**",
    "mpm.points.*.fields.**",
    "dem.body.*.position.**",
    "dem.body.*.angle",
    "dem.body.*.velocity.**",
    "dem.body.*.spin",
];

fn fits(key: &str, pattern: &str) -> bool {
    let mut parts = key.split('.');
    for wanted in pattern.split('.') {
        match (wanted, parts.next()) {
            ("**", _) => return true,
            ("*", Some(_)) => {}
            (wanted, part) if part == Some(wanted) => {}
            _ => return false,
        }
    }
    parts.next().is_none()
}

fn among(key: &str, patterns: &[&str]) -> bool {
    patterns.iter().any(|pattern| fits(key, pattern))
}

/// What differs between two configurations: dotted key, value here, value there.
type Differences = Vec<(String, Option<Value>, Option<Value>)>;

fn differences(key: &str, here: Option<&Value>, there: Option<&Value>, found: &mut Differences) {
    match (here, there) {
        (Some(Value::Object(a)), Some(Value::Object(b))) => {
            let of_b = b.keys().filter(|name| !a.contains_key(*name));
            for name in a.keys().chain(of_b) {
                differences(&format!("{key}.{name}"), a.get(name), b.get(name), found);
            }
        }
        (Some(Value::Array(a)), Some(Value::Array(b))) if a.len() == b.len() => {
            for (i, (a, b)) in a.iter().zip(b).enumerate() {
                differences(&format!("{key}.{i}"), Some(a), Some(b), found);
            }
        }
        (a, b) if a != b => found.push((key.to_owned(), a.cloned(), b.cloned())),
        _ => {}
    }
}

fn between<T: Serialize>(side: &str, here: Option<&T>, there: Option<&T>) -> Differences {
    let [here, there] = [here, there].map(|config| {
        let value = config.map(serde_json::to_value);
        value.map(|value| value.expect("configurations have string keys only"))
    });
    let mut found = Vec::new();
    differences(side, here.as_ref(), there.as_ref(), &mut found);
    found
}

/// The body of which a key is.
fn body_of<'a>(dem: Option<&'a DemConfig>, key: &str) -> Option<&'a BodyConfig> {
    let (number, _) = key.strip_prefix("dem.body.")?.split_once('.')?;
    dem?.bodies.get(number.parse::<usize>().ok()?)
}

impl Scene {
    /// Checks whether this scene can continue from a state of a run of `parent`. Messages name that run `run`.
    ///
    /// # Errors
    /// Every key that differs and may not, with both values.
    pub fn branches_off(&self, parent: &Self, run: &str) -> Result<(), SceneErrors> {
        let mut problems = Problems::new(&self.document);
        let mut differ = between("mpm", self.mpm.as_ref(), parent.mpm.as_ref());
        differ.extend(between("dem", self.dem.as_ref(), parent.dem.as_ref()));
        for (key, here, there) in differ {
            let Some(why) = self.forbids(parent, &key, [&here, &there]) else {
                continue;
            };
            let path = self.key_of(&key);
            let [here, there] = [here, there].map(|value| {
                let value = value.filter(|value| !value.is_null());
                value.map_or("not there".to_owned(), |value| shorten(&value.to_string()))
            });
            let message = format!(
                "`{path}` is {here}; in {run}, whose state the scene begins with, it is {there}"
            );
            problems.refuse(&path, message, why);
        }
        problems.finish().map(|_| ())
    }

    /// Why a branch of `parent` may not have another value of a key; `None` if it may.
    fn forbids(
        &self,
        parent: &Self,
        key: &str,
        values: [&Option<Value>; 2],
    ) -> Option<&'static str> {
        let periodic = |value: &&Option<Value>| {
            let value = value.as_ref();
            value.is_some_and(|value| value.to_string().contains("\"periodic\""))
        };
        let moved = |scene: &Self| {
            let body = body_of(scene.dem.as_ref(), key)?;
            Some(body.motion.yielding() != [0.0; 3])
        };
        let bodies_touch = self
            .dem
            .as_ref()
            .is_some_and(|dem| dem.body_contact.is_some());
        // Points beyond a periodic wall are those at the other end.
        if fits(key, "mpm.walls.**") && values.iter().any(periodic) {
            Some("walls may change, but not from or to periodic")
        // The contact of two bodies is listed if forces move one of them.
        } else if fits(key, "dem.body.*.motion.**") && bodies_touch && moved(self) != moved(parent)
        {
            Some(
                "with `[body_contact]` a body that forces move stays one, and a fixed or driven one stays that; \
                 `motion.guided` or `motion.pushed` hold and move a free one",
            )
        } else if among(key, MAY_CHANGE) || self.drives(key) {
            None
        } else if among(key, OF_THE_START) {
            Some(
                "leave it unchanged: a branch begins with the positions and velocities of that run",
            )
        } else {
            Some("leave it unchanged: the saved state depends on it")
        }
    }

    /// Whether the key is the velocity or spin of a body that is driven; for such a body it is more than an initial
    /// value.
    fn drives(&self, key: &str) -> bool {
        let Some(body) = body_of(self.dem.as_ref(), key) else {
            return false;
        };
        let [x, y, angle] = body.motion.yielding().map(|yields| yields == 0.0);
        match key.split('.').skip(3).collect::<Vec<_>>()[..] {
            ["spin"] => angle,
            ["velocity"] => x && y,
            ["velocity", "0"] => x,
            ["velocity", "1"] => y,
            _ => false,
        }
    }

    /// The key of the scene for a key of a configuration: some parts of it are outside `[mpm]` and `[dem]` there.
    fn key_of(&self, key: &str) -> String {
        let mut parts: Vec<&str> = key.split('.').collect();
        parts.retain(|part| !["forcing", "fields", "inertia"].contains(part));
        match parts[1..] {
            ["skin"] => parts = vec!["coupling", "skin"],
            ["interface"] => parts[0] = "mpm",
            [first, ..] if OUTSIDE.contains(&first) => {
                parts.remove(0);
            }
            _ => {}
        }
        if parts[0] == "contact" && !self.document.has("contact") {
            parts[0] = "body_contact";
        }
        body_or_set(&parts.join("."), &self.document)
    }

    /// One complaint about a key.
    pub fn complaint(&self, key: &str, message: &str, help: &str) -> SceneErrors {
        let help = (!help.is_empty()).then(|| help.to_owned());
        let diagnostic = self.document.diagnostic(key, Part::Value, message, help);
        SceneErrors(vec![diagnostic])
    }

    /// The configuration of the continuum for its solver. With the state of another run comes its stress, and the laws of a branch need
    /// not bear that of the start.
    pub fn continuum(&self) -> Option<MpmConfig> {
        let mut config = self.mpm.clone()?;
        if self.start.is_some() {
            let groups = config.groups.iter_mut();
            groups.for_each(|group| group.fields.stress = None);
        }
        Some(config)
    }

    /// Notes the state with which the scene begins: its time `at` (s) and its hash `state`. A run of the resolved scene
    /// begins with the same state or fails.
    ///
    /// # Panics
    /// If the scene has no start.
    pub fn begun_with(&mut self, at: f64, state: &str) {
        let start = self.start.as_mut().expect("a scene that begins with a run");
        (start.at, start.state) = (Some(at), Some(state.to_owned()));
        let mut root: Table = toml::from_str(&self.resolved_toml).expect("it was written so");
        if let Some(toml::Value::Table(table)) = root.get_mut("start") {
            table.insert("from".into(), start.from().into());
            table.insert("state".into(), state.into());
        }
        self.resolved_toml = toml::to_string(&root).expect("the tree came from TOML");
        self.hash = super::parse::hash(&self.resolved_toml);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_star_is_one_part_of_a_key_and_two_are_any() {
        assert!(fits("mpm.gravity", "mpm.gravity.**"));
        assert!(fits("mpm.gravity.1", "mpm.gravity.**"));
        assert!(!fits("dem.body_contact", "dem.body_contact.*.**"));
        assert!(fits("dem.body_contact.linear", "dem.body_contact.*.**"));
        assert!(fits("dem.body.3.surface", "dem.body.*.surface"));
        assert!(!fits("dem.body.3.surfaces", "dem.body.*.surface"));
        assert!(!fits(
            "mpm.material.0.model.fluid",
            "mpm.material.*.model.*.*.**"
        ));
    }
}
