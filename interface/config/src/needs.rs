//! The capabilities that a configuration needs from a solver, in the terms of [`crate::capability`]
//! (PROTOCOL.md section 12).
//!
//! They are compared with the solver's Hello. A scene that needs a capability which the solver lacks is refused before
//! Configure, with the key that needs it.

use std::mem::{Discriminant, discriminant};

use serde::Serialize;

use crate::capability::{Capabilities, LAYERS, PAIRS, SEGMENTS, word};
use crate::{
    ContactLaw, DemConfig, GroupConfig, Interface, Lattice, MaterialModel, MpmConfig,
    OverlapMeasure, Wall,
};

/// A capability that a configuration needs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Need {
    /// A single word such as `segments`, or `family:member` such as `shape:disc`.
    pub capability: String,
    /// Dotted key of the configuration that is the first to need it, such as `dem.body.3.shape`.
    pub key: String,
    /// Number of keys that need it.
    pub places: usize,
}

impl Need {
    fn once(capability: impl Into<String>, key: impl Into<String>) -> Self {
        Self {
            capability: capability.into(),
            key: key.into(),
            places: 1,
        }
    }

    /// The need of these keys, if there are any.
    fn of_all(
        capability: impl Into<String>,
        mut keys: impl Iterator<Item = String>,
    ) -> Option<Self> {
        let first = Self::once(capability, keys.next()?);
        Some(Self {
            places: 1 + keys.count(),
            ..first
        })
    }
}

/// The `needs` that a solver with these capabilities lacks.
pub fn missing<'a>(needs: &'a [Need], capabilities: &Capabilities) -> Vec<&'a Need> {
    let unmet = |need: &&Need| !capabilities.meets(&need.capability);
    needs.iter().filter(unmet).collect()
}

impl MpmConfig {
    /// The capabilities that it needs from the continuum's solver, each once.
    ///
    /// Single words: `layers`, `pairs`, `segments`. Families: `shape`, `transfer`, `stress_update`, `plane`,
    /// `wall`, `material`, `fill`, `lattice` (where it is not the default), `contact_force`, whose members are the
    /// words of the configuration, and `feature`: `fields`, `probes`, `holds`, `grid_contact`, `keeps_spin`, and what sand may need.
    pub fn needs(&self) -> Vec<Need> {
        let mut needs = Vec::new();
        if self.layers {
            needs.push(Need::once(LAYERS, "mpm.layers"));
        }
        needs.extend(pairs(self.group_pairs.len()));
        if self.interface == Interface::Segments {
            needs.push(Need::once(SEGMENTS, "mpm.interface"));
        }
        needs.push(one("shape", &self.shape, "mpm.shape"));
        needs.push(one("transfer", &self.transfer, "mpm.transfer"));
        let update = &self.stress_update;
        needs.push(one("stress_update", update, "mpm.stress_update"));
        needs.push(one("plane", &self.plane, "mpm.plane"));
        let walls = self.walls.by_axis();
        let (names, walls): (Vec<&str>, Vec<Wall>) = walls.as_flattened().iter().copied().unzip();
        let key = |i: usize| format!("mpm.walls.{}", names[i]);
        needs.extend(each("wall", walls.iter(), key));
        let models = self.materials.iter().map(|material| &material.model);
        let key = |i| format!("mpm.material.{i}.model");
        needs.extend(each("material", models, key));
        let fills = self.groups.iter().map(|group| &group.fill);
        needs.extend(each("fill", fills, |i| format!("mpm.points.{i}.fill")));
        let groups = self.groups.iter().enumerate();
        let along = groups.filter(|(_, group)| group.lattice == Lattice::Outline);
        let lattices = along.map(|(g, _)| format!("mpm.points.{g}.lattice"));
        needs.extend(Need::of_all("lattice:outline", lattices));
        let force = &self.contact_force;
        needs.push(one("contact_force", force, "mpm.contact_force"));
        needs.extend(Need::of_all("feature:fields", self.formulas()));
        let probes = (0..self.probes.len()).map(|i| format!("mpm.probe.{i}"));
        needs.extend(Need::of_all("feature:probes", probes));
        let holds = (0..self.forcing.holds.len()).map(|i| format!("mpm.hold.{i}"));
        needs.extend(Need::of_all("feature:holds", holds));
        if self.grid_contact.is_some() {
            needs.push(Need::once("feature:grid_contact", "mpm.grid_contact"));
        }
        let of_groups = |feature: &str, asks: fn(&GroupConfig) -> bool| {
            let those = self.groups.iter().enumerate().filter(|(_, g)| asks(g));
            let keys = those.map(|(g, _)| format!("mpm.points.{g}.{feature}"));
            Need::of_all(format!("feature:{feature}"), keys)
        };
        needs.extend(of_groups("keeps_spin", |g| g.keeps_spin));
        needs.extend(self.needs_of_sand());
        needs
    }
}

impl MpmConfig {
    /// The keys of the fields that are formulas.
    fn formulas(&self) -> impl Iterator<Item = String> {
        let force = self.forcing.body_force.iter();
        let force = force.map(|_| "mpm.body_force".to_owned());
        let groups = self.groups.iter().enumerate();
        force.chain(groups.flat_map(|(g, group)| {
            let velocity = group.fields.velocity.as_ref().map(|_| "velocity");
            let stress = group.fields.stress.as_ref().map(|_| "stress");
            let fields = velocity.into_iter().chain(stress);
            fields.map(move |field| format!("mpm.points.{g}.{field}"))
        }))
    }

