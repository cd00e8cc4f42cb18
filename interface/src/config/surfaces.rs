//! The table of contact laws by pairs of surfaces: which law is between what, and what makes a table impossible.
//!
//! Bodies have a surface, named in the scene; the surface of points is named after their material. A pair of the table
//! holds wherever a thing of one surface meets a thing of the other, as a point and a body or as two bodies; everything
//! else keeps the law for all.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::config::{ContactLaw, DemConfig};

/// Law between two surfaces, instead of the one for all.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ContactPair {
    /// The two surfaces, in either order: of bodies, or materials of points. Twice the same: among themselves.
    pub between: [String; 2],
    /// The law, of the same kind as the one for all.
    pub law: ContactLaw,
}

impl ContactPair {
    /// Whether the pair is of these two surfaces, in either order.
    pub fn is_of(&self, a: &str, b: &str) -> bool {
        let [p, q] = &self.between;
        (p == a && q == b) || (p == b && q == a)
    }
}

/// What is wrong with a table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TableFault {
    /// Index of the pair.
    pub pair: usize,
    /// Key below the pair.
    pub key: &'static str,
    /// What is wrong.
    pub message: String,
    /// What to do.
    pub help: String,
}

impl DemConfig {
    /// The surfaces of bodies, without the nameless one.
    pub fn body_surfaces(&self) -> impl Iterator<Item = &str> {
        let surfaces = self.bodies.iter().map(|body| body.surface.as_str());
        surfaces.filter(|name| !name.is_empty())
    }

    /// The pairs of the table that hold between points and bodies, with their indices.
    pub fn point_pairs(&self) -> impl Iterator<Item = (usize, &ContactPair)> {
        let pairs = self.contact_pairs.iter().enumerate();
        pairs.filter(|(_, pair)| {
            let [a, b] = &pair.between;
            let meet = |p: &str, q: &str| {
                self.point_surfaces.iter().any(|s| s == p) && self.body_surfaces().any(|s| s == q)
            };
            meet(a, b) || meet(b, a)
        })
    }

    /// The pairs of the table that hold between bodies, with their indices.
    pub fn body_pairs(&self) -> impl Iterator<Item = (usize, &ContactPair)> {
        let pairs = self.contact_pairs.iter().enumerate();
        pairs.filter(|(_, pair)| {
            let carried = |name: &String| self.body_surfaces().any(|s| s == name);
            pair.between.iter().all(carried)
        })
    }

    /// Every law between points and bodies, that for all first.
    pub fn point_laws(&self) -> impl Iterator<Item = ContactLaw> {
        let pairs = self.point_pairs().map(|(_, pair)| pair.law);
        std::iter::once(self.point_contact).chain(pairs)
    }

    /// Every law between bodies, that for all first; none where bodies do not touch one another.
    pub fn body_laws(&self) -> impl Iterator<Item = ContactLaw> {
        let pairs = self.body_pairs().map(|(_, pair)| pair.law);
        self.body_contact
            .into_iter()
            .chain(pairs.filter(|_| self.body_contact.is_some()))
    }

    /// What is wrong with the table: a surface that nothing has, a pair twice, a pair that nothing can meet by, a law
    /// of another kind than the one for all.
    ///
    /// The contact loops are made for one kind of law, whose numbers differ from pair to pair.
    pub fn table_faults(&self) -> Vec<TableFault> {
        let mut faults = Vec::new();
        let mut known: Vec<&str> = self.body_surfaces().collect();
        known.extend(self.point_surfaces.iter().map(String::as_str));
        known.sort_unstable();
        known.dedup();
        for (i, pair) in self.contact_pairs.iter().enumerate() {
            let mut fault = |key, message, help: String| {
                faults.push(TableFault {
                    pair: i,
                    key,
                    message,
                    help,
                });
            };
            let [a, b] = &pair.between;
            let strange = |name: &&String| !known.contains(&name.as_str());
            if let Some(name) = [a, b].into_iter().find(strange) {
                let help = if known.is_empty() {
                    "give bodies a `surface`".to_owned()
                } else {
                    format!("known: {}", known.join(", "))
                };
                let message =
                    format!("no body has the surface \"{name}\", and no points that material");
                fault("between", message, help);
                continue;
            }
            if let Some(first) = self.contact_pairs[..i].iter().position(|p| p.is_of(a, b)) {
                let message = format!("the pair of \"{a}\" and \"{b}\" is there twice");
                let help = format!("pair {first} (counted from 0) has it already, in either order");
                fault("between", message, help);
                continue;
            }
            let of_points = self.point_pairs().any(|(k, _)| k == i);
            let of_bodies = self.body_pairs().any(|(k, _)| k == i);
            if !of_points && !of_bodies {
                let message =
                    format!("\"{a}\" and \"{b}\" are points: they do not meet by a contact law");
                fault("between", message, "name the surface of a body".to_owned());
                continue;
            }
            if of_points && !pair.law.is_like(&self.point_contact) {
                fault(
                    "law",
                    another_kind(&pair.law, "points and bodies"),
                    SAME_KIND.to_owned(),
                );
            }
            match &self.body_contact {
                Some(law) if of_bodies && !pair.law.is_like(law) => {
                    fault(
                        "law",
                        another_kind(&pair.law, "bodies"),
                        SAME_KIND.to_owned(),
                    );
                }
                None if of_bodies && !of_points => fault(
                    "between",
                    format!(
                        "\"{a}\" and \"{b}\" are bodies, and there is no law for bodies in general"
                    ),
                    "write `[body_contact]`: the pairs that the table does not name have it"
                        .to_owned(),
                ),
                _ => {}
            }
        }
        faults
    }
}

const SAME_KIND: &str = "the contact loops are made for one kind of law (`linear` and `granular` are one): give every \
                         pair that kind, with its own numbers";

fn another_kind(law: &ContactLaw, between: &str) -> String {
    format!(
        "a law `{}` in the table, and another kind as the law for all {between}",
        law.name()
    )
}

impl ContactLaw {
    /// Its name in a scene.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Linear { .. } => "linear",
            Self::Granular { .. } => "granular",
            Self::HertzMindlin { .. } => "hertz_mindlin",
            Self::Area { .. } => "area",
        }
    }

    /// Whether two laws differ in numbers only; `linear` is `granular` without adhesion and rolling friction.
    pub fn is_like(&self, other: &Self) -> bool {
        let kind = |law: &Self| match law {
            Self::Linear { .. } | Self::Granular { .. } => 0,
            Self::HertzMindlin { .. } => 1,
            Self::Area { .. } => 2,
        };
        kind(self) == kind(other)
    }
}
