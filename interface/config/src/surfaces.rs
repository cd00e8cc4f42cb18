//! The table of contact laws by pairs of surfaces: the law for each pair, and the faults of a table.
//!
//! Bodies have a surface, named in the scene; the surface of points is named after their material. A pair of the table
//! applies to every contact between the two surfaces, of a point and a body or of two bodies; all other contacts have
//! the general law.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::fault::Faults;
use crate::{ContactLaw, DemConfig};

/// Law between two surfaces, instead of the one for all.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ContactPair {
    /// The two surfaces, in either order: of bodies, or materials of points. Twice the same: among themselves.
    pub between: [String; 2],
    /// The law. One of another kind than that for all asks for the capability `feature:mixed_kinds`.
    pub law: ContactLaw,
}

impl ContactPair {
    /// Whether the pair is of these two surfaces, in either order.
    pub fn is_of(&self, a: &str, b: &str) -> bool {
        let [p, q] = &self.between;
        (p == a && q == b) || (p == b && q == a)
    }
}

impl DemConfig {
    /// The surfaces of bodies that have one.
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

    /// Whether points have a law of their own. Without points, the law between bodies stands in its place.
    pub(super) fn has_point_law(&self) -> bool {
        !self.point_surfaces.is_empty() || Some(self.point_contact) != self.body_contact
    }

    /// Every law between points and bodies; the general law is first.
    pub fn point_laws(&self) -> impl Iterator<Item = ContactLaw> {
        let pairs = self.point_pairs().map(|(_, pair)| pair.law);
        std::iter::once(self.point_contact).chain(pairs)
    }

    /// Every law between bodies; the general law is first. Empty if bodies do not touch one another.
    pub fn body_laws(&self) -> impl Iterator<Item = ContactLaw> {
        let pairs = self.body_pairs().map(|(_, pair)| pair.law);
        self.body_contact
            .into_iter()
            .chain(pairs.filter(|_| self.body_contact.is_some()))
    }

    /// The indices of the pairs whose law is of another kind than the general law. A solver may have contact loops that
    /// are made for one kind of law, whose numbers differ from pair to pair.
    pub fn mixed_pairs(&self) -> impl Iterator<Item = usize> {
        let of_points = self
            .point_pairs()
            .map(|pair| (pair, Some(&self.point_contact)));
        let of_bodies = self
            .body_pairs()
            .map(|pair| (pair, self.body_contact.as_ref()));
        let other = |((i, pair), law): ((usize, &ContactPair), Option<&ContactLaw>)| {
            law.is_some_and(|law| !pair.law.is_like(law)).then_some(i)
        };
        of_points.chain(of_bodies).filter_map(other)
    }

    /// Finds the faults of the table: a surface that nothing has, a repeated pair, a pair that no contact can have.
    pub(super) fn table_faults(&self, found: &mut Faults<'_>) {
        let mut known: Vec<&str> = self.body_surfaces().collect();
        known.extend(self.point_surfaces.iter().map(String::as_str));
        known.sort_unstable();
        known.dedup();
        for i in 0..self.contact_pairs.len() {
            self.pair_faults(&mut found.at(format!("contact_pair.{i}")), i, &known);
        }
    }

    /// Finds the fault of pair `i` of the table; `known` are the surfaces of bodies and points.
    fn pair_faults(&self, found: &mut Faults<'_>, i: usize, known: &[&str]) {
        let [a, b] = &self.contact_pairs[i].between;
        let strange = |name: &&String| !known.contains(&name.as_str());
        if let Some(name) = [a, b].into_iter().find(strange) {
            let help = if known.is_empty() {
                "give bodies a `surface`".to_owned()
            } else {
                format!("known: {}", known.join(", "))
            };
            let expected = "the surface of a body, or the material of points";
            return found.add("between", format!("\"{name}\""), expected, help);
        }
        let between = format!("\"{a}\" and \"{b}\"");
        if let Some(first) = self.contact_pairs[..i].iter().position(|p| p.is_of(a, b)) {
            let help = format!("pair {first} (counted from 0) has it already, in either order");
            return found.add("between", between, "each pair once", help);
        }
        let of_points = self.point_pairs().any(|(k, _)| k == i);
        let of_bodies = self.body_pairs().any(|(k, _)| k == i);
        if !of_points && !of_bodies {
            let expected =
                "the surface of a body: a contact law cannot be between two materials of points";
            found.add("between", between, expected, "name the surface of a body");
        } else if of_bodies && !of_points && self.body_contact.is_none() {
            let expected = "a law for all other bodies too";
            found.add("between", between, expected, "write `[body_contact]`");
        }
    }
}