    /// The capabilities that a frictional material needs besides its yield surface.
    fn needs_of_sand(&self) -> impl Iterator<Item = Need> {
        type Asks = fn(&MaterialModel) -> bool;
        let features: [(&str, Asks); 3] = [
            ("critical_state", |m| {
                m.frictional()
                    .is_some_and(|(m, _)| m.critical_state.is_some())
            }),
            ("separates", |m| {
                m.frictional().is_some_and(|(m, _)| m.separates)
            }),
            (
                "volume_rate",
                |m| matches!(m, MaterialModel::MuI(m) if m.volume_rate > 0.0),
            ),
        ];
        features.into_iter().filter_map(|(feature, asks)| {
            let materials = self.materials.iter().enumerate();
            let those = materials.filter(|(_, material)| asks(&material.model));
            let keys = those.map(|(i, _)| format!("mpm.material.{i}.model"));
            Need::of_all(format!("feature:{feature}"), keys)
        })
    }
}

impl DemConfig {
    /// The capabilities that it needs from the bodies' solver, each once.
    ///
    /// Single words: `segments`, `pairs`. Families: `shape`, `motion`, `overlap` (where it is not the default), `inertia`,
    /// `law`, whose members are the words of the configuration, and `feature`: `friction`, `damping`, `adhesion`,
    /// `rolling_friction` of any law, `body_contact`, `contact_resolution`, `contact_pairs`, `mixed_kinds`. The default
    /// law for points, which has no stiffness, needs no capability.
    pub fn needs(&self) -> Vec<Need> {
        let mut needs = Vec::new();
        if self.interface == Interface::Segments {
            needs.push(Need::once(SEGMENTS, "mpm.interface"));
        }
        needs.extend(pairs(self.group_pairs.len()));
        let shapes = self.bodies.iter().map(|body| &body.shape);
        needs.extend(each("shape", shapes, |i| format!("dem.body.{i}.shape")));
        let motions = self.bodies.iter().map(|body| &body.motion);
        needs.extend(each("motion", motions, |i| format!("dem.body.{i}.motion")));
        if self.overlap != OverlapMeasure::default() {
            needs.push(one("overlap", &self.overlap, "dem.overlap"));
        }
        let inertias = self.bodies.iter().map(|body| &body.inertia);
        let key = |i: usize| format!("dem.body.{i}.{}", word(&self.bodies[i].inertia));
        needs.extend(each("inertia", inertias, key));
        let laws = self.laws_by_key();
        let kinds = laws.iter().map(|(_, law)| law);
        needs.extend(each("law", kinds, |i| laws[i].0.clone()));
        needs.extend(features_of(&laws));
        if self.body_contact.is_some() {
            needs.push(Need::once("feature:body_contact", "body_contact"));
        }
        if self.contact_resolution.is_some() {
            let key = "dem.contact_resolution";
            needs.push(Need::once("feature:contact_resolution", key));
        }
        let table = (0..self.contact_pairs.len()).map(|i| format!("contact_pair.{i}"));
        needs.extend(Need::of_all("feature:contact_pairs", table));
        let mut mixed: Vec<usize> = self.mixed_pairs().collect();
        mixed.sort_unstable();
        let mixed = mixed.iter().map(|i| format!("contact_pair.{i}.law"));
        needs.extend(Need::of_all("feature:mixed_kinds", mixed));
        needs
    }

    /// Every law with its key.
    fn laws_by_key(&self) -> Vec<(String, ContactLaw)> {
        let mut laws = Vec::new();
        if self.has_point_law() && self.point_contact != ContactLaw::default() {
            laws.push(("contact".to_owned(), self.point_contact));
        }
        laws.extend(
            self.body_contact
                .map(|law| ("body_contact".to_owned(), law)),
        );
        for (i, pair) in self.contact_pairs.iter().enumerate() {
            laws.push((format!("contact_pair.{i}.law"), pair.law));
        }
        for (i, pair) in self.group_pairs.iter().enumerate() {
            laws.push((format!("group_pair.{i}.law"), pair.law));
        }
        laws
    }
}

/// The need of so many pairs of groups that touch.
fn pairs(count: usize) -> Option<Need> {
    Need::of_all(PAIRS, (0..count).map(|i| format!("group_pair.{i}")))
}

/// The capabilities that the numbers of laws need besides a spring.
fn features_of(laws: &[(String, ContactLaw)]) -> Vec<Need> {
    let mut needs: Vec<Need> = Vec::new();
    for (key, law) in laws {
        for (feature, parameter) in law.features() {
            if let Some(need) = needs.iter_mut().find(|need| need.capability == feature) {
                need.places += 1;
            } else {
                let key = format!("{key}.{}.{parameter}", law.name());
                needs.push(Need::once(feature, key));
            }
        }
    }
    needs
}

/// The need of the member that one key chooses.
fn one<T: Serialize>(family: &str, choice: &T, key: &str) -> Need {
    Need::once(format!("{family}:{}", word(choice)), key)
}

/// The needs of the different members that the keys of a list choose, in the order of their first keys.
fn each<'a, T: Serialize + 'a>(
    family: &str,
    choices: impl Iterator<Item = &'a T>,
    key: impl Fn(usize) -> String,
) -> Vec<Need> {
    let mut found: Vec<(Discriminant<T>, Need)> = Vec::new();
    for (i, choice) in choices.enumerate() {
        let kind = discriminant(choice);
        match found.iter_mut().find(|(known, _)| *known == kind) {
            Some((_, need)) => need.places += 1,
            None => found.push((kind, one(family, choice, &key(i)))),
        }
    }
    found.into_iter().map(|(_, need)| need).collect()
}
