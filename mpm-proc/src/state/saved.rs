//! The state before the next step as bytes, and back.
//!
//! A new solver of the same configuration that restores the state continues to the same bits as one that was never
//! stopped. So everything that the next step reads before writing it is saved, in its present order: sums over points
//! depend on that order, and points are sorted only after they have moved far enough.
//!
//! Each type defines next to its definition which fields are saved. It destructures itself there field by field, so for
//! a new field one has to decide whether it is saved, and if not, why: it is *of the configuration*, it *follows* from
//! saved data, or it is *of one step*, which writes it before reading it.
//!
//! The bytes begin with a [`Form`]: the meaning of the numbers. A configuration of the same form continues from the
//! state with its own gravity, walls, loads and parameters of materials: so a run branches off another one. The form
//! does not contain the points of groups that are given point by point (only their number is checked). Damaged bytes
//! are refused here or detected by the session's hash: data that a step uses without a check are checked here, but not
//! every number can be.

use core::fmt::{self, Write};

use interface::config::{Fill, GroupConfig, MaterialConfig, MpmConfig, Wall};
use interface::saved::{pack, unpack};
use interface::solver::Refusal;
use serde::de::{Deserializer, Error, Visitor};
use serde::{Deserialize, Serialize, Serializer};

/// Name of the format; the number rises with every change of what is saved.
pub const FORMAT: &str = "tandem-mpm 3";

/// A refusal to restore.
pub fn refusal(message: impl Into<String>) -> Refusal {
    Refusal::new("restore", message)
}

/// The configuration as far as the numbers of a state depend on it: one line for each key.
#[derive(Debug, Default)]
pub struct Form(String);

impl Form {
    /// The form of `config`.
    pub fn of(config: &MpmConfig) -> Self {
        let MpmConfig {
            domain,
            cell,
            gravity: _, // it may change from here on
            shape,
            transfer,
            stress_update,
            drift,
            plane,
            walls,
            materials,
            groups,
            contact_force: _, // as gravity; of the loads of single points only what they remember, which each cloud checks
            forcing: _,
            constants: _,
            leaving: _,
            grid_contact,
            layers,
            group_pairs: _, // the bodies' side checks that they are the same
            interface,
            chains,
            skin,
            probes: _,  // they tell of points and keep nothing
            threads: _, // the bits are the same for any number of them
        } = config;
        let mut text = String::new();
        let mut line = |key: &str, value: &dyn fmt::Debug| {
            writeln!(text, "mpm.{key} = {value:?}").expect("a string takes all");
        };
        line("domain", domain);
        line("cell", cell);
        line("shape", shape);
        line("transfer", transfer);
        line("stress_update", stress_update);
        line("drift", drift);
        line("plane", plane);
        let periodic = [walls.left, walls.bottom].map(|wall| wall == Wall::Periodic);
        line("walls.periodic", &periodic);
        for (i, material) in materials.iter().enumerate() {
            Self::material(i, material, &mut line);
        }
        for (g, group) in groups.iter().enumerate() {
            Self::group(g, group, &mut line);
        }
        line("grid_contact", &grid_contact.is_some());
        line("layers", layers);
        line("interface", interface);
        // The first positions of markers do not matter; their number and weights do.
        for (c, chain) in chains.iter().enumerate() {
            let what = (chain.group, chain.markers.len(), chain.closed, chain.floor);
            line(&format!("chain.{c}"), &what);
        }
        line("skin", skin);
        Self(text)
    }

    /// The state of a point depends on its model. The parameters of the model may change from here on.
    fn material(i: usize, material: &MaterialConfig, line: &mut dyn FnMut(&str, &dyn fmt::Debug)) {
        let MaterialConfig {
            name: _,
            density,
            model,
        } = material;
        line(&format!("material.{i}.density"), density);
        let model = format!("{model:?}");
        let family = model.split(' ').next().unwrap_or_default();
        line(&format!("material.{i}.model"), &format_args!("{family}"));
    }

    fn group(g: usize, group: &GroupConfig, line: &mut dyn FnMut(&str, &dyn fmt::Debug)) {
        let GroupConfig {
            name,
            material,
            fill,
            spacing,
            lattice,
            velocity: _, // of the start
            fields: _,   // likewise
            contact_radius,
            rigid,
            keeps_spin,
        } = group;
        let mut of_group =
            |key: &str, value: &dyn fmt::Debug| line(&format!("points.{g}.{key}"), value);
        of_group("name", name);
        of_group("material", material);
        match fill {
            // As long as the state itself.
            Fill::Points { positions } => of_group("fill.points", &positions.len()),
            region => of_group("fill", region),
        }
        of_group("spacing", spacing);
        of_group("lattice", lattice);
        of_group("contact_radius", contact_radius);
        of_group("rigid", rigid);
        of_group("keeps_spin", keeps_spin);
    }

    /// The bytes of a `state` of this form.
    pub fn seal(&self, state: Vec<u8>) -> Vec<u8> {
        pack(FORMAT, &(Bytes(self.0.clone().into_bytes()), Bytes(state)))
    }

    /// The bytes of the state in `saved`, which must be of this form.
    ///
    /// # Errors
    /// A [`Refusal`] that says what differs.
    pub fn open(&self, saved: &[u8]) -> Result<Vec<u8>, Refusal> {
        let (form, state): (Bytes, Bytes) = unpack(FORMAT, saved)?;
        if form.0 == self.0.as_bytes() {
            return Ok(state.0);
        }
        let theirs = String::from_utf8_lossy(&form.0);
        let none = core::iter::repeat("nothing");
        let pairs = theirs.lines().chain(none.clone());
        let differs = pairs
            .zip(self.0.lines().chain(none))
            .take(theirs.lines().count().max(self.0.lines().count()))
            .find(|(a, b)| a != b);
        let (found, expected) = differs.unwrap_or(("other line ends", "its own"));
        Err(refusal(format!(
            "the state was saved with `{found}`, this configuration has `{expected}`"
        )))
    }
}

/// Bytes within a saved state. Unlike `Vec<u8>` they are copied as a whole, and a length that is larger than the data
/// allocates no memory.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Bytes(pub Vec<u8>);

impl Serialize for Bytes {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_bytes(&self.0)
    }
}

impl<'de> Deserialize<'de> for Bytes {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Copy;
        impl Visitor<'_> for Copy {
            type Value = Bytes;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("bytes")
            }

            fn visit_bytes<E: Error>(self, bytes: &[u8]) -> Result<Bytes, E> {
                Ok(Bytes(bytes.to_vec()))
            }
        }
        deserializer.deserialize_bytes(Copy)
    }
}
